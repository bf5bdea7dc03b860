"""Which columns of a table of trials are analysed: experiments/studies/metrics.toml."""

import tomllib
from collections.abc import Collection, Mapping
from dataclasses import dataclass

from experiments.studies import FOLDER

FILE = FOLDER / "metrics.toml"
LIKERT_PREFIX = "likert_"  # columns of answers


@dataclass(frozen=True)
class Measure:
    """A measure of the paper and the column that stands for it.

    Attributes:
        label: Its name in figures and tables.
        column: The column that is scored.
        why: Why this one.
        unit: Unit of the column, or nothing.
        without: The column in its place where nobody has a value in it.
        others: Other readings of the measure, reported beside it.
    """

    label: str
    column: str
    why: str = ""
    unit: str = ""
    without: str | None = None
    others: tuple[str, ...] = ()

    def axis(self) -> str:
        """Label of an axis."""
        return f"{self.label} ({self.unit})" if self.unit else self.label


@dataclass(frozen=True)
class Measures:
    """What is analysed.

    Attributes:
        objective: Measures by their short names.
        likert: Labels of survey items by short name; their columns are `likert_` and the name.
        pair_bound: Largest difference of two means that counts as none, in standard deviations within groups.
        eta_bound: Partial eta squared that counts as none where it is shown to be smaller.
    """

    objective: Mapping[str, Measure]
    likert: Mapping[str, str]
    pair_bound: float
    eta_bound: float


def read_measures() -> Measures:
    """The committed choice."""
    file = tomllib.loads(FILE.read_text(encoding="utf-8"))
    objective = {
        name: Measure(**{**values, "others": tuple(values.get("others", ()))})
        for name, values in file["measures"].items()
    }
    bounds = file["equivalence"]
    return Measures(objective, file["likert"], bounds["pair"], bounds["eta_squared"])


def resolve(measure: Measure, known: Collection[str]) -> str | None:
    """The column of a measure in a table; None where nobody has a value.

    Args:
        measure: The measure.
        known: Columns in which somebody has a value.
    """
    return next((c for c in (measure.column, measure.without) if c is not None and c in known), None)
