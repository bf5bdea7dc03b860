"""Every two groups compared: which differ, by how much, and which are shown to be about equal."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from scipy import stats

from experiments.analysis.statistics.anova import Values, check_groups, varies
from experiments.analysis.statistics.effects import ALPHA, CONFIDENCE, Interval, hedges_g
from experiments.errors import StatisticsError

DIFFERENT, EQUIVALENT, UNDECIDED = "different", "equivalent", "undecided"


@dataclass(frozen=True)
class Pair:
    """Two groups compared. p values are two-sided; None where they cannot be computed.

    Attributes:
        first: Name of one group.
        second: Name of the other.
        difference: Mean of the second minus mean of the first.
        interval: Its 95 % confidence interval, simultaneous over all pairs (Tukey).
        tukey_p: Tukey's honestly significant difference; variances taken for equal.
        games_howell_p: The same with unequal variances.
        holm_p: Welch's t tests, corrected after Holm over all pairs.
        g: Hedges' g, or None.
        g_interval: Its 95 % confidence interval, or None.
        equivalence_bound: Largest difference that counts as none, in units of the values.
        equivalence_p: Two one-sided Welch tests: below .05, the difference is smaller than the bound.
        verdict: `different` (Tukey), else `equivalent`, else `undecided`: neither is shown.
    """

    first: str
    second: str
    difference: float
    interval: Interval
    tukey_p: float
    games_howell_p: float | None
    holm_p: float | None
    g: float | None
    g_interval: Interval | None
    equivalence_bound: float
    equivalence_p: float | None
    verdict: str


def compare_pairs(groups: Mapping[str, Values], bound: float) -> list[Pair]:
    """Compare every two groups.

    Args:
        groups: Values by name, (n,) each.
        bound: Largest difference that counts as none, in pooled standard deviations within groups.

    Raises:
        StatisticsError: The groups cannot be compared.
    """
    check_groups(groups)
    spread = pooled_deviation(groups)
    return _with_holm(
        groups, [_compare(groups, two, spread, bound) for two in itertools.combinations(groups, 2)]
    )


def _compare(groups: Mapping[str, Values], names: tuple[str, str], spread: float, bound: float) -> Pair:
    one, other = (groups[name] for name in names)
    gap, error = float(other.mean() - one.mean()), spread * math.sqrt(1 / len(one) + 1 / len(other))
    freedom = sum(len(v) for v in groups.values()) - len(groups)
    half = tukey_quantile(len(groups), freedom) * error
    p, equivalence = tukey_p(abs(gap) / error, len(groups), freedom), _equivalence(one, other, bound * spread)
    return Pair(
        *names,
        gap,
        (gap - half, gap + half),
        p,
        _games_howell(one, other, len(groups)),
        None,
        *hedges_g(one, other),
        bound * spread,
        equivalence,
        _verdict(p, equivalence),
    )


def tukey_p(statistic: float, groups: int, freedom: float) -> float:
    """p of two of several groups: a difference in standard errors, by the studentized range.

    Source: Tukey 1953 and Kramer 1956, doi:10.2307/3001469, for unequal numbers of people.
    """
    return float(stats.studentized_range.sf(statistic * math.sqrt(2), groups, freedom))


def tukey_differs(groups: Mapping[str, Values], first: str, second: str) -> bool:
    """Whether Tukey's test finds a difference of two of several groups at .05; quicker than its p.

    Raises:
        StatisticsError: The groups cannot be compared, or one of the two is not there.
    """
    check_groups(groups)
    if missing := [name for name in (first, second) if name not in groups]:
        raise StatisticsError(f"nobody is in {missing[0]}")
    one, other = groups[first], groups[second]
    error = pooled_deviation(groups) * math.sqrt(1 / len(one) + 1 / len(other))
    freedom = sum(len(v) for v in groups.values()) - len(groups)
    return bool(abs(other.mean() - one.mean()) > tukey_quantile(len(groups), freedom) * error)


@lru_cache(maxsize=256)
def tukey_quantile(groups: int, freedom: float, confidence: float = CONFIDENCE) -> float:
    """Standard errors by which two of several groups may differ by chance."""
    return float(stats.studentized_range.ppf(confidence, groups, freedom)) / math.sqrt(2)


def pooled_deviation(groups: Mapping[str, Values]) -> float:
    """Standard deviation within groups."""
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in groups.values())
    return math.sqrt(squares / (sum(len(v) for v in groups.values()) - len(groups)))


def holm(p: Values) -> Values:
    """p values corrected for their number, (n,).

    Source: Holm 1979, Scandinavian Journal of Statistics 6.
    """
    from statsmodels.stats.multitest import multipletests

    return np.asarray(multipletests(p, method="holm")[1], float)


def _verdict(p: float, equivalence: float | None) -> str:
    if p < ALPHA:
        return DIFFERENT
    return EQUIVALENT if equivalence is not None and equivalence < ALPHA else UNDECIDED


def _games_howell(first: Values, second: Values, groups: int) -> float | None:
    """As `tukey_p` with variances of their own and Welch's degrees of freedom.

    Source: Games and Howell 1976, doi:10.3102/10769986001002113.
    """
    if not (varies(first) and varies(second)):
        return None
    test = stats.ttest_ind(first, second, equal_var=False)
    return tukey_p(abs(float(test.statistic)), groups, float(test.df))


def _equivalence(first: Values, second: Values, limit: float) -> float | None:
    from statsmodels.stats.weightstats import ttost_ind

    if not (varies(first) and varies(second)):
        return None
    return float(ttost_ind(first, second, -limit, limit, usevar="unequal")[0])


def _with_holm(groups: Mapping[str, Values], pairs: list[Pair]) -> list[Pair]:
    known = [k for k, p in enumerate(pairs) if varies(groups[p.first]) and varies(groups[p.second])]
    if not known:
        return pairs
    found = [
        stats.ttest_ind(groups[pairs[k].first], groups[pairs[k].second], equal_var=False).pvalue
        for k in known
    ]
    corrected = dict(zip(known, holm(np.array(found)), strict=True))
    return [replace(p, holm_p=float(corrected[k])) if k in corrected else p for k, p in enumerate(pairs)]
