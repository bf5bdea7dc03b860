"""What decides how a trial goes."""

import dataclasses
import math
from dataclasses import InitVar, dataclass, field
from pathlib import Path
from typing import Any, cast

from experiments.errors import ConfigError
from experiments.participants import DEFAULT_PARTICIPANT
from experiments.participants.behaviour import BehaviourDistribution
from experiments.runs.phases import STORY, TASK, phases_of
from experiments.trials.person_distribution import PersonDistribution
from mjsim.episode import CAPACITY, POINTS, Episode
from mjsim.options import CAPACITIES, FIDELITIES, WorldOptions
from planner.solver import DEFAULT_SOLVER

SECONDS_PER_OBJECT = 150.0  # s; several times what the slowest searcher takes
SEEDS = {  # name -> seed of what
    "house_seed": "the house: what lies where, and the start",
    "person_seed": "the participant's chance",
    "order_seed": "the order of the list",
}
LARGEST_SEED = 2**63 - 1  # tables hold 64 bits
_AS_SEED = cast(int, None)  # filled in from `seed`


@dataclass(frozen=True)
class TrialConfig:
    """Everything that decides how a trial goes; equal configurations give equal records.

    Attributes:
        objects: How many misplaced objects.
        assistance: Assistance condition.
        seed: Those of the three seeds that are not given.
        user: Participant.
        house: House name, or path of a catalogue; a path is made absolute.
        planner: Solver of the routing problem, by name or `package.module:attribute`.
        time_limit: Simulated time after which the trial ends, s; None for a generous one.
        live: Plan in real time, with proofs in the background, as for a person. Such a run depends on the machine's
            speed; a replay shows the plans that were shown.
        fidelity: How much of the world is physics: `full`, `windows` or `event` (docs/fidelity.md).
        regret: Log for every visit by how much it makes the rest of the task longer than the best one would.
        house_seed: What lies where, and the start.
        person_seed: The chance of the participant.
        order_seed: The order of the list in the HUD (PAPER section 5).
        points: Points of the house where objects may lie; levels of difficulty share them (PAPER section 4).
        capacity: How many objects are carried at most.
        episode: Path of an episode to run instead of sampling one; it is made absolute.
        phases: What the participant goes through, in order, joined by commas: `story`, `flythrough` and `training` may
            come before the `task` (docs/procedure.md). Only with `flythrough` does a simulated participant have to find
            the bins that it did not see; else it knows them all.
        story: Path of a text to read instead of the usual story; it is made absolute.
        person: How speeds, reach, size and senses of the participant are distributed (docs/people.md).
        behaviour: How the parameters of the participant model are distributed (docs/participants.md).

    Raises:
        ConfigError: A value is unusable.
    """

    objects: int
    assistance: str
    seed: InitVar[int | None] = None
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
    capacity: int = CAPACITY
    episode: str | None = None
    phases: str = TASK
    story: str | None = None
    person: PersonDistribution = field(default_factory=PersonDistribution)
    behaviour: BehaviourDistribution = field(default_factory=BehaviourDistribution)

    def __post_init__(self, seed: int | None) -> None:
        for name in SEEDS:
            if getattr(self, name) is None:
                object.__setattr__(self, name, seed)
            _check_seed(name if getattr(self, name) != seed else "seed", getattr(self, name))
        if self.house.endswith(".toml"):
            object.__setattr__(self, "house", str(Path(self.house).absolute()))
        for name in ("episode", "story"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, str(Path(getattr(self, name)).absolute()))
        object.__setattr__(self, "phases", ",".join(phases_of(self.phases)))
        self._check()

    def _check(self) -> None:
        if self.fidelity not in FIDELITIES:
            raise ConfigError(f"no fidelity {self.fidelity!r}; choose one of {', '.join(FIDELITIES)}")
        if self.points < 1:
            raise ConfigError(f"points is {self.points}; a house needs at least 1")
        if self.episode is None and not 1 <= self.objects <= self.points:
            raise ConfigError(
                f"objects is {self.objects}; it must be 1 to {self.points}, the number of points"
            )
        if self.capacity not in CAPACITIES:
            raise ConfigError(f"capacity is {self.capacity}; a person with two hands carries 1 or 2 objects")
        if self.time_limit is not None and not 0 < self.time_limit < math.inf:
            raise ConfigError(f"time limit must be positive, got {self.time_limit} s")
        if self.story is not None and STORY not in self.phase_names:
            raise ConfigError(
                f"there is a story, {self.story}, but no phase to read it in; add story to the phases"
            )

    @property
    def phase_names(self) -> tuple[str, ...]:
        """The phases, one by one."""
        return phases_of(self.phases)

    @property
    def limit(self) -> float:
        """Simulated time after which the trial ends, s."""
        return self.time_limit if self.time_limit is not None else 60.0 + SECONDS_PER_OBJECT * self.objects

    def settings(self) -> dict[str, Any]:
        """All of it by name, with the time limit filled in; JSON-ready."""
        described = {"person": self.person.as_dict(), "behaviour": self.behaviour.as_dict()}
        return {**dataclasses.asdict(self), "time_limit": self.limit, **described}


def episode_settings(path: Path) -> dict[str, Any]:
    """What an episode file decides of a trial, as arguments of `TrialConfig`.

    Raises:
        EpisodeError: The file cannot be read, or does not describe an episode.
    """
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
    if not 0 <= seed <= LARGEST_SEED:
        fault = "not be negative" if seed < 0 else f"be at most {LARGEST_SEED}"
        raise ConfigError(f"{name} must {fault}, got {seed}")
