"""Read the measures of an analysis and their table columns from a TOML file."""

import difflib
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import fields
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.errors import ConfigError, RecordError, listed, shown
from experiments.record.files import read_json
from experiments.record.metrics import CIRCUMSTANCES, Displays, Metrics
from experiments.trials.designs import FOLDER
from experiments.trials.trial_config import SETTINGS
from mjsim.support.files import read_bytes
from mjsim.support.toml import decode_toml

FILE = FOLDER / "metrics.toml"
MAX_COLUMNS_SHOWN = 20  # maximum number of columns that are listed in a message
_OF_A_TRIAL = re.compile(
    r"(person|behaviour|max|mean|p99)_\w+|simulated(_s)?|fingerprint|participant|releases_settled|ejections|"
    "tunnellings|grips_lost"
)
LIKERT_PREFIX = "likert_"  # prefix of columns with survey answers
SURVEY = "survey.json"  # file with the scale and the items of the survey


class Measure(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A measure to analyse, and the table column that contains it.

    Attributes:
        why: Reason for the choice of this column.
        range: Smallest and largest valid value.
        without: Fallback column if `column` has no values.
        others: Columns with alternative definitions of the measure, which are reported as well.
    """

    label: str
    column: str
    why: str = ""
    unit: str = ""
    range: tuple[float, float] = (0.0, 1e6)
    without: str | None = None
    others: tuple[str, ...] = ()

    @property
    def columns(self) -> tuple[str, ...]:
        return tuple(c for c in (self.column, self.without, *self.others) if c is not None)

    def axis(self) -> str:
        return f"{self.label} ({self.unit})" if self.unit else self.label


class Equivalence(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The largest effects that count as equivalent, in standard deviations and as partial eta squared."""

    pair: float
    eta_squared: float


class SurveyScale(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The rating scale of a study's survey: the number of points, and the text of each item by name."""

    points: int
    items: dict[str, str]


class Measures(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The measures of an analysis and the labels of survey items, both by short name."""

    objective: dict[str, Measure] = msgspec.field(name="measures")
    likert: dict[str, str]
    equivalence: Equivalence
    points: int = 5  # number of points of the survey's scale

    def answers(self) -> dict[str, str]:
        """Return the label of each survey item by the name of its table column."""
        return {LIKERT_PREFIX + name: label for name, label in self.likert.items()}

    def of(self, survey: SurveyScale) -> "Measures":
        """Return these measures with the scale and with all items of a study's survey."""
        return msgspec.structs.replace(self, likert=survey.items | self.likert, points=survey.points)


def read_measures(path: Path = FILE) -> Measures:
    """Read a measures file, by default the one with the paper's measures. Raises `ConfigError` if it is invalid."""
    try:
        return decoded_measures(read_bytes(path))
    except OSError as error:
        raise ConfigError(f"cannot read measures {path}: {error.strerror}") from error
    except ValueError as error:
        raise ConfigError(f"{path}: {error}; {FILE} is an example of such a file") from error


def with_survey(measures: Measures, folder: Path) -> Measures:
    """Add the survey items from `survey.json`, if `mjsim study collect` wrote this file to the folder."""
    path = folder / SURVEY
    return measures.of(msgspec.convert(read_json(path), SurveyScale)) if path.is_file() else measures


def decoded_measures(content: bytes) -> Measures:
    """Decode the content of a measures file. Raises a ValueError if the content is invalid."""
    return msgspec.convert(decode_toml(content), Measures)


def present_columns(rows: Sequence[Mapping[str, Any]]) -> list[str]:
    return list(dict.fromkeys(name for row in rows for name in row))


def unread_note(columns: Sequence[str], measures: Measures) -> list[str]:
    """Return a list with one note about unrecognized columns, or an empty list if there are none."""
    read = {c for m in measures.objective.values() for c in m.columns}
    recorded = (field.name for kind in (Metrics, Displays) for field in fields(kind))
    known = {*read, *SETTINGS, *CIRCUMSTANCES, *recorded}
    answers = {LIKERT_PREFIX + name for name in measures.likert}
    unread = [shown(c) for c in columns if c not in known | answers and not _OF_A_TRIAL.fullmatch(c)]
    if not unread:
        return []
    return [f"These columns of the table are not analysed: {listed(unread, MAX_COLUMNS_SHOWN)}."]


def resolve(measure: Measure, known: Collection[str]) -> str | None:
    """Return the first column of a measure that contains values, or None if all are empty."""
    return next((c for c in (measure.column, measure.without) if c is not None and c in known), None)


def check_answer_columns(columns: Sequence[str], measures: Measures, path: Path) -> None:
    """Raise `RecordError` if a column contains answers to an unknown survey item."""
    known = measures.answers()
    for name in columns:
        if name.lower().startswith(LIKERT_PREFIX.rstrip("_")) and name not in known:
            near = difflib.get_close_matches(name, known, 1, cutoff=0.0)[0]
            raise RecordError(
                f"{path} has answers {name!r}, which is not a survey item (the nearest is {near}); rename or drop "
                f"the column, or add the item to [likert] in a copy of {FILE}, for --measures"
            )


def check_ranges(
    rows: Mapping[int, Mapping[str, Any]],
    numbers: Mapping[str, NDArray[np.float64]],
    measures: Measures,
    path: Path,
) -> None:
    """Raise `RecordError` if a value is outside the valid range of its measure."""
    for measure in measures.objective.values():
        low, high = measure.range
        for name in measure.columns:
            values = numbers.get(name, np.empty(0))
            for index in np.flatnonzero((values < low) | (values > high)).tolist():
                k = list(rows)[index]
                raise RecordError(
                    f"{path}: row {k} (person seed {rows[k].get('person_seed')}) has the {name} {values[index]:g}, "
                    f"not a number from {low:g} to {high:g}; correct it, or exclude the person by --exclude"
                )


def check_answers(values: NDArray[np.float64], name: str, points: int, path: Path) -> None:
    given = values[~np.isnan(values)]
    bad = given[(given != np.round(given)) | (given < 1) | (given > points)]
    if len(bad):
        raise RecordError(
            f"{path}: {name} has the answer {bad[0]:g}; answers are whole numbers from 1 to {points}"
        )
