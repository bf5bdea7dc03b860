"""Which trials a batch consists of: a full factorial of options, or the cells of a TOML file (docs/designs.md)."""

import itertools
import re
import tomllib
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec
from msgspec import UNSET, UnsetType

from experiments.errors import ConfigError
from experiments.participants.behaviour import BehaviourDistribution
from experiments.trials.person_distribution import PersonDistribution
from experiments.trials.trial_config import SEEDS, TrialConfig, episode_settings

T = TypeVar("T")

LONGEST_LIST = 1_000_000  # numbers
PATHS = ("house", "episode", "story")  # relative to the design's file
# What may differ by accident between the conditions of a comparison.
CONFOUNDERS = (
    "user",
    "objects",
    "house",
    "planner",
    "fidelity",
    "points",
    "capacity",
    "time_limit",
    "phases",
    "story",
    "person",
    "behaviour",
)


@dataclass(frozen=True)
class Design:
    """The trials of a batch, in order.

    Raises:
        ConfigError: There are none, or one is there twice.
    """

    trials: tuple[TrialConfig, ...]

    def __post_init__(self) -> None:
        if not self.trials:
            raise ConfigError("a batch needs at least one trial")
        trial, times = Counter(self.trials).most_common(1)[0]
        if times > 1:
            seeds = ", ".join(f"{name} {getattr(trial, name)}" for name in SEEDS)
            raise ConfigError(
                f"the design has the same trial {times} times: {trial.objects} objects, {trial.assistance}, "
                f"{trial.user}, {seeds}; give every person of a cell an own seed"
            )


def factorial(
    *,
    objects: Sequence[int],
    assistance: Sequence[str],
    users: Sequence[str],
    seeds: Sequence[int],
    **same: Any,
) -> Design:
    """Every combination; the seed changes fastest.

    Args:
        objects: Numbers of misplaced objects.
        assistance: Assistance conditions.
        users: Participants.
        seeds: Seeds.
        same: Other fields of `TrialConfig`, the same for all trials.

    Raises:
        ConfigError: A list is empty or names a value twice, or a trial is unusable.
    """
    for name, values in (("objects", objects), ("assistance", assistance), ("user", users), ("seeds", seeds)):
        if not values:
            raise ConfigError(f"a batch needs at least one value for --{name}")
        if len(set(values)) != len(values):
            raise ConfigError(f"--{name} names a value twice: {list(values)[:20]}")
    combinations = itertools.product(objects, assistance, users, seeds)
    return Design(
        tuple(
            TrialConfig(objects=n, assistance=shown, user=user, seed=seed, **same)
            for n, shown, user, seed in combinations
        )
    )


_Count = Annotated[int, msgspec.Meta(ge=1)]
_Text = Annotated[str, msgspec.Meta(min_length=1)]
_Seeds = int | list[int] | str  # one, several, or a range such as "0:10"


class _Cell(msgspec.Struct, forbid_unknown_fields=True):
    """People who do the task under the same circumstances."""

    people: _Count | UnsetType = UNSET
    seeds: _Seeds | UnsetType = UNSET
    house_seeds: _Seeds | UnsetType = UNSET
    person_seeds: _Seeds | UnsetType = UNSET
    order_seeds: _Seeds | UnsetType = UNSET
    objects: _Count | UnsetType = UNSET
    assistance: _Text | UnsetType = UNSET
    user: _Text | UnsetType = UNSET
    house: _Text | UnsetType = UNSET
    episode: _Text | UnsetType = UNSET
    planner: _Text | UnsetType = UNSET
    fidelity: _Text | UnsetType = UNSET
    time_limit: float | UnsetType = UNSET
    regret: bool | UnsetType = UNSET
    points: _Count | UnsetType = UNSET
    capacity: _Count | UnsetType = UNSET
    phases: list[_Text] | UnsetType = UNSET
    story: _Text | UnsetType = UNSET
    person: dict[str, Any] | UnsetType = UNSET
    behaviour: dict[str, Any] | UnsetType = UNSET

    def given(self) -> dict[str, Any]:
        """The values that are there, by name."""
        return {name: v for name in self.__struct_fields__ if (v := getattr(self, name)) is not UNSET}


class _File(msgspec.Struct, forbid_unknown_fields=True):
    cells: Annotated[list[_Cell], msgspec.Meta(min_length=1)]
    all_cells: _Cell = msgspec.field(default_factory=_Cell)


