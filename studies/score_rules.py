"""Whether a study comes out as published: each row of studies/published.toml judged on one table."""

import itertools
from collections.abc import Callable, Sequence

import numpy as np

from experiments.analysis.statistics.anova import Values, one_way, two_way
from experiments.analysis.statistics.effects import FTest
from experiments.analysis.statistics.pairs import tukey_differs
from experiments.errors import StatisticsError
from experiments.study.table import StudyTable
from studies.published import Direction, Published


def published_cells(table: StudyTable, published: Published) -> StudyTable:
    """The people of a table who are in cells of the published study."""
    cells = zip(table.assistance.tolist(), table.objects.tolist(), strict=True)
    return table.take(np.flatnonzero([cell in published.people.sizes() for cell in cells]))


def require_cells(table: StudyTable, published: Published, measure: str, objects: int | None) -> None:
    """Check that every published cell has people, at a number of objects or at all of them.

    Raises:
        StatisticsError: The measure is not known, or a cell is empty; the message names it.
    """
    _known(table, measure)
    for condition, level in published.people.sizes():
        if objects in (None, level) and condition not in table.groups(measure, level):
            raise StatisticsError(f"no people in the cell {condition}, {level}")


def tests_of(table: StudyTable, measure: str, objects: int | None) -> dict[str, FTest]:
    """Tests of a measure on a table by effect: of assistance at a number of objects, else of both factors (Type II).

    Raises:
        StatisticsError: They cannot be computed; the message says why.
    """
    values = _known(table, measure)
    if objects is None:
        known = ~np.isnan(values)
        return two_way(values[known], table.assistance[known], table.objects[known])
    return {"assistance": one_way(table.groups(measure, objects))}


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
        raise StatisticsError(f"no people in the cell {condition}, {objects}, or in any other one")
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
        raise StatisticsError(f"no people in the cell {condition}, {objects}")
    return float(values.mean())
