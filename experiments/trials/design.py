"""Create the trials of a batch from a full factorial design or from a TOML file (docs/batches.md)."""

import itertools
import math
import re
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec

from experiments.errors import ConfigError
from experiments.trials.exclusions import Exclusions
from experiments.trials.toml_file import TomlFile
from experiments.trials.trial_config import (
    CONFOUNDERS,
    PATHS,
    SEEDS,
    SETTINGS,
    TrialConfig,
    episode_settings,
)
from hud.errors import HudError
from mjsim.house.catalogue.generated_names import generated_names, is_generated
from mjsim.house.catalogue.house_ref import parse_house
from mjsim.values.errors import MjsimError
from planner.errors import PlannerError

MAX_NUMBERS = 1_000_000


@dataclass(frozen=True)
class Design:
    """An ordered list of distinct trials, with optional exclusions of participants."""

    trials: tuple[TrialConfig, ...]
    exclusions: Exclusions | None = None

    def __post_init__(self) -> None:
        if not self.trials:
            raise ConfigError("a batch needs at least one trial")
        trial, times = Counter(self.trials).most_common(1)[0]
        if times > 1:
            seeds = ", ".join(f"{name} {getattr(trial, name)}" for name in SEEDS)
            raise ConfigError(
                f"the design has the same trial {times} times: {counted(trial.objects, 'object')}, {trial.assistance}, "
                f"{trial.user}, {seeds}; give each person in a cell a distinct seed"
            )


def factorial(
    *,
    objects: Sequence[int],
    assistance: Sequence[str],
    users: Sequence[str],
    seeds: Sequence[int],
    **same: Any,
) -> Design:
    """Create a full factorial design from lists of values. The seed varies fastest.

    `same` contains the fields of `TrialConfig` that are equal in all trials.
    """
    for name, values in (("objects", objects), ("assistance", assistance), ("user", users), ("seeds", seeds)):
        if not values:
            raise ConfigError(f"a batch needs at least one value for --{name}")
        if len(set(values)) != len(values):
            raise ConfigError(f"--{name} has a value twice: {list(values)[:20]}")
    combinations = itertools.product(objects, assistance, users, seeds)
    return Design(
        tuple(
            TrialConfig(objects=n, assistance=shown, user=user, seed=seed, **same)
            for n, shown, user, seed in combinations
        )
    )


_Seeds = int | list[int] | str | None  # a seed, several seeds, or a range such as "0:10"


