"""Studies with simulated people: the cells of a design file, in the order in which people would arrive."""

import dataclasses
import itertools
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import ConfigError
from experiments.origin import HUMAN, is_simulated
from experiments.participants.behaviour import BehaviourDistribution
from experiments.studies import FOLDER
from experiments.trials.design import Design, read_design
from experiments.trials.person_distribution import PersonDistribution
from experiments.trials.trial_config import TrialConfig

CONTROLS = FOLDER / "controls.toml"


def study_path(name: str) -> Path:
    """The file of a study: a path, or the name of one that comes with the package (`paper`); folders do not count.

    Raises:
        ConfigError: There is neither.
    """
    own, packaged = Path(name), FOLDER / f"{name}.toml"
    if not own.is_file() and not packaged.is_file():
        raise ConfigError(
            f"no study {name!r}; `paper` is the published one, or give the path of a design file"
        )
    return own if own.is_file() else packaged


def read_study(path: Path, people: int | None = None) -> Design:
    """The simulated people of a study file; cells take people in turn, as long as they have room.

    Args:
        path: A design file (docs/designs.md).
        people: How many, the first of the design; None for all.

    Raises:
        ConfigError: The file is unusable, there are fewer people, or one is to take part in person.
        EpisodeError: An episode that it names cannot be read.
    """
    cells: dict[Any, list[TrialConfig]] = {}
    for trial in read_design(path).trials:
        if not is_simulated(trial.user):
            raise ConfigError(
                f"{path}: user {HUMAN} is nobody who can be simulated; name a participant model"
            )
        cells.setdefault((trial.assistance, trial.objects, trial.user, trial.house), []).append(trial)
    turns = itertools.zip_longest(*cells.values())
    in_turn = [trial for turn in turns for trial in turn if trial is not None]
    if people is None:
        return Design(tuple(in_turn))
    if not 1 <= people <= len(in_turn):
        raise ConfigError(f"--people {people} must be 1 to {len(in_turn)}, the people of {path}")
    return Design(tuple(in_turn[:people]))


class _Control(msgspec.Struct, forbid_unknown_fields=True):
    about: str
    user: str | None = None
    assistance: list[str] | None = None
    behaviour: dict[str, Any] = msgspec.field(default_factory=dict)
    person: dict[str, Any] = msgspec.field(default_factory=dict)


@dataclass(frozen=True)
class Control:
    """A study that lacks something, and so must fail what depends on it.

    Attributes:
        name: Of its folder.
        about: What it lacks.
        design: Its people.
    """

    name: str
    about: str
    design: Design


def read_controls(design: Design, path: Path = CONTROLS, *, only: str | None = None) -> list[Control]:
    """The negative controls of a study.

    Args:
        design: Its people.
        path: What each control changes: user, behaviour, person, and which conditions it leaves.
        only: Name of the only control to take; None for all.

    Raises:
        ConfigError: The file is unusable, there is no such control, or nobody of the design is left.
    """
    try:
        tables = msgspec.convert(tomllib.loads(path.read_text(encoding="utf-8-sig")), dict[str, _Control])
    except (
        OSError,
        UnicodeDecodeError,
        RecursionError,
        tomllib.TOMLDecodeError,
        msgspec.ValidationError,
    ) as error:
        raise ConfigError(f"cannot use {path}: {error}") from error
    if only is not None and only not in tables:
        raise ConfigError(f"no control {only!r}; there are {', '.join(tables)}")
    tables = {name: table for name, table in tables.items() if only in (None, name)}
    return [Control(name, table.about, _changed(design, name, table)) for name, table in tables.items()]


def _changed(design: Design, name: str, control: _Control) -> Design:
    behaviour, person = BehaviourDistribution.of(control.behaviour), PersonDistribution.of(control.person)

    def changed(trial: TrialConfig) -> TrialConfig:
        if control.user is not None:  # another model has other parameters
            return dataclasses.replace(trial, user=control.user, behaviour=behaviour, person=person)
        return dataclasses.replace(
            trial, behaviour=trial.behaviour.updated(behaviour), person=trial.person.updated(person)
        )

    kept = [t for t in design.trials if control.assistance is None or t.assistance in control.assistance]
    if not kept:
        raise ConfigError(
            f"control {name}: nobody of the design is under {', '.join(control.assistance or [])}"
        )
    return Design(tuple(map(changed, kept)))
