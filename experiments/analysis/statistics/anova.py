"""Analyses of variance between subjects, with one or two factors."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from experiments.analysis.statistics.effects import FTest
from experiments.errors import StatisticsError

Values = NDArray[np.float64]
EFFECTS = ("first", "second", "both")


@dataclass(frozen=True)
class TwoWay:
    """Tests of a two-way analysis of variance.

    Attributes:
        first: Main effect of the first factor.
        second: Of the second.
        interaction: Of both together.
    """

    first: FTest
    second: FTest
    interaction: FTest


def check_groups(groups: Mapping[str, Values], least: int = 1) -> None:
    """Whether groups can be compared.

    Raises:
        StatisticsError: There are fewer than two, one has fewer than `least` values, or nothing varies within groups.
    """
    if len(groups) < 2:
        raise StatisticsError(f"there is only one group ({', '.join(groups) or 'none at all'})")
    small = [name for name, values in groups.items() if len(values) < least]
    if small:
        raise StatisticsError(f"{small[0]} has {len(groups[small[0]])} known values, {least} are needed")
    if sum(len(v) for v in groups.values()) <= len(groups):
        raise StatisticsError("each group has one person only; nothing is known about how people differ")
    if not any(varies(values) for values in groups.values()):
        raise StatisticsError("the values do not vary within any group")


def varies(values: Values) -> bool:
    """Whether values (n,) differ by more than rounding."""
    return bool(len(values) > 1 and np.ptp(values) > 1e-12 * max(1.0, float(np.abs(values).max())))


def one_way(groups: Mapping[str, Values]) -> FTest:
    """Fisher's analysis of variance of one factor.

    Raises:
        StatisticsError: The groups cannot be compared.
    """
    return FTest.of(*one_way_statistic(groups), sum(len(v) for v in groups.values()))


def one_way_statistic(groups: Mapping[str, Values]) -> tuple[float, int, int]:
    """As `one_way`, but F and its degrees of freedom alone."""
    check_groups(groups)
    people = sum(len(v) for v in groups.values())
    return float(stats.f_oneway(*groups.values()).statistic), len(groups) - 1, people - len(groups)


def welch(groups: Mapping[str, Values]) -> FTest:
    """Welch's analysis of variance, which does not take variances for equal.

    Source: Welch 1951, doi:10.1093/biomet/38.3-4.330.

    Raises:
        StatisticsError: The groups cannot be compared, or a group does not vary.
    """
    check_groups(groups, least=2)
    still = [name for name, values in groups.items() if not varies(values)]
    if still:
        raise StatisticsError(f"the values of {still[0]} do not vary")
    statistic = float(stats.f_oneway(*groups.values(), equal_var=False).statistic)
    weights = np.array([len(v) / v.var(ddof=1) for v in groups.values()])
    spread = sum(
        (1 - w) ** 2 / (len(v) - 1) for w, v in zip(weights / weights.sum(), groups.values(), strict=True)
    )
    freedom = (len(groups) ** 2 - 1) / (3 * float(spread))
    return FTest.of(statistic, len(groups) - 1, freedom, sum(len(v) for v in groups.values()))


def brown_forsythe(groups: Mapping[str, Values]) -> FTest:
    """Whether variances differ: an analysis of variance of the distances from the median.

    Source: Brown and Forsythe 1974, doi:10.1080/01621459.1974.10482955.

    Raises:
        StatisticsError: The groups cannot be compared.
    """
    check_groups(groups, least=2)
    people = sum(len(v) for v in groups.values())
    with np.errstate(divide="ignore", invalid="ignore"):  # said below
        statistic = float(stats.levene(*groups.values(), center="median").statistic)
    if not np.isfinite(statistic):
        raise StatisticsError("the distances from the median do not vary within any group")
    return FTest.of(statistic, len(groups) - 1, people - len(groups), people)


def two_way(values: Values, first: NDArray[Any], second: NDArray[Any], kind: int = 2) -> TwoWay:
    """Analysis of variance of two crossed factors with unequal numbers of people.

    Each effect is what the model gains by it: in Type II over the model without it and its interaction, in Type III
    over the full model without it. Factors are coded by sums (1, 0, -1), without which Type III tests something else.

    Args:
        values: One per person, (n,), none missing.
        first: Level of the first factor, (n,).
        second: Level of the second factor, (n,).
        kind: 2 or 3.

    Source: Langsrud 2003, doi:10.1023/A:1023260610025.

    Raises:
        StatisticsError: A cell is empty, each has one person only, or nothing varies within cells.
    """
    return TwoWay(*(FTest.of(*one, len(values)) for one in two_way_statistics(values, first, second, kind)))


def two_way_statistics(
    values: Values, first: NDArray[Any], second: NDArray[Any], kind: int = 2
) -> list[tuple[float, int, int]]:
    """As `two_way`, but F and its degrees of freedom alone: first factor, second factor, interaction."""
    blocks = Design.of(first, second).blocks
    residual, freedom = _residual(values, blocks)
    if freedom < 1:
        raise StatisticsError("each cell has one person only; nothing is known about how people differ")
    if residual <= 1e-20 * max(1.0, float((values**2).sum())):
        raise StatisticsError("the values do not vary within any cell")
    columns = [blocks[effect].shape[1] for effect in EFFECTS]
    gains = two_way_squares(values, blocks, kind)
    return [(g / df1 / (residual / freedom), df1, freedom) for g, df1 in zip(gains, columns, strict=True)]


def two_way_squares(values: Values, blocks: Mapping[str, Values], kind: int = 2) -> list[float]:
    """Sums of squares of both factors and their interaction; `blocks` are those of a `Design`."""
    gains = []
    for effect in EFFECTS:
        larger = [n for n in blocks if kind == 3 or effect == "both" or n != "both"]
        without = _residual(values, {n: blocks[n] for n in larger if n != effect})[0]
        gains.append(max(without - _residual(values, {n: blocks[n] for n in larger})[0], 0.0))
    return gains


@dataclass(frozen=True)
class Design:
    """Columns of a two-way design, sum coded: `constant`, `first`, `second`, `both`, each (n, columns)."""

    blocks: Mapping[str, Values]

    @classmethod
    def of(cls, first: NDArray[Any], second: NDArray[Any]) -> "Design":
        """From the levels of both factors, (n,) each.

        Raises:
            StatisticsError: A factor has one level only, or a cell is empty.
        """
        for names in (first, second):
            if len(np.unique(names)) < 2:
                raise StatisticsError(f"there is only one level ({', '.join(map(str, np.unique(names)))})")
        present = set(zip(first.tolist(), second.tolist(), strict=True))
        empty = [(a, b) for a in np.unique(first) for b in np.unique(second) if (a, b) not in present]
        if empty:
            raise StatisticsError(
                f"nobody is in the cell {empty[0][0]}, {empty[0][1]}; tests of two factors need all"
            )
        one, other = sum_coded(first), sum_coded(second)
        both = (one[:, :, None] * other[:, None, :]).reshape(len(one), -1)
        return cls({"constant": np.ones((len(one), 1)), "first": one, "second": other, "both": both})


def sum_coded(levels: NDArray[Any]) -> Values:
    """A column for each level but the last: 1 there, -1 at the last level, else 0. Shape (n, levels - 1)."""
    names = np.unique(levels)
    columns: Values = (levels[:, None] == names[None, :-1]).astype(float)
    columns[levels == names[-1]] = -1.0
    return columns


def _residual(values: Values, blocks: Mapping[str, Values]) -> tuple[float, int]:
    """Sum of squares that a linear model leaves, and its degrees of freedom."""
    from statsmodels.regression.linear_model import OLS

    columns = np.hstack(list(blocks.values()))
    fit = OLS(values, columns).fit()
    return float(fit.ssr), int(len(values) - columns.shape[1])
