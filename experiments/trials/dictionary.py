"""What each column of a table of trials means, from the types that write it."""

import dataclasses
import inspect
import re
import typing
from typing import Any

from experiments.record.columns import HEALTH
from experiments.record.displays import Displays
from experiments.record.health import COUNTED
from experiments.record.metrics import Metrics
from experiments.trials.trial_config import SETTINGS, TrialConfig
from mjsim.values.motion_parameters import GROUPS
from mjsim.values.person_parameters import PersonParameters

Columns = dict[str, tuple[str, str]]  # type and description, by name

_QUANTITIES = {
    "penetration_m": "depth to which objects or the body overlap with something",
    "trunk_penetration_m": "depth to which the trunk overlaps with the house",
    "weld_error_m": "distance between a hand and what it holds, from where it should be",
    "weld_error_rad": "angle between how a hand holds something and how it should",
    "settle_s": "time that a released object takes to come to rest",
}
_STATISTICS = {"max": "Largest", "p99": "99th percentile of the", "mean": "Mean"}
_CIRCUMSTANCES = {
    "frames_sha256": ("str | null", "SHA-256 of the frames filmed, pixel for pixel; null without a film."),
    "renderer": ("str", "What drew the frames."),
    "wall_s": ("float", "Time that the trial took on the wall clock, s."),
}
_NAMES = {"NoneType": "null", "VisitKind": "str", "Status": "str", "Refusal": "str", "EventKind": "str"}


def trial_columns() -> Columns:
    """Type and description of the columns of a table of trials, in order."""
    hints = typing.get_type_hints(TrialConfig)
    found: Columns = {
        name: (_type_name(hints[name]), str(about.description))
        for name, about in SETTINGS.items()
        if name not in ("person", "behaviour")
    }
    found["fingerprint"] = ("str", "Hash of the settings and of all else that the trial depends on.")
    found["rooms"] = ("int", "How many rooms the house has.")
    found["area_m2"] = ("float", "Area of their floor, m2.")
    found["simulated"] = ("bool", "Whether the participant is simulated, that is, any but `human`.")
    person = described(PersonParameters, leave_out=set(GROUPS))
    found |= {f"person_{name}": about for name, about in person.items()}
    found["behaviour_..."] = (
        "float",
        "Values of the participant model, where it has any (docs/participants.md).",
    )
    found |= {**described(Metrics), **described(Displays)}
    for name in HEALTH:
        for statistic, words in _STATISTICS.items():
            unit = name.rsplit("_", 1)[1]
            found[f"{statistic}_{name}"] = ("float", f"{words} {_QUANTITIES[name]}, {unit}.")
    found["releases_settled"] = ("int", "How often a released object came to rest.")
    found |= {name: ("int", f"Number of events `{kind.value}`.") for name, kind in COUNTED.items()}
    found["simulated_s"] = ("float", "Simulated time at the last state, s.")
    found["signal, error"] = ("str", "As in the event `end`; only where there is one.")
    return found | _CIRCUMSTANCES


def described(kind: type[Any], leave_out: set[str] | frozenset[str] = frozenset()) -> Columns:
    """Type and description of the fields that a class itself has.

    Raises:
        KeyError: Its docstring does not describe one of them.
    """
    told, hints = _attributes(kind), typing.get_type_hints(kind)
    names = (
        [field.name for field in dataclasses.fields(kind)]
        if dataclasses.is_dataclass(kind)
        else kind.__annotations__
    )
    return {name: (_type_name(hints[name]), told[name]) for name in names if name not in leave_out}


def _attributes(kind: type[Any]) -> dict[str, str]:
    """The section `Attributes:` of a docstring, by name."""
    text = (inspect.getdoc(kind) or "").split("Attributes:\n", 1)[1]
    text = re.split(r"\n\n?(?=\S)", text)[0]
    entries = re.split(r"\n(?=    \w+(?:, \w+)*: )", "\n" + text)[1:]
    pairs = (entry.strip().split(": ", 1) for entry in entries)
    told = {name: " ".join(what.split()) for name, what in pairs}
    return {name: what[0].upper() + what[1:] if what[1:2].isalpha() else what for name, what in told.items()}


def _type_name(hint: Any) -> str:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is None:
        return _NAMES.get(hint.__name__, str(hint.__name__))
    if origin is typing.Literal:
        return "str"
    if origin in (list, dict, tuple):
        return f"{origin.__name__}[{', '.join(map(_type_name, arguments))}]"
    return " | ".join(_type_name(argument) for argument in arguments)
