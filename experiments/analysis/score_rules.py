"""Whether a study comes out as published: each row of experiments/studies/published.toml judged on one table."""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import f

from experiments.analysis.published import Direction, Published
from experiments.analysis.statistics.anova import Values, one_way_statistic, two_way_statistics
from experiments.analysis.statistics.effects import ALPHA, partial_eta_squared
from experiments.analysis.statistics.pairs import tukey_differs
from experiments.analysis.study_table import StudyTable
from experiments.errors import StatisticsError

EFFECTS = ("assistance", "objects", "interaction")  # of a two-way analysis, in order


@dataclass(frozen=True)
class Found:
    """An F test of a table.

    Attributes:
        statistic: F.
        df: Degrees of freedom, of the effect and of the error.
        people: How many people it is of.
    """

    statistic: float
    df: tuple[int, int]
    people: int

    @property
    def p(self) -> float:
        """Probability of such an F or a larger one without an effect."""
        return float(f.sf(self.statistic, *self.df))

    @property
    def significant(self) -> bool:
        """The decision at .05."""
        return self.p < ALPHA

    @property
    def eta_squared(self) -> float:
        """Partial eta squared."""
        return partial_eta_squared(self.statistic, *self.df)


def published_cells(table: StudyTable, published: Published) -> StudyTable:
    """The people of a table who are in cells of the published study."""
    cells = zip(table.assistance.tolist(), table.objects.tolist(), strict=True)
    return table.take(np.flatnonzero([cell in published.people.sizes() for cell in cells]))


def require_cells(table: StudyTable, published: Published, measure: str, objects: int | None) -> None:
    """Check that every published cell has people, at a number of objects or at all of them.

    Raises:
        StatisticsError: The measure is not known, or nobody is in a cell, which the message names.
    """
    _known(table, measure)
    for condition, level in published.people.sizes():
        if objects in (None, level) and condition not in table.groups(measure, level):
            raise StatisticsError(f"nobody is in the cell {condition}, {level}")


def tests_of(table: StudyTable, measure: str, objects: int | None) -> dict[str, Found]:
    """Tests of a measure on a table by effect: of assistance at a number of objects, else of both factors (Type II).

    Raises:
        StatisticsError: They cannot be computed; the message says why.
    """
    values = _known(table, measure)
    if objects is None:
        known = ~np.isnan(values)
        tests = two_way_statistics(values[known], table.assistance[known], table.objects[known])
        return {
            name: Found(statistic, (df1, df2), int(known.sum()))
            for name, (statistic, df1, df2) in zip(EFFECTS, tests, strict=True)
        }
    groups = table.groups(measure, objects)
    statistic, df1, df2 = one_way_statistic(groups)
    return {"assistance": Found(statistic, (df1, df2), sum(map(len, groups.values())))}


def points(table: StudyTable, row: Direction) -> bool:
    """Whether means have the published order.

    Raises:
        StatisticsError: They cannot be compared.
    """
    _known(table, row.measure)
    if row.pair is not None:
        first, second = row.pair
        groups = table.groups(row.measure, row.objects)
        return tukey_differs(groups, first, second) and bool(groups[first].mean() < groups[second].mean())
    if row.same is not None:
        return not tukey_differs(table.groups(row.measure, row.objects), *row.same)
    if row.rising is not None:
        return _rises([_mean(table, row.measure, row.rising, n) for n in _levels(table)])
    if row.lowest is not None:
        return all(_is_largest(table, row.measure, n, row.lowest, _minus_mean) for n in _levels(table))
    averages = [
        np.mean([_mean(table, row.measure, name, n) for n in _levels(table)]) for name in row.falling or ()
    ]
    return _rises([-float(average) for average in averages])


def varies_most(table: StudyTable, measure: str, condition: str, objects: int) -> bool:
    """Whether a measure has its largest variance in this condition.

    Raises:
        StatisticsError: A variance is not known.
    """
    _known(table, measure)
    return _is_largest(table, measure, objects, condition, _variance)


def _is_largest(
    table: StudyTable, measure: str, objects: int, condition: str, value: Callable[[Values], float]
) -> bool:
    found = {name: value(values) for name, values in table.groups(measure, objects).items()}
    if condition not in found or len(found) < 2:
        raise StatisticsError(f"nobody is in the cell {condition}, {objects}, or nobody in another one")
    return all(found[condition] > other for name, other in found.items() if name != condition)


def _minus_mean(values: Values) -> float:
    return -float(values.mean())


def _variance(values: Values) -> float:
    if len(values) < 2:
        raise StatisticsError("a cell has one person only")
    return float(values.var(ddof=1))


def _rises(values: Sequence[float]) -> bool:
    return all(low < high for low, high in itertools.pairwise(values))


def _known(table: StudyTable, measure: str) -> Values:
    if measure not in table.columns:
        raise StatisticsError(f"{measure} is not known")
    return table.columns[measure]


def _levels(table: StudyTable) -> list[int]:
    if len(table.levels()) < 2:
        raise StatisticsError(f"there is only one number of objects ({table.levels()[0]})")
    return table.levels()


def _mean(table: StudyTable, measure: str, condition: str, objects: int) -> float:
    values = table.groups(measure, objects).get(condition)
    if values is None:
        raise StatisticsError(f"nobody is in the cell {condition}, {objects}")
    return float(values.mean())
