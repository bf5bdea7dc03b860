"""Analyses of variance for between-subjects designs with one or two factors."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.analysis.statistics.effects import FTest
from experiments.errors import StatisticsError

Values = NDArray[np.float64]
OWN_VARIANCE = "variance, each group in units of its own"
EFFECTS = ("assistance", "objects", "interaction")  # the effects in a two-way analysis of variance


def check_groups(groups: Mapping[str, Values], least: int = 1) -> None:
    """Raise `StatisticsError` if there is only one group, a group is too small, or no group varies."""
    if len(groups) < 2:
        raise StatisticsError(f"there is only one group ({', '.join(groups) or 'none at all'})")
    small = [name for name, values in groups.items() if len(values) < least]
    if small:
        raise StatisticsError(f"{small[0]} has {len(groups[small[0]])} known values, {least} are needed")
    if people_in(groups) <= len(groups):
        raise StatisticsError("each group has only one person; the variance within groups is unknown")
    if not any(varies(values) for values in groups.values()):
        raise StatisticsError("the values do not vary within any group")


def varies(values: Values) -> bool:
    """Return True if the values differ by more than rounding errors."""
    return bool(len(values) > 1 and np.ptp(values) > 1e-12 * max(1.0, float(np.abs(values).max())))


def people_in(groups: Mapping[str, Values]) -> int:
    return sum(len(values) for values in groups.values())


def one_way(groups: Mapping[str, Values]) -> FTest:
    check_groups(groups)
    return _fisher(groups)


def welch(groups: Mapping[str, Values]) -> FTest:
    """Compute Welch's analysis of variance, which does not assume equal variances.

    The values in every group must vary. F * df1 estimates the sum of n (mean - weighted mean)^2 / variance
    over the groups. The effect size and its interval are computed from this sum and the number of values.

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
    """Test whether groups have equal variances, using a modified Brown-Forsythe test.

    The test compares the distances of values from the median of their group. Let d1 <= d2 <= ... <= dn be the
    sorted distances. The first distance carries no information, because it is 0 if n is odd and equal to d2
    if n is even. It is therefore left out, and d2 is replaced by (d1 + d2) / sqrt(2) if n is even. With d1,
    the false positive rate would be only 3.5 % at the sample sizes of the paper.

    Sources: Brown and Forsythe 1974, doi:10.1080/01621459.1974.10482955; Hines and Hines 2000,
    doi:10.1111/j.0006-341X.2000.00451.x.
    """
    check_groups(groups, least=2)
    distances = {name: _distances(values) for name, values in groups.items()}
    if people_in(distances) <= len(groups):
        raise StatisticsError(
            "each group has at most two people; the variance of their distances from the median is unknown"
        )
    if not any(varies(values) for values in distances.values()):
        raise StatisticsError("the distances from the median do not vary within any group")
    return replace(
        _fisher(distances), people=people_in(groups), of="variance of the distances from the medians"
    )


def _distances(values: Values) -> Values:
    distances = np.sort(np.abs(values - np.median(values)))
    if len(values) % 2 == 0:
        distances[1] = (distances[0] + distances[1]) / np.sqrt(2.0)
    return np.asarray(distances[1:])


def _fisher(groups: Mapping[str, Values]) -> FTest:
    """Compute Fisher's analysis of variance without statsmodels, which fails for groups of a single value."""
    members, people = list(groups.values()), people_in(groups)
    grand = np.concatenate(members).mean()
    between = sum(len(v) * float(v.mean() - grand) ** 2 for v in members)
    within = sum(float(((v - v.mean()) ** 2).sum()) for v in members)
    df1, df2 = len(groups) - 1, people - len(groups)
    return FTest(between / df1 / (within / df2), df1, float(df2), people)


@dataclass(frozen=True)
class Cells:
    """Statistics of the cells in a design with one or two factors, c cells and n participants.

    Attributes:
        columns: Sum-coded columns of the linear model by effect, shape (c, columns): 1 at a level, -1 at the last
            level, otherwise 0.
        member: Index of each participant's cell, shape (n,).
        squares: Sum of squares around the mean of each cell, shape (c,). `people` and `means` have the same shape.
    """

    columns: Mapping[str, Values]
    member: NDArray[np.int64]
    people: NDArray[np.int64]
    means: Values
    squares: Values

    def residual(self, names: Iterable[str]) -> float:
        """Return the residual sum of squares of a linear model of the cell means with the named effects."""
        weights = np.sqrt(self.people)[:, None]
        design = np.hstack([self.columns[name] for name in names]) * weights
        wanted = self.means * weights[:, 0]
        return float(((wanted - design @ np.linalg.lstsq(design, wanted)[0]) ** 2).sum())


