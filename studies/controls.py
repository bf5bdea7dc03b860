"""The negative controls of a study: without a part of the model, a study must not come out as published."""

import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from experiments.errors import ConfigError
from experiments.participants.distribution import Distributions
from experiments.trials.design import Design
from experiments.trials.trial_config import TrialConfig
from mjsim.support.files import read_text

FILE = Path(__file__).with_name("controls.toml")


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


def read_controls(design: Design, path: Path = FILE, *, only: str | None = None) -> list[Control]:
    """The negative controls of a study.

    Args:
        design: Its people.
        path: What each control changes: user, behaviour, person, and which conditions it leaves.
        only: Name of the only control to take; None for all.

    Raises:
        ConfigError: The file is unusable, there is no such control, or no person of the design is left.
    """
    try:
        tables = msgspec.convert(tomllib.loads(read_text(path)), dict[str, _Control])
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
    behaviour, person = Distributions.of(control.behaviour), Distributions.of(control.person)

    def changed(trial: TrialConfig) -> TrialConfig:
        if control.user is not None:  # another model has other parameters
            return replace(trial, user=control.user, behaviour=behaviour, person=person)
        return replace(
            trial, behaviour=trial.behaviour.updated(behaviour), person=trial.person.updated(person)
        )

    kept = [t for t in design.trials if control.assistance is None or t.assistance in control.assistance]
    if not kept:
        raise ConfigError(
            f"control {name}: no person of the design is under {', '.join(control.assistance or [])}"
        )
    return Design(tuple(map(changed, kept)))
