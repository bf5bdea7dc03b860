"""Tests that do not assume equal variances, of designs with one or two factors and people in every cell.

Both test unweighted means (the hypotheses of Type III), each cell with a variance of its own. With one factor,
Welch-James is Welch's analysis of variance.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.statistics.anova import OWN_VARIANCE, Cells, Values, cells_of, varies
from experiments.analysis.statistics.effects import FTest
from experiments.errors import StatisticsError


def welch_james(values: Values, assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, FTest]:
    """Welch's test of each effect, with Johansen's approximate degrees of freedom.

    All arrays have one entry per person, (n,). Source: Johansen 1980, doi:10.1093/biomet/67.1.85.
    """
    return _tests(values, assistance, objects, 0, _johansen)


def hc3(values: Values, assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, FTest]:
    """F tests with the heteroscedasticity-consistent covariance HC3 of the linear model with all effects.

    In a model with a mean for each cell, it is the cells' variances over their people less one. Arguments as in
    `welch_james`. Source: Long and Ervin 2000, doi:10.1080/00031305.2000.10474549.
    """
    return _tests(values, assistance, objects, 1, lambda statistic, q, _: (statistic / q, None))


def _johansen(statistic: float, q: int, shares: Values) -> tuple[float, float]:
    spread = float(shares.sum())
    return statistic / (q + 2 * spread - 6 * spread / (q + 2)), q * (q + 2) / (3 * spread)


def _tests(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[Any],
    fewer: int,
    scaled: Callable[[float, int, Values], tuple[float, float | None]],
) -> dict[str, FTest]:
    """Wald tests of each effect, the variance of a cell's mean being its variance over its people less `fewer`."""
    cells = cells_of(values, assistance, objects)
    if cells.people.min() < 2:
        raise StatisticsError("a cell has one person only; its variance is unknown")
    if not all(varies(values[cells.member == k]) for k in range(len(cells.people))):
        raise StatisticsError("the values of a cell do not vary")
    variances = cells.squares / (cells.people - 1) / (cells.people - fewer)
    within = len(values) - len(cells.people)
    found = {}
    for effect, rows in _contrasts(cells).items():
        weight = rows.T @ np.linalg.solve(rows * variances @ rows.T, rows)
        shares = (variances * weight.diagonal()) ** 2 / (cells.people - 1)
        statistic, df2 = scaled(float(cells.means @ weight @ cells.means), len(rows), shares)
        found[effect] = FTest(statistic, len(rows), float(df2 or within), len(values), within, OWN_VARIANCE)
    return found


def _contrasts(cells: Cells) -> dict[str, Values]:
    """Rows by effect, (q, cells), that give its parameters from the means of the cells."""
    rows = np.asarray(np.linalg.inv(np.hstack(list(cells.columns.values()))), float)
    found, start = {}, 0
    for effect, block in cells.columns.items():
        found[effect] = rows[start : start + block.shape[1]]
        start += block.shape[1]
    found.pop("constant")
    return found