def cells_of(values: Values, first: NDArray[Any], second: NDArray[Any]) -> Cells:
    """Group values by two factors. A second factor with only one level is ignored. Arrays have shape (n,)."""
    names, others = np.unique(first), np.unique(second)
    if len(names) < 2:
        raise StatisticsError(f"there is only one level ({', '.join(map(str, names))})")
    member = np.searchsorted(names, first) * len(others) + np.searchsorted(others, second)
    people = np.bincount(member, minlength=len(names) * len(others))
    if not people.all():
        name, other = divmod(int(np.argmin(people)), len(others))
        raise StatisticsError(
            f"no people in the cell {names[name]}, {others[other]}; tests of two factors need all"
        )
    means = np.bincount(member, values) / people
    squares = np.bincount(member, np.square(values - means[member])).astype(float)
    one, other_one = (_sum_coded(len(levels)) for levels in (names, others))
    columns = {"constant": np.ones((len(people), 1)), EFFECTS[0]: np.repeat(one, len(others), axis=0)}
    if len(others) > 1:
        both = np.einsum("ap,bq->abpq", one, other_one).reshape(len(people), -1)
        columns |= {EFFECTS[1]: np.tile(other_one, (len(names), 1)), EFFECTS[2]: both}
    return Cells(columns, member, people, means, squares)


def _sum_coded(levels: int) -> Values:
    return np.vstack([np.eye(levels - 1), -np.ones((1, levels - 1))])


def two_way(values: Values, first: NDArray[Any], second: NDArray[Any], kind: int = 2) -> dict[str, FTest]:
    """Compute a two-way analysis of variance, and return the F test of each effect in `EFFECTS`.

    Values and factors have shape (n,). Cell sizes may differ. `kind` is the type of sums of squares, 2 or 3.

    Raises:
        StatisticsError: A cell is empty, every cell has a single value, or no cell varies.

    Source: Langsrud 2003, doi:10.1023/A:1023260610025.
    """
    cells = _crossed(values, first, second)
    freedom = len(values) - len(cells.people)
    if freedom < 1:
        raise StatisticsError("each cell has only one person; the variance within cells is unknown")
    residual = float(cells.squares.sum())
    if residual <= 1e-20 * max(1.0, float((values**2).sum())):
        raise StatisticsError("the values do not vary within any cell")
    sums = _squares(cells, kind)
    df = {effect: cells.columns[effect].shape[1] for effect in EFFECTS}
    return {
        effect: FTest(sums[effect] / df[effect] / (residual / freedom), df[effect], freedom, len(values))
        for effect in EFFECTS
    }


def two_way_squares(
    values: Values,
    first: NDArray[Any],
    second: NDArray[Any],
    effects: Iterable[str] = EFFECTS,
) -> dict[str, float]:
    """Return the sum of squares for each effect in `effects`. The other arguments are those of `two_way`."""
    return _squares(_crossed(values, first, second), 2, effects)


def _crossed(values: Values, first: NDArray[Any], second: NDArray[Any]) -> Cells:
    cells = cells_of(values, first, second)
    if len(cells.columns) <= len(EFFECTS):
        raise StatisticsError(f"there is only one level ({second[0]})")
    return cells


def _squares(cells: Cells, kind: int, effects: Iterable[str] = EFFECTS) -> dict[str, float]:
    """Return the amount by which each effect reduces the residual sum of squares.

    For type II, main effects are tested in a model without interaction, and for type III in the full model.
    """
    sums = {}
    for effect in effects:
        full = [name for name in cells.columns if kind == 3 or effect == name or name != "interaction"]
        without = cells.residual(name for name in full if name != effect)
        sums[effect] = max(without - cells.residual(full), 0.0)
    return sums


def welch_james(values: Values, assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, FTest]:
    """Compute Welch-James tests of both factors and their interaction, using Johansen's approximation.

    All arrays have shape (n,). Source: Johansen 1980, doi:10.1093/biomet/67.1.85.
    """
    return _tests(values, assistance, objects, 0, _johansen)


def hc3(values: Values, assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, FTest]:
    """Compute F tests of a linear model with the heteroscedasticity-consistent covariance estimator HC3.

    The model has one mean per cell, whose variance is estimated as the cell's variance divided by (size - 1).
    All arrays have shape (n,). Source: Long and Ervin 2000, doi:10.1080/00031305.2000.10474549.
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
    """Compute a Wald test of each effect. The variance of a cell mean is variance / (size - `fewer`)."""
    cells = cells_of(values, assistance, objects)
    if cells.people.min() < 2:
        raise StatisticsError("a cell has only one person; its variance is unknown")
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
    rows = np.asarray(np.linalg.inv(np.hstack(list(cells.columns.values()))), float)
    found, start = {}, 0
    for effect, block in cells.columns.items():
        found[effect] = rows[start : start + block.shape[1]]
        start += block.shape[1]
    found.pop("constant")
    return found
