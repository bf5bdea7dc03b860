"""Which columns of a table of trials are analysed: experiments/trials/designs/metrics.toml, or another such file."""

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import ConfigError, shown
from experiments.record.displays import Displays
from experiments.record.metrics import CIRCUMSTANCES, Metrics
from experiments.trials.designs import FOLDER
from experiments.trials.trial_config import SETTINGS
from mjsim.support.files import read_bytes

FILE = FOLDER / "metrics.toml"
SHOWN = 20  # columns in a sentence
_OF_A_TRIAL = re.compile(
    r"(person|behaviour|max|mean|p99)_\w+|simulated(_s)?|fingerprint|participant|releases_settled|ejections|"
    "tunnellings|grips_lost"
)
LIKERT_PREFIX = "likert_"  # columns of answers


class Measure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A measure of the paper and its column."""

    label: str  # its name in figures and tables
    column: str  # the column that is scored
    why: str = ""  # reason for it
    unit: str = ""  # unit of the column, or nothing
    range: tuple[float, float] = (0.0, 1e6)  # of its columns; other values cannot be
    without: str | None = None  # the column used instead if that one has no values
    others: tuple[str, ...] = ()  # other readings of the measure, reported as well

    def axis(self) -> str:
        return f"{self.label} ({self.unit})" if self.unit else self.label


class Equivalence(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Largest effects that count as none: of a pair, in standard deviations within groups; partial eta squared."""

    pair: float
    eta_squared: float


class Measures(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The measures of an analysis by short name, and labels of survey items (columns `likert_` and the name)."""

    objective: dict[str, Measure] = msgspec.field(name="measures")
    likert: dict[str, str]
    equivalence: Equivalence

    def answers(self) -> dict[str, str]:
        """Labels of answers by column."""
        return {LIKERT_PREFIX + name: label for name, label in self.likert.items()}


def read_measures(path: Path = FILE) -> Measures:
    """The measures of a file, by default the committed choice; a ConfigError says what is wrong with it."""
    try:
        return decoded_measures(read_bytes(path))
    except OSError as error:
        raise ConfigError(f"cannot read measures {path}: {error.strerror}") from error
    except (msgspec.DecodeError, UnicodeDecodeError) as error:
        raise ConfigError(f"{path}: {error}; {FILE} shows what such a file holds") from error


def decoded_measures(content: bytes) -> Measures:
    """The measures in the content of a file; what msgspec raises where there are none."""
    return msgspec.toml.decode(content, type=Measures)


def present_columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def unread_note(columns: Sequence[str], measures: Measures) -> list[str]:
    """A sentence on columns that are neither measures nor part of a trial's record, if there are any."""
    read = {c for m in measures.objective.values() for c in (m.column, m.without, *m.others)}
    told = (field.name for kind in (Metrics, Displays) for field in fields(kind))
    known = {*read, *SETTINGS, *CIRCUMSTANCES, *told}
    answers = {LIKERT_PREFIX + name for name in measures.likert}
    unread = [shown(c) for c in columns if c not in known | answers and not _OF_A_TRIAL.fullmatch(c)]
    more = f" and {len(unread) - SHOWN} more" if len(unread) > SHOWN else ""
    return [f"Nothing here analyses the table's further columns: {', '.join(unread[:SHOWN])}{more}."] * bool(
        unread
    )


def resolve(measure: Measure, known: Collection[str]) -> str | None:
    """The column of a measure among those with values; None where it has none."""
    return next((c for c in (measure.column, measure.without) if c is not None and c in known), None)
