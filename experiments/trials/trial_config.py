"""Settings of a trial, from which command-line options and table columns are derived."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any, cast

import msgspec

from experiments.errors import ConfigError
from experiments.participants.distribution import Distributions
from experiments.participants.registry import DEFAULT_PARTICIPANT
from experiments.record.phases import STORY, TASK, TRAINING, phases_of
from experiments.trials.person import check_person, view_limits
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.values.episode import CAPACITY, POINTS, Episode
from mjsim.values.options import CAPACITIES, FIDELITIES, WorldOptions
from planner.solvers import DEFAULT_SOLVER

SECONDS_PER_OBJECT = 150.0  # several times as long as the slowest simulated participant needs
SEEDS = ("house_seed", "person_seed", "order_seed")
NO_ASSISTANCE = "none"
DRAWN_BY = ("auto", "browser", "server")
MAX_SEED = 2**63 - 1  # largest integer in tables
_AS_SEED = cast(int, None)  # default value, which is replaced by `seed`


class TrialConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The settings of a trial. Trials with equal settings have equal records.

    Each of the other three seeds is set to `seed` if it is not given. Afterwards, `seed` is None.

    Attributes:
        objects: number of misplaced objects, from 1 to the number of points.
        assistance: assistance condition.
        user: participant.
        house: name of a house, path of its folder or catalogue.toml, or a generated home such as `generated:7` or
            `generated:7?rooms=5` (docs/generated-houses.md).
        planner: solver of the routing problem.
        time_limit: simulated time after which the trial ends, in seconds (default: 60, plus 150 per object).
        live: plan in real time, with proofs in the background, as for a person. The run depends on the machine, but a
            replay shows the same plans.
        fidelity: extent of the physics: `full` for everything, `event` only for falling objects (docs/simulation.md).
        regret: log the regret of every visit: the extra length of the remaining task compared with the best visit.
            Takes up to 1 s per trial.
        house_seed: seed of the house: objects, their places, and the start.
        person_seed: seed of the participant's random choices.
        order_seed: seed of the order of the task list (PAPER section 5).
        points: number of candidate places for objects, at least 1 m apart, that are shared by all levels of difficulty
            (PAPER section 4). Small houses have room for fewer.
        trial_number: number of the trial among those of the person, from 1 (`trials_per_person` in docs/batches.md).
        capacity: largest number of objects carried at a time; with 1, only the right hand is used.
        episode: path of an episode.json to run instead of sampling an episode. Its objects, house and seed apply.
        phases: phases in order, separated by commas: `story`, `flythrough` and `training` may come before the `task`
            (docs/trials.md).
        story: path of a text file to show in the phase `story` instead of the default text.
        training_assistance: assistance condition of the training, the same for all conditions of the task (PAPER
            section 7).
        draw: renderer of a person's view: `browser`, `server`, or `auto` for the browser if it can (docs/browser.md).
        field_of_view_range: range in radians in which a person may choose the horizontal field of view if the browser
            draws; without it, the field of view is the person's parameter (docs/browser.md).
        person: distributions of the person's parameters, drawn by the person's seed (docs/participants.md).
        behaviour: distributions of the parameters of the participant model (docs/participants.md).
        seed: value of the seeds that are not given.

    Raises:
        ConfigError: A value is invalid.
    """

    objects: int
    assistance: str
    user: str = DEFAULT_PARTICIPANT
    house: str = "apartment"
    planner: str = DEFAULT_SOLVER
    time_limit: float | None = None
    live: bool = False
    fidelity: str = WorldOptions.fidelity
    regret: bool = True
    house_seed: int = _AS_SEED
    person_seed: int = _AS_SEED
    order_seed: int = _AS_SEED
    points: int = POINTS
    trial_number: int = 1
    capacity: int = CAPACITY
    episode: str | None = None
    phases: str = TASK
    story: str | None = None
    training_assistance: str = NO_ASSISTANCE
    draw: str = DRAWN_BY[0]
    field_of_view_range: str | None = None
    person: Distributions = Distributions()
    behaviour: Distributions = Distributions()
    seed: int | None = None

    @classmethod
    def of(cls, settings: Mapping[str, Any]) -> "TrialConfig":
        """Create a configuration from a mapping. Missing settings have their default values."""
        try:
            return msgspec.convert(settings, cls, dec_hook=lambda kind, given: kind.of(given))
        except msgspec.ValidationError as error:
            raise ConfigError(str(error)) from error

    def __post_init__(self) -> None:
        for name in ("assistance", "user", "house", "planner", "fidelity", "phases", "draw"):
            if not isinstance(getattr(self, name), str):
                raise ConfigError(f"{name} must be text, got {getattr(self, name)!r}")
        seed = self.seed
        for name in SEEDS:
            if getattr(self, name) is None:
                self._set(name, seed)
            _check_seed(name if getattr(self, name) != seed else "seed", getattr(self, name))
        self._set("seed", None)
        house = parse_house(self.house)
        self._set("house", house.name)
        for name in PATHS:
            if (path := getattr(self, name)) is not None and (name != "house" or house.is_path):
                self._set(name, str(Path(path).absolute()))
        self._set("phases", ",".join(phases_of(self.phases)))
        self._check()

    def _set(self, name: str, value: object) -> None:
        msgspec.structs.force_setattr(self, name, value)

    def _check(self) -> None:
        if self.fidelity not in FIDELITIES:
            raise ConfigError(f"no fidelity {self.fidelity!r}; choose one of {', '.join(FIDELITIES)}")
        if self.draw not in DRAWN_BY:
            raise ConfigError(f"no draw {self.draw!r}; choose one of {', '.join(DRAWN_BY)}")
        if self.trial_number < 1:
            raise ConfigError(f"trial_number is {self.trial_number}; it must be at least 1")
        if self.points < 1:
            raise ConfigError(f"points is {self.points}; a house needs at least 1")
        if self.episode is None and not 1 <= self.objects <= self.points:
            raise ConfigError(
                f"objects is {self.objects}; it must be 1 to {self.points}, the number of points"
            )
        if self.capacity not in CAPACITIES:
            raise ConfigError(f"capacity is {self.capacity}; a person with two hands carries 1 or 2 objects")
        if self.time_limit is not None and not 0 < self.time_limit < math.inf:
            raise ConfigError(f"time_limit is {self.time_limit} s; it must be positive and finite")
        if self.story is not None and STORY not in self.phase_names:
            raise ConfigError(f"story is {self.story}, but the phases lack story; add it")
        if self.training_assistance != NO_ASSISTANCE and TRAINING not in self.phase_names:
            raise ConfigError(
                f"training_assistance is {self.training_assistance}, but the phases lack training; add it"
            )
        check_person(self.person)
        if self.field_of_view_range is not None:
            view_limits(self.field_of_view_range)

    @property
    def phase_names(self) -> tuple[str, ...]:
        """Names of the trial's phases, in order."""
        return phases_of(self.phases)

    @property
    def view_limits(self) -> tuple[float, float] | None:
        """The limits of the participant's field of view in radians, or None if it cannot be changed."""
        return None if self.field_of_view_range is None else view_limits(self.field_of_view_range)

    @property
    def limit(self) -> float:
        """The simulated time in seconds after which the trial ends."""
        return self.time_limit if self.time_limit is not None else 60.0 + SECONDS_PER_OBJECT * self.objects

    def settings(self) -> dict[str, Any]:
        """Return all settings by name as JSON values, including the default time limit."""
        values = {name: getattr(self, name) for name in SETTINGS}
        return {
            **values,
            "time_limit": self.limit,
            "person": self.person.as_dict(),
            "behaviour": self.behaviour.as_dict(),
        }


SETTINGS = tuple(name for name in TrialConfig.__struct_fields__ if name != "seed")  # those that are recorded
DEFAULTS: dict[str, Any] = {f.name: f.default for f in msgspec.structs.fields(TrialConfig)}
PATHS = ("house", "episode", "story")
# Settings that may accidentally differ between the conditions that are compared
CONFOUNDERS = tuple(
    name
    for name in SETTINGS
    if name not in ("assistance", "live", "regret", "episode", "trial_number", *SEEDS)
)


def episode_settings(path: Path) -> dict[str, Any]:
    """Return the trial settings that are determined by an episode file."""
    episode = Episode.load(path)
    return {
        "objects": len(episode.objects),
        "house": episode.house,
        "house_seed": episode.seed,
        "episode": str(path),
    }


def _check_seed(name: str, seed: int | None) -> None:
    if seed is None:
        raise ConfigError(f"a trial needs a seed, or each of {', '.join(SEEDS)}")
    if not 0 <= seed <= MAX_SEED:
        raise ConfigError(f"{name} is {seed}; it must be 0 to {MAX_SEED}")
