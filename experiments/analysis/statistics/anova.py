"""Analyses of variance between subjects, with one or two factors."""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.statistics.effects import FTest
from experiments.errors import StatisticsError

Values = NDArray[np.float64]
OWN_VARIANCE = "variance, each group in units of its own"
EFFECTS = ("assistance", "objects", "interaction")  # of a two-way analysis of variance, in order


def check_groups(groups: Mapping[str, Values], least: int = 1) -> None:
    """Check that groups can be compared: two or more, of at least `least` values each, which vary within groups."""
    if len(groups) < 2:
        raise StatisticsError(f"there is only one group ({', '.join(groups) or 'none at all'})")
    small = [name for name, values in groups.items() if len(values) < least]
    if small:
        raise StatisticsError(f"{small[0]} has {len(groups[small[0]])} known values, {least} are needed")
    if people_in(groups) <= len(groups):
        raise StatisticsError("each group has one person only; the variance within groups is unknown")
    if not any(varies(values) for values in groups.values()):
        raise StatisticsError("the values do not vary within any group")


def varies(values: Values) -> bool:
    """Whether values (n,) differ by more than rounding."""
    return bool(len(values) > 1 and np.ptp(values) > 1e-12 * max(1.0, float(np.abs(values).max())))


def people_in(groups: Mapping[str, Values]) -> int:
    """Number of values in all groups."""
    return sum(len(values) for values in groups.values())


def one_way(groups: Mapping[str, Values]) -> FTest:
    """Fisher's analysis of variance of one factor."""
    check_groups(groups)
    return _fisher(groups)


def welch(groups: Mapping[str, Values]) -> FTest:
    """Welch's analysis of variance, which does not assume equal variances; every group must vary.

    F df1 estimates the sum of n (mean - weighted mean)^2 / variance over groups, whatever df2 is: the effect size and
    its interval are both of this sum and of the people, as if every group had variance 1.

    Source: Welch 1951, doi:10.1093/biomet/38.3-4.330.
    """
    check_groups(groups, least=2)
    constant = [name for name, values in groups.items() if not varies(values)]
    if constant:
        raise StatisticsError(f"the values of {constant[0]} do not vary")
    from statsmodels.stats.oneway import anova_oneway

    found = anova_oneway(list(groups.values()), use_var="unequal")
    people = people_in(groups)
    return FTest(
        float(found.statistic),
        len(groups) - 1,
        float(found.df[1]),
        people,
        people - len(groups),
        OWN_VARIANCE,
    )


def brown_forsythe(groups: Mapping[str, Values]) -> FTest:
    """Test for equal variances: an analysis of variance of the distances from the median.

    Source: Brown and Forsythe 1974, doi:10.1080/01621459.1974.10482955.
    """
    check_groups(groups, least=2)
    distances = {name: np.abs(values - np.median(values)) for name, values in groups.items()}
    if not any(varies(values) for values in distances.values()):
        raise StatisticsError("the distances from the median do not vary within any group")
    return replace(_fisher(distances), of="variance of the distances from the medians")


def _fisher(groups: Mapping[str, Values]) -> FTest:
    """statsmodels has no number for a group of one person."""
    members, people = list(groups.values()), people_in(groups)
    grand = np.concatenate(members).mean()
    between = sum(len(v) * float(v.mean() - grand) ** 2 for v in members)
    within = sum(float(((v - v.mean()) ** 2).sum()) for v in members)
    df1, df2 = len(groups) - 1, people - len(groups)
    return FTest(between / df1 / (within / df2), df1, float(df2), people)


def two_way(values: Values, first: NDArray[Any], second: NDArray[Any], kind: int = 2) -> dict[str, FTest]:
    """Analysis of variance of two crossed factors with unequal numbers of people, by name of `EFFECTS`.

    Values and both factors have one entry per person, (n,); `kind` is type 2 or 3 of the sums of squares. Raises
    `StatisticsError` if a cell is empty, each has one person only, or nothing varies within cells.
    Source: Langsrud 2003, doi:10.1023/A:1023260610025.
    """
    columns = sum_coded(first, second)
    freedom = len(values) - sum(block.shape[1] for block in columns.values())
    if freedom < 1:
        raise StatisticsError("each cell has one person only; the variance within cells is unknown")
    residual = _residual(values, columns, columns)
    if residual <= 1e-20 * max(1.0, float((values**2).sum())):
        raise StatisticsError("the values do not vary within any cell")
    sums = two_way_squares(values, first, second, kind)
    df = {effect: columns[effect].shape[1] for effect in EFFECTS}
    return {
        effect: FTest(sums[effect] / df[effect] / (residual / freedom), df[effect], freedom, len(values))
        for effect in EFFECTS
    }


def two_way_squares(
    values: Values, first: NDArray[Any], second: NDArray[Any], kind: int = 2
) -> dict[str, float]:
    """Sums of squares of the effects of a two-way analysis; arguments as in `two_way`.

    Each is the reduction of the residual sum of squares by the effect: in Type II compared with the model without it
    and its interaction, in Type III with the full model without it. `anova_lm` of statsmodels gives the same from a
    formula in six times the time.
    """
    columns, sums = sum_coded(first, second), {}
    for effect in EFFECTS:
        full = [name for name in columns if kind == 3 or effect == "interaction" or name != "interaction"]
        without = _residual(values, columns, [name for name in full if name != effect])
        sums[effect] = max(without - _residual(values, columns, full), 0.0)
    return sums


def sum_coded(first: NDArray[Any], second: NDArray[Any]) -> dict[str, Values]:
    """Columns of a two-way design by effect, each (n, columns): 1 at a level, -1 at the last one, else 0."""
    for levels in (first, second):
        if len(np.unique(levels)) < 2:
            raise StatisticsError(f"there is only one level ({', '.join(map(str, np.unique(levels)))})")
    present = set(zip(first.tolist(), second.tolist(), strict=True))
    empty = [(a, b) for a in np.unique(first) for b in np.unique(second) if (a, b) not in present]
    if empty:
        raise StatisticsError(
            f"no people in the cell {empty[0][0]}, {empty[0][1]}; tests of two factors need all"
        )
    one, other = (_contrasts(levels, np.unique(levels)) for levels in (first, second))
    both = (one[:, :, None] * other[:, None, :]).reshape(len(one), -1)
    return {"constant": np.ones((len(one), 1)), **dict(zip(EFFECTS, (one, other, both), strict=True))}


def design_columns(assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, Values]:
    """Columns of `sum_coded`, or of assistance alone where there is one number of objects."""
    if len(np.unique(objects)) > 1:
        return sum_coded(assistance, objects)
    names = np.unique(assistance)
    if len(names) < 2:
        raise StatisticsError(f"there is only one level ({names[0]})")
    return {"constant": np.ones((len(assistance), 1)), EFFECTS[0]: _contrasts(assistance, names)}


def _contrasts(levels: NDArray[Any], names: NDArray[Any]) -> Values:
    return np.asarray(1.0 * (levels[:, None] == names[:-1]) - (levels == names[-1])[:, None])


def _residual(values: Values, columns: Mapping[str, Values], names: Iterable[str]) -> float:
    """Residual sum of squares of a linear model with the named columns."""
    design = np.hstack([columns[name] for name in names])
    return float(((values - design @ np.linalg.lstsq(design, values)[0]) ** 2).sum())
