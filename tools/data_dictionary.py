"""The data dictionary docs/data.md, made from the types that are written: `python -m tools.data_dictionary`."""

import dataclasses
import inspect
import re
import sys
import typing
from collections.abc import Iterator, Mapping
from typing import Any

from experiments.record.columns import HEALTH
from experiments.record.displays import Displays
from experiments.record.event_check import OUTCOMES, OutcomeEvent
from experiments.record.events import TYPES, LoggedEvent
from experiments.record.health import COUNTED
from experiments.record.metrics import Metrics
from experiments.trials.trial_config import SETTINGS, TrialConfig
from mjsim.motion_parameters import GROUPS
from mjsim.person_parameters import PersonParameters

_HEAD = """\
# Data dictionary

Made from the types by `make data-dictionary`; change it there. Lengths are metres, times simulated seconds, angles
radians, z is up.

## metrics.json

One object per run. All but the last three rows follow from event log and trajectory; `mjsim metrics` computes them
anew and `mjsim replay` checks them. [metrics.md](metrics.md) defines the metrics, [health.md](health.md) the health of
the physics.
"""
_TABLES = """\
## trials.parquet, trials.csv

One row per trial of a batch. The columns are the rows of `metrics.json` under the same names, with null (in CSV:
nothing) where a value is not known. CSV leaves out columns that are null throughout.
"""
_EVENTS = """\
## events.jsonl

One JSON object per line, in the order in which things happened. Every line has

| field | type | what |
|---|---|---|
"""
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


def data_dictionary() -> str:
    """The whole page, Markdown."""
    lines = [
        _HEAD,
        "| field | type | what |",
        "|---|---|---|",
        *_metrics_rows(),
        "",
        _TABLES,
        _EVENTS.rstrip(),
    ]
    lines += _rows(_described(LoggedEvent))
    lines.append("| `event` | str | Kind of the event, one of those below. |")
    for kind in TYPES:
        lines += ["", f"### {kind.__struct_config__.tag}", "", _summary(kind), "", *_table(kind)]
    lines += ["", "### What happened in the world", "", "| event | when |", "|---|---|"]
    lines += [f"| `{kind.value}` | {when} |" for kind, when in OUTCOMES.items()]
    lines += ["", "Each has", "", *_table(OutcomeEvent)]
    return "\n".join(lines) + "\n"


def _metrics_rows() -> Iterator[str]:
    hints = typing.get_type_hints(TrialConfig)
    columns = {name: about for name, about in SETTINGS.items() if name not in ("person", "behaviour")}
    yield from _rows({name: (_type_name(hints[name]), str(a.description)) for name, a in columns.items()})
    yield "| `fingerprint` | str | Hash of the settings and of all else that the trial depends on. |"
    yield "| `simulated` | bool | Whether the participant is simulated, that is, any but `human`. |"
    yield from _rows(_described(PersonParameters, leave_out=set(GROUPS)), prefix="person_")
    yield "| `behaviour_...` | float | Values of the participant model, where it has any (docs/participants.md). |"
    yield from _rows(_described(Metrics))
    yield from _rows(_described(Displays))
    for name in HEALTH:
        for statistic, words in _STATISTICS.items():
            yield f"| `{statistic}_{name}` | float | {words} {_QUANTITIES[name]}, {name.rsplit('_', 1)[1]}. |"
    yield "| `releases_settled` | int | How often a released object came to rest. |"
    for name, kind in COUNTED.items():
        yield f"| `{name}` | int | Number of events `{kind.value}`. |"
    yield "| `simulated_s` | float | Simulated time at the last state, s. |"
    yield "| `signal`, `error` | str | As in the event `end`; only where there is one. |"
    for name, (kind_name, what) in _CIRCUMSTANCES.items():
        yield f"| `{name}` | {_cell(kind_name)} | {what} |"


def _table(kind: type[LoggedEvent]) -> list[str]:
    return ["| field | type | what |", "|---|---|---|", *_rows(_described(kind))]


def _rows(described: Mapping[str, tuple[str, str]], prefix: str = "") -> Iterator[str]:
    for name, (type_name, what) in described.items():
        yield f"| `{prefix}{name}` | {_cell(type_name)} | {_cell(what)} |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("None", "null")


def _described(
    kind: type[Any], leave_out: set[str] | frozenset[str] = frozenset()
) -> dict[str, tuple[str, str]]:
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


def _summary(kind: type[Any]) -> str:
    return (inspect.getdoc(kind) or "").split("\n\nAttributes:", 1)[0].replace("\n", " ")


def _type_name(hint: Any) -> str:
    origin, arguments = typing.get_origin(hint), typing.get_args(hint)
    if origin is None:
        return _NAMES.get(hint.__name__, str(hint.__name__))
    if origin is typing.Literal:
        return "str"
    if origin in (list, dict, tuple):
        return f"{origin.__name__}[{', '.join(map(_type_name, arguments))}]"
    return " | ".join(_type_name(argument) for argument in arguments)


def main() -> None:
    """Print the page."""
    sys.stdout.write(data_dictionary())


if __name__ == "__main__":
    main()