class _People(msgspec.Struct, forbid_unknown_fields=True):
    people: Annotated[int, msgspec.Meta(ge=1)] | None = None
    seeds: _Seeds = None
    house_seeds: _Seeds = None
    person_seeds: _Seeds = None
    order_seeds: _Seeds = None
    trials_per_person: Annotated[int, msgspec.Meta(ge=1)] = 1
    # House names, or a range of generated homes such as "generated:0:200?rooms=5"
    houses: str | list[str] | None = None

    def each(self) -> list[dict[str, Any]]:
        """Return the seeds and the house of each trial. Shorter lists are repeated.

        The trials of a participant are spread evenly over the list of houses. Each participant starts at
        another house, so that the order of the houses varies.
        """
        lists: dict[str, list[Any]] = {
            name: _numbers_of(name, found) for name in _SEEDS if (found := getattr(self, name)) is not None
        }
        if self.houses is not None:
            lists["houses"] = house_names(self.houses)
        trials = self.trials_per_person
        shared = {name: trials if name in ("houses", "house_seeds") else 1 for name in lists}
        longest = max((math.ceil(len(seeds) / shared[name]) for name, seeds in lists.items()), default=0)
        people = longest if self.people is None else self.people
        if people == 0:
            raise ConfigError("people or seeds are missing")
        if people < longest or people > MAX_NUMBERS:
            raise ConfigError(f"people is {people}, but there are seeds for {longest}")
        everyone = lists.pop("seeds", list(range(people)))
        by_name: dict[str, list[Any]] = {name: lists.get(f"{name}s", everyone) for name in SEEDS}
        if "houses" in lists:
            by_name["house"] = lists["houses"]
        places = {name: by_name[name] for name in ("house", "house_seed") if name in by_name}
        if trials > max(map(len, places.values())):
            raise ConfigError(f"trials_per_person is {trials}; give each trial its own house or house seed")
        steps = {name: len(places[name]) // trials if name in places else 0 for name in by_name}
        return [
            {name: v[(k + steps[name] * trial) % len(v)] for name, v in by_name.items()}
            | {"trial_number": trial + 1}
            for k in range(people)
            for trial in range(trials)
        ]


_SEEDS = ("seeds", *(f"{name}s" for name in SEEDS))
_IN_A_CELL = {*SETTINGS, "people", "houses", "trials_per_person", *_SEEDS} - {"live", "trial_number", *SEEDS}


class _DesignFile(msgspec.Struct, forbid_unknown_fields=True):
    cells: Annotated[list[dict[str, Any]], msgspec.Meta(min_length=1)]
    all_cells: dict[str, Any] = msgspec.field(default_factory=dict)
    exclusions: Exclusions | None = None
    study: dict[str, Any] = msgspec.field(default_factory=dict)  # parsed by `experiments.study.file`


def read_design(path: Path, check: Callable[[Sequence[TrialConfig]], object] | None = None) -> Design:
    """Read a design from a TOML file.

    Args:
        check: Function that is called with the trials of each cell and raises an error if they are invalid.

    Raises:
        ConfigError: The file is not a valid design. The message names the line, the key and the value.
    """
    trials: list[TrialConfig] = []
    file, reached = TomlFile.read(path, "design"), ""
    try:
        content = msgspec.convert(file.content, _DesignFile)
        for number, cell in enumerate(content.cells):
            reached = f"cells[{number}]"
            of_cell = _cell_trials({**content.all_cells, **cell}, path.parent)
            if check is not None:
                check(of_cell)
            trials += of_cell
        reached = ""
        return Design(tuple(trials), content.exclusions)
    except (msgspec.ValidationError, ConfigError, HudError, MjsimError, PlannerError) as error:
        raise file.fault(error, reached, _DesignFile) from error


def read_exclusions(path: Path) -> Exclusions:
    """Read exclusions from a TOML file, or from the table `[exclusions]` in a design file."""
    file = TomlFile.read(path, "rules")
    if "cells" in file.content:
        found = read_design(path).exclusions
        if found is None:
            raise ConfigError(f"{path} has no table [exclusions]; add one, or leave out --exclude")
        return found
    try:
        return msgspec.convert(file.content, Exclusions)
    except msgspec.ValidationError as error:
        raise ConfigError(
            f"{file.fault(error, kind=Exclusions)}; docs/analysis.md describes the rules"
        ) from error


def _cell_trials(values: dict[str, Any], folder: Path) -> list[TrialConfig]:
    if unknown := sorted(set(values) - _IN_A_CELL):
        raise ConfigError(f"unknown field `{unknown[0]}`; there are {', '.join(sorted(_IN_A_CELL))}")
    settings = {name: value for name, value in values.items() if name in SETTINGS}
    people = msgspec.convert({n: v for n, v in values.items() if n not in SETTINGS}, _People).each()
    for seeds in people if "houses" in values else ():
        seeds["house"] = parse_house(seeds["house"], folder).name
    for name in PATHS:
        if isinstance(path := settings.get(name), str):
            settings[name] = parse_house(path, folder).name if name == "house" else str(folder / path)
    if isinstance(settings.get("phases"), list):
        settings["phases"] = ",".join(map(str, settings["phases"]))
    if "houses" in values and ("house" in settings or "episode" in settings):
        raise ConfigError("houses sets the houses of the trials; leave out house and episode")
    if "episode" in settings:
        if "objects" in settings or "house_seeds" in values:
            raise ConfigError(
                "an episode has its own objects and house seed; leave out objects and house_seeds"
            )
        settings = {**episode_settings(Path(settings["episode"])), **settings}
        people = [{n: s for n, s in seeds.items() if n != "house_seed"} for seeds in people]
    return [TrialConfig.of({**settings, **seeds}) for seeds in people]


def house_names(houses: str | list[str]) -> list[str]:
    """Return a list of house names, in which ranges such as `generated:0:200?split=test` are expanded."""
    if isinstance(houses, list):
        if not houses:
            raise ConfigError("houses is empty; name houses, or leave it out")
        return [name for entry in houses for name in house_names(entry)]
    return generated_names(houses) if is_generated(houses) else [houses]


def numbers(text: int | list[int] | str) -> list[int]:
    """Parse a number, a list of numbers, or text such as `6,12` or `0:10`. Ranges exclude their end."""
    if isinstance(text, int):
        text = [text]
    if isinstance(text, list):
        if not text or min(text) < 0:
            raise ConfigError(f"{text} has no number, or one below 0; name numbers from 0")
        return text
    values: list[int] = []
    for part in text.split(","):
        found = re.fullmatch(r"(\d{1,19})(?::(\d{1,19}))?", part.strip(), re.ASCII)
        if not found:
            raise ConfigError(f"{part!r} is neither a number nor a range such as 0:10")
        first = int(found[1])
        end = first + 1 if found[2] is None else int(found[2])
        if len(values) + end - first > MAX_NUMBERS:
            raise ConfigError(f"{text!r} has more than {MAX_NUMBERS} numbers")
        values.extend(range(first, end))
    if not values:
        raise ConfigError(f"{text!r} has no numbers; a range excludes its end")
    return values


def _numbers_of(name: str, text: int | list[int] | str) -> list[int]:
    try:
        return numbers(text)
    except ConfigError as error:
        raise ConfigError(f"{name}: {error}") from error


def counted(number: int, noun: str) -> str:
    return f"{number} {noun}" if number == 1 else f"{number} {noun}s"


def confounded(trials: Sequence[TrialConfig]) -> str | None:
    """Describe settings that differ between the assistance conditions, or return None if there are none."""
    return confounded_rows([trial.settings() for trial in trials])


def confounded_rows(rows: Sequence[Mapping[str, Any]]) -> str | None:
    """Describe table columns that differ between the assistance conditions, or return None."""
    faults = []
    for name in CONFOUNDERS:
        values: dict[str, set[str]] = {}
        if all(row.get(name) == rows[0].get(name) for row in rows):
            continue
        for row in rows:
            values.setdefault(str(row["assistance"]), set()).add(str(row.get(name)))
        if len({frozenset(v) for v in values.values()}) > 1:
            each = ", ".join(f"{shown}: {'/'.join(sorted(v))}" for shown, v in sorted(values.items()))
            faults.append(f"{name} ({each})")
    if not faults:
        return None
    return f"assistance is confounded with {', '.join(faults)}: a difference between conditions may be due to these"
