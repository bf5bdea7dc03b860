"""Rules that decide whether a study reproduces a published result."""

import itertools
import math

import numpy as np
from scipy.stats import linregress

from experiments.analysis.statistics.anova import Values, one_way, two_way
from experiments.analysis.statistics.effects import ALPHA, FTest
from experiments.analysis.statistics.pairs import tukey_differs, tukey_quantile
from experiments.analysis.study.table import StudyTable
from experiments.errors import StatisticsError
from studies.published import Direction, Published


def published_cells(table: StudyTable, published: Published) -> StudyTable:
    """Return the participants who are in cells of the published study."""
    cells = zip(table.assistance.tolist(), table.objects.tolist(), strict=True)
    return table.take(np.flatnonzero([cell in published.people.sizes() for cell in cells]))


def require_cells(table: StudyTable, published: Published, measure: str, objects: int | None) -> None:
    """Check that every published cell has participants, with `objects` objects or, if None, with any number.

    Raises:
        StatisticsError: The measure is unknown, or a cell is empty. The message names it.
    """
    _known(table, measure)
    for condition, level in published.people.sizes():
        if objects in (None, level) and condition not in table.groups(measure, level):
            raise StatisticsError(f"no people in the cell {condition}, {level}")


def tests_of(table: StudyTable, measure: str, objects: int | None) -> dict[str, FTest]:
    """Return tests of a measure by effect: of assistance, or, if `objects` is None, of both factors (Type
    II).

    Raises:
        StatisticsError: The tests cannot be computed.
    """
    values = _known(table, measure)
    if objects is None:
        known = ~np.isnan(values)
        return two_way(values[known], table.assistance[known], table.objects[known])
    return {"assistance": one_way(table.groups(measure, objects))}


def points(table: StudyTable, row: Direction) -> bool:
    """Return True if the means have the published order.

    Raises:
        StatisticsError: The means cannot be compared.
    """
    _known(table, row.measure)
    if row.pair is not None:
        first, second = row.pair
        groups = table.groups(row.measure, row.objects)
        return tukey_differs(groups, first, second) and bool(groups[first].mean() < groups[second].mean())
    if row.same is not None:
        return not tukey_differs(table.groups(row.measure, row.objects), *row.same)
    if row.rising is not None:
        return _trend(table, row.measure, row.rising)
    if row.lowest is not None:
        others = [name for name in table.conditions() if name != row.lowest]
        return all(_below(table, row.measure, row.lowest, other) for other in others)
    return all(_below(table, row.measure, low, high) for high, low in itertools.pairwise(row.falling or ()))


def _trend(table: StudyTable, measure: str, condition: str) -> bool:
    """Return True if a measure rises with the number of objects, by linear regression, one-sided at .05."""
    levels = _levels(table)
    groups = [table.groups(measure, n).get(condition) for n in levels]
    if any(group is None for group in groups):
        raise StatisticsError(f"no people in a cell of {condition}")
    known = [
        (n, float(v)) for n, group in zip(levels, groups, strict=True) if group is not None for v in group
    ]
    return bool(linregress(*zip(*known, strict=True), alternative="greater").pvalue < ALPHA)


def _below(table: StudyTable, measure: str, low: str, high: str) -> bool:
    """Return True if Tukey's test over all numbers of objects, equally weighted, finds `low` below `high`."""
    levels = _levels(table)
    cells = {(c, n): v for n in levels for c, v in table.groups(measure, n).items()}
    conditions = {condition for condition, _ in cells}
    if len(cells) < len(conditions) * len(levels) or not {low, high} <= conditions:
        raise StatisticsError("no people in a cell")
    freedom = sum(map(len, cells.values())) - len(cells)
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in cells.values())
    if freedom < 1 or squares <= 0.0:
        raise StatisticsError("the values do not vary within any cell")
    gap = np.mean([cells[high, n].mean() - cells[low, n].mean() for n in levels])
    weight = sum(1 / len(cells[c, n]) for c in (low, high) for n in levels) / len(levels) ** 2
    error = math.sqrt(squares / freedom * weight)
    return bool(gap > tukey_quantile(len(conditions), freedom) * error)


def varies_most(table: StudyTable, measure: str, condition: str, objects: int) -> bool:
    """Return True if the measure has its largest variance in this condition.

    Raises:
        StatisticsError: A variance cannot be computed.
    """
    _known(table, measure)
    found = {name: _variance(values) for name, values in table.groups(measure, objects).items()}
    if condition not in found or len(found) < 2:
        raise StatisticsError(f"no people in the cell {condition}, {objects}, or in any other one")
    return all(found[condition] > other for name, other in found.items() if name != condition)


def _variance(values: Values) -> float:
    if len(values) < 2:
        raise StatisticsError("a cell has one person only")
    return float(values.var(ddof=1))


def _known(table: StudyTable, measure: str) -> Values:
    if measure not in table.columns:
        raise StatisticsError(f"{measure} is not known")
    return table.columns[measure]


def _levels(table: StudyTable) -> list[int]:
    if len(table.levels()) < 2:
        raise StatisticsError(f"there is only one number of objects ({table.levels()[0]})")
    return table.levels()
