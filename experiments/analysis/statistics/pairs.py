"""Every two groups compared: which differ, by how much, and which are shown to be about equal."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq
from scipy.special import gammainccinv, gammaincinv, gammaln, ndtr

from experiments.analysis.statistics.anova import Values, check_groups, people_in, varies
from experiments.analysis.statistics.effects import ALPHA, CONFIDENCE, hedges_g
from experiments.analysis.statistics.noncentral import Interval
from experiments.errors import StatisticsError

DIFFERENT, EQUIVALENT, UNDECIDED = "different", "equivalent", "undecided"
NODES, WEIGHTS = np.polynomial.legendre.leggauss(96)
TAIL = 1e-18  # of the distribution of the standard deviation, left out at either end
WIDEST = 1e4  # range that a quantile may have


@dataclass(frozen=True)
class Pair:
    """Two groups compared. p values are two-sided; None where they cannot be computed."""

    first: str  # name of one group
    second: str  # name of the other
    difference: float  # mean of the second minus mean of the first
    interval: Interval  # its 95 % confidence interval, simultaneous over all pairs (Tukey)
    tukey_p: float  # Tukey's honestly significant difference, which assumes equal variances
    games_howell_p: float | None  # the same with unequal variances
    holm_p: float | None  # Welch's t tests, corrected after Holm over all pairs
    g: float | None  # Hedges' g, or None
    g_interval: Interval | None  # its 95 % confidence interval, or None
    equivalence_bound: float  # largest difference that counts as none, in units of the values
    # two one-sided Welch tests: below .05, the difference is smaller than the bound
    equivalence_p: float | None
    verdict: str  # `different` (Tukey), else `equivalent`, else `undecided`: neither is shown


def compare_pairs(groups: Mapping[str, Values], bound: float) -> list[Pair]:
    """Compare every two groups; `bound` is the largest difference that counts as none, in pooled SDs within groups."""
    check_groups(groups)
    pairs = list(itertools.combinations(groups, 2))
    welch = {
        (a, b): stats.ttest_ind(groups[a], groups[b], equal_var=False)
        for a, b in pairs
        if varies(groups[a]) and varies(groups[b])
    }
    corrected = holm(np.array([test.pvalue for test in welch.values()])) if welch else ()
    holm_p = dict(zip(welch, map(float, corrected), strict=True))
    return [_compare(groups, pair, bound, welch.get(pair), holm_p.get(pair)) for pair in pairs]


def _compare(
    groups: Mapping[str, Values], names: tuple[str, str], bound: float, welch: Any, holm_p: float | None
) -> Pair:
    from statsmodels.stats.weightstats import ttost_ind

    one, other = (groups[name] for name in names)
    gap, error, freedom = _difference(groups, *names)
    half = tukey_quantile(len(groups), freedom) * error
    p, limit = tukey_p(abs(gap) / error, len(groups), freedom), bound * pooled_deviation(groups)
    howell = equivalence = None
    if welch is not None:  # Games and Howell 1976, doi:10.3102/10769986001002113
        howell = tukey_p(abs(float(welch.statistic)), len(groups), float(welch.df))
        equivalence = float(ttost_ind(one, other, -limit, limit, usevar="unequal")[0])
    shown = EQUIVALENT if equivalence is not None and equivalence < ALPHA else UNDECIDED
    return Pair(
        *names,
        gap,
        (gap - half, gap + half),
        p,
        howell,
        holm_p,
        *hedges_g(one, other),
        limit,
        equivalence,
        DIFFERENT if p < ALPHA else shown,
    )


def tukey_differs(groups: Mapping[str, Values], first: str, second: str) -> bool:
    """Whether Tukey's test finds a difference of two of several groups at .05; quicker than its p."""
    check_groups(groups)
    if missing := [name for name in (first, second) if name not in groups]:
        raise StatisticsError(f"no people in {missing[0]}")
    gap, error, freedom = _difference(groups, first, second)
    return abs(gap) > tukey_quantile(len(groups), freedom) * error


def _difference(groups: Mapping[str, Values], first: str, second: str) -> tuple[float, float, int]:
    """Difference of two means, second minus first, its pooled standard error, and degrees of freedom."""
    one, other = groups[first], groups[second]
    error = pooled_deviation(groups) * math.sqrt(1 / len(one) + 1 / len(other))
    return float(other.mean() - one.mean()), error, people_in(groups) - len(groups)


def tukey_p(statistic: float, groups: int, freedom: float) -> float:
    """p of a difference of two of several groups, in standard errors, by the studentized range.

    Source: Tukey 1953 and Kramer 1956, doi:10.2307/3001469, for unequal numbers of people.
    """
    return range_sf(statistic * math.sqrt(2), groups, freedom)


def tukey_quantile(groups: int, freedom: float) -> float:
    """Standard errors by which two of several groups may differ by chance, at 95 %."""
    return range_quantile(CONFIDENCE, groups, freedom) / math.sqrt(2)


def pooled_deviation(groups: Mapping[str, Values]) -> float:
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in groups.values())
    return math.sqrt(squares / (people_in(groups) - len(groups)))


def holm(p: Values) -> Values:
    """p values corrected for their number, (n,).

    Source: Holm 1979, Scandinavian Journal of Statistics 6.
    """
    order = np.argsort(p)
    found = np.empty(len(p))
    found[order] = np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)).clip(max=1.0)
    return found


def _placed(low: float, high: float) -> tuple[Values, Values]:
    half = (high - low) / 2
    return low + half * (NODES + 1), half * WEIGHTS


PLACES, _WEIGHTS = _placed(-9.0, 9.0)
DENSITY, BELOW = np.exp(-(PLACES**2) / 2) / math.sqrt(2 * math.pi) * _WEIGHTS, ndtr(PLACES)


def range_sf(statistic: float, groups: int, freedom: float) -> float:
    """Probability of a larger studentized range."""
    deviations, weights = _deviations(freedom)
    smaller = ndtr(PLACES - statistic * deviations[:, None])
    larger = groups * (BELOW ** (groups - 1) - (BELOW - smaller) ** (groups - 1)) @ DENSITY
    return float(weights @ larger)


@lru_cache(maxsize=256)
def range_quantile(share: float, groups: int, freedom: float) -> float:
    """The range below which this share lies."""
    return float(
        brentq(lambda q: 1 - range_sf(q, groups, freedom) - share, 0.0, WIDEST, xtol=1e-13, rtol=1e-14)
    )


def _deviations(freedom: float) -> tuple[Values, Values]:
    """Standard deviations of samples whose true one is 1, and their probabilities.

    Placed by their root, in which the density is smooth at 0 whatever the degrees of freedom.
    """
    low, high = (
        2 * end / freedom for end in (gammaincinv(freedom / 2, TAIL), gammainccinv(freedom / 2, TAIL))
    )
    roots, weights = _placed(low**0.25, high**0.25)
    found = roots**2
    logs = (freedom - 1) * np.log(found) - freedom * found**2 / 2
    constant = freedom / 2 * math.log(freedom / 2) - gammaln(freedom / 2) + math.log(2)
    return found, np.exp(logs + constant) * 2 * roots * weights
