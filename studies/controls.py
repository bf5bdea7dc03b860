"""Negative controls: studies that lack a part of the model and should not reproduce published results."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
from msgspec.structs import replace

from experiments.errors import ConfigError
from experiments.participants.distribution import Distributions
from experiments.trials.design import Design
from experiments.trials.trial_config import TrialConfig
from mjsim.support.toml import read_toml

FILE = Path(__file__).with_name("controls.toml")


class _Control(msgspec.Struct, forbid_unknown_fields=True):
    about: str
    user: str | None = None
    assistance: list[str] | None = None
    behaviour: dict[str, Any] = msgspec.field(default_factory=dict)
    person: dict[str, Any] = msgspec.field(default_factory=dict)


@dataclass(frozen=True)
class Control:
    """A study without one part of the model, which should fail to reproduce some published results.

    Attributes:
        name: Name of the control and of its output folder.
        about: Description of the missing part.
        design: Trials of the control.
    """

    name: str
    about: str
    design: Design


def read_controls(design: Design, path: Path = FILE, *, only: str | None = None) -> list[Control]:
    """Load the negative controls of a study.

    Args:
        design: The design of the study.
        path: TOML file that describes how each control changes the user, behaviour, person and conditions.
        only: Name of the only control to return, or None for all.

    Raises:
        ConfigError: The file cannot be used, there is no such control, or a control has no participants.
    """
    try:
        tables = msgspec.convert(read_toml(path), dict[str, _Control])
    except (OSError, ValueError) as error:
        raise ConfigError(f"cannot use {path}: {error}") from error
    if only is not None and only not in tables:
        raise ConfigError(f"no control {only!r}; there are {', '.join(tables)}")
    tables = {name: table for name, table in tables.items() if only in (None, name)}
    return [Control(name, table.about, _changed(design, name, table)) for name, table in tables.items()]


def _changed(design: Design, name: str, control: _Control) -> Design:
    behaviour, person = Distributions.of(control.behaviour), Distributions.of(control.person)

    def changed(trial: TrialConfig) -> TrialConfig:
        if control.user is not None:  # another participant model has different parameters
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