def read_design(path: Path) -> Design:
    """Read a design from a TOML file.

    Raises:
        ConfigError: It cannot be read, or a value is unusable; the message names file and value.
        EpisodeError: An episode that it names cannot be read.
    """
    try:
        file = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8-sig")), _File)
    except OSError as error:
        raise ConfigError(f"cannot read design {path}: {error.strerror}") from error
    except (UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise ConfigError(f"{path} is not TOML: {error}") from error
    except msgspec.ValidationError as error:
        raise ConfigError(f"{path}: {error}; docs/designs.md lists what a design may hold") from error
    trials: list[TrialConfig] = []
    for number, cell in enumerate(file.cells):
        values = {**file.all_cells.given(), **cell.given()}
        try:
            trials += _cell_trials(values, path.parent)
        except ConfigError as error:
            raise ConfigError(f"{path}: {error} - at `$.cells[{number}]`") from error
    try:
        return Design(tuple(trials))
    except ConfigError as error:
        raise ConfigError(f"{path}: {error}") from error


def _cell_trials(values: dict[str, Any], folder: Path) -> list[TrialConfig]:
    """The trials of one cell; paths are relative to `folder`."""
    seeds, settings = _cell_seeds(values), {n: v for n, v in values.items() if n not in _PEOPLE}
    for name in PATHS:
        if name in settings and (name != "house" or settings[name].endswith(".toml")):
            settings[name] = str(folder / settings[name])
    if "episode" in settings:
        if "objects" in settings or "house_seeds" in values:
            raise ConfigError(
                "an episode has its own objects and house seed; leave out objects and house_seeds"
            )
        settings = {**episode_settings(Path(settings["episode"])), **settings}
        seeds = [{n: s for n, s in person.items() if n != "house_seed"} for person in seeds]
    if "phases" in settings:
        settings["phases"] = ",".join(settings["phases"])
    if "person" in settings:
        settings["person"] = PersonDistribution.of(settings["person"])
    if "behaviour" in settings:
        settings["behaviour"] = BehaviourDistribution.of(settings["behaviour"])
    missing = [name for name in ("objects", "assistance") if name not in settings]
    if missing:
        raise ConfigError(f"{' and '.join(missing)} must be given")
    return [TrialConfig(**{**settings, **person}) for person in seeds]


_PEOPLE = ("people", "seeds", *(f"{name}s" for name in SEEDS))


def _cell_seeds(values: dict[str, Any]) -> list[dict[str, int]]:
    """The three seeds of every person of a cell; lists are gone through again for more people."""
    lists = {name: numbers(values[name]) for name in _PEOPLE[1:] if name in values}
    longest = max((len(seeds) for seeds in lists.values()), default=0)
    people = values.get("people", longest)
    if people == 0:
        raise ConfigError("people must be given, or seeds for each of them")
    if people < longest or people > LONGEST_LIST:
        raise ConfigError(f"people is {people}, but there are seeds for {longest}")
    everyone = lists.pop("seeds", range(people))
    by_name = {name: lists.get(f"{name}s", everyone) for name in SEEDS}
    return [{name: seeds[k % len(seeds)] for name, seeds in by_name.items()} for k in range(people)]


def numbers(text: int | list[int] | str) -> list[int]:
    """Whole numbers: one, several, or as in `6,12` and `0:10` (the end not included), also mixed.

    Raises:
        ConfigError: It is none of these, too long, or negative.
    """
    if isinstance(text, int):
        text = [text]
    if isinstance(text, list):
        if not text or min(text) < 0:
            raise ConfigError(f"{text} must name at least one number, none of them negative")
        return text
    values: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"(\d{1,19})(?::(\d{1,19}))?", part.strip(), re.ASCII)
        if not found:
            raise ConfigError(f"{part!r} is neither a number nor a range such as 0:10")
        first = int(found[1])
        end = first + 1 if found[2] is None else int(found[2])
        if len(values) + end - first > LONGEST_LIST:
            raise ConfigError(f"{text!r} names more than {LONGEST_LIST} numbers")
        values.extend(range(first, end))
    if not values:
        raise ConfigError(f"{text!r} names no number; a range's end is not included")
    return values


def counted(number: int, noun: str) -> str:
    """`1 trial`, `2 trials`."""
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def confounded(trials: Sequence[TrialConfig]) -> str | None:
    """One line on what differs between the assistance conditions besides the assistance; None if nothing does."""
    return confounded_rows([trial.settings() for trial in trials])


def confounded_rows(rows: Sequence[Mapping[str, Any]]) -> str | None:
    """As `confounded`, of rows of a table."""
    faults = []
    for name in CONFOUNDERS:
        values: dict[str, set[str]] = {}
        for row in rows:
            values.setdefault(str(row["assistance"]), set()).add(str(row.get(name)))
        if len({frozenset(v) for v in values.values()}) > 1:
            each = ", ".join(f"{shown}: {'/'.join(sorted(v))}" for shown, v in sorted(values.items()))
            faults.append(f"{name} ({each})")
    if not faults:
        return None
    return f"assistance is confounded with {', '.join(faults)}: a difference between conditions may be due to these"
