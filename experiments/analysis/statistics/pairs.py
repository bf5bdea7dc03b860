"""Compare pairs of groups with significance tests, effect sizes and equivalence tests."""

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from scipy import stats
from scipy.optimize import brentq
from scipy.special import gammainccinv, gammaincinv, gammaln, ndtr

from experiments.analysis.statistics.anova import Values, check_groups, people_in, varies
from experiments.analysis.statistics.effects import ALPHA, CONFIDENCE, Interval, hedges_g
from experiments.errors import StatisticsError

DIFFERENT, EQUIVALENT, UNDECIDED = "different", "equivalent", "undecided"
NODES, WEIGHTS = np.polynomial.legendre.leggauss(96)
TAIL = 1e-18  # tail probability that is ignored when integrating over the standard deviation
WIDEST = 1e4  # upper limit of the search for quantiles of the studentized range


@dataclass(frozen=True)
class Pair:
    """A comparison of two groups. The p-values are two-sided, or None if they cannot be computed.

    Attributes:
        difference: Mean of the second group minus mean of the first.
        interval: Tukey's simultaneous 95 % confidence interval of the difference.
        holm_p: p-value of Welch's t test, corrected for all pairs by Holm's method.
        equivalence_bound: Largest difference considered equivalent, in units of the values.
        equivalence_p: p-value of two one-sided Welch tests of equivalence.
        equivalence_holm_p: The same p-value, corrected for all pairs by Holm's method.
        verdict: `different` by Tukey's test, `equivalent` by the corrected equivalence test, or `undecided`.
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
    equivalence_holm_p: float | None
    verdict: str

    def agrees(self) -> bool:
        """Return True if all three tests of the difference decide alike at .05."""
        found = (self.tukey_p, self.games_howell_p, self.holm_p)
        return len({p < ALPHA for p in found if p is not None}) == 1


def compare_pairs(groups: Mapping[str, Values], bound: float) -> list[Pair]:
    """Compare all pairs of groups. Differences up to `bound` pooled standard deviations are equivalent."""
    check_groups(groups)
    pairs = list(itertools.combinations(groups, 2))
    welch = {
        (a, b): stats.ttest_ind(groups[a], groups[b], equal_var=False)
        for a, b in pairs
        if varies(groups[a]) and varies(groups[b])
    }
    limit = bound * pooled_deviation(groups)
    different = _corrected({pair: float(test.pvalue) for pair, test in welch.items()})
    equivalent = {pair: _equivalence_p(groups, pair, limit) for pair in welch}
    each = (equivalent, different, _corrected(equivalent))
    return [_compare(groups, pair, limit, welch.get(pair), [p.get(pair) for p in each]) for pair in pairs]


def _equivalence_p(groups: Mapping[str, Values], pair: tuple[str, str], limit: float) -> float:
    from statsmodels.stats.weightstats import ttost_ind

    one, other = (groups[name] for name in pair)
    return float(ttost_ind(one, other, -limit, limit, usevar="unequal")[0])


def _corrected(p: Mapping[tuple[str, str], float]) -> dict[tuple[str, str], float]:
    from statsmodels.stats.multitest import multipletests

    found = multipletests(list(p.values()), method="holm")[1] if p else ()
    return dict(zip(p, map(float, found), strict=True))


def _compare(
    groups: Mapping[str, Values],
    names: tuple[str, str],
    limit: float,
    welch: Any,
    p_values: Sequence[float | None],
) -> Pair:
    one, other = (groups[name] for name in names)
    equivalence, holm_p, equivalence_holm = p_values
    gap, error, freedom = _difference(groups, *names)
    half = tukey_quantile(len(groups), freedom) * error
    p, howell = tukey_p(abs(gap) / error, len(groups), freedom), None
    if welch is not None:  # Games and Howell 1976, doi:10.3102/10769986001002113
        howell = tukey_p(abs(float(welch.statistic)), len(groups), float(welch.df))
    shown = EQUIVALENT if equivalence_holm is not None and equivalence_holm < ALPHA else UNDECIDED
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
        equivalence_holm,
        DIFFERENT if p < ALPHA else shown,
    )


def tukey_differs(groups: Mapping[str, Values], first: str, second: str) -> bool:
    """Return True if Tukey's test is significant at .05. This is faster than computing the p-value."""
    check_groups(groups)
    if missing := [name for name in (first, second) if name not in groups]:
        raise StatisticsError(f"no people in {missing[0]}")
    gap, error, freedom = _difference(groups, first, second)
    return abs(gap) > tukey_quantile(len(groups), freedom) * error


def _difference(groups: Mapping[str, Values], first: str, second: str) -> tuple[float, float, int]:
    one, other = groups[first], groups[second]
    error = pooled_deviation(groups) * math.sqrt(1 / len(one) + 1 / len(other))
    return float(other.mean() - one.mean()), error, people_in(groups) - len(groups)


def tukey_p(statistic: float, groups: int, freedom: float) -> float:
    """Return the p-value of Tukey's test for a difference between two groups, given in standard errors.

    Group sizes may differ. Sources: Tukey 1953 and Kramer 1956, doi:10.2307/3001469.
    """
    return range_sf(statistic * math.sqrt(2), groups, freedom)


def tukey_quantile(groups: int, freedom: float) -> float:
    """Return the smallest difference, in standard errors, that is significant in Tukey's test at .05."""
    return range_quantile(CONFIDENCE, groups, freedom) / math.sqrt(2)


def pooled_deviation(groups: Mapping[str, Values]) -> float:
    squares = sum(float(((v - v.mean()) ** 2).sum()) for v in groups.values())
    return math.sqrt(squares / (people_in(groups) - len(groups)))


def _quadrature(low: float, high: float) -> tuple[Values, Values]:
    half = (high - low) / 2
    return low + half * (NODES + 1), half * WEIGHTS


PLACES, _WEIGHTS = _quadrature(-9.0, 9.0)
DENSITY, BELOW = np.exp(-(PLACES**2) / 2) / math.sqrt(2 * math.pi) * _WEIGHTS, ndtr(PLACES)


def range_sf(statistic: float, groups: int, freedom: float) -> float:
    deviations, weights = _deviations(freedom)
    smaller = ndtr(PLACES - statistic * deviations[:, None])
    larger = groups * (BELOW ** (groups - 1) - (BELOW - smaller) ** (groups - 1)) @ DENSITY
    return float(weights @ larger)


@lru_cache(maxsize=256)
def range_quantile(share: float, groups: int, freedom: float) -> float:
    return float(
        brentq(lambda q: 1 - range_sf(q, groups, freedom) - share, 0.0, WIDEST, xtol=1e-13, rtol=1e-14)
    )


def _deviations(freedom: float) -> tuple[Values, Values]:
    """Return nodes and weights for integrals over the ratio of sample and true standard deviation.

    The nodes are chosen on the scale of the square root of this ratio, because its density is smooth at 0.
    """
    low, high = (
        2 * end / freedom for end in (gammaincinv(freedom / 2, TAIL), gammainccinv(freedom / 2, TAIL))
    )
    roots, weights = _quadrature(low**0.25, high**0.25)
    found = roots**2
    logs = (freedom - 1) * np.log(found) - freedom * found**2 / 2
    constant = freedom / 2 * math.log(freedom / 2) - gammaln(freedom / 2) + math.log(2)
    return found, np.exp(logs + constant) * 2 * roots * weights
