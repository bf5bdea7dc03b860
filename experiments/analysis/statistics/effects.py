"""Compute effect sizes with confidence intervals, and the power of F tests."""

import bisect
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.special import fdtr, fdtrc, gammaln, ncfdtr, nctdtr
from scipy.stats import f, ncf

from experiments.errors import StatisticsError

ETA_CONFIDENCE = 0.90  # a 90 % interval excludes 0 if and only if p < .05 (Steiger 2004)
CONFIDENCE = 0.95
ALPHA = 0.05
POWER = 0.8
MAX_PEOPLE = 100_000  # maximum number of participants per cell
MAX_WIDTH = 12  # largest search range for the noncentrality of t, in standard errors
MAX_STEPS = 60

Interval = tuple[float, float]


@dataclass(frozen=True)
class FTest:
    """An F test and its effect size.

    Attributes:
        df2: Degrees of freedom of the error, which are fractional in Welch's test.
        people: Sample size.
        within: Degrees of freedom within groups if they differ from df2, otherwise None.
        of: Quantity that is partly explained by the effect, such as `variance`.
    """

    statistic: float
    df1: int
    df2: float
    people: int
    within: int | None = None
    of: str = "variance"

    @cached_property
    def p(self) -> float:
        return float(fdtrc(self.df1, self.df2, self.statistic))

    @property
    def eta_squared(self) -> float:
        """Partial eta squared, computed as F df1 / (F df1 + degrees of freedom within groups)."""
        return partial_eta_squared(self.statistic, self.df1, self.df2 if self.within is None else self.within)

    @cached_property
    def interval(self) -> Interval | None:
        """The 90 % confidence interval of partial eta squared.

        Each limit is L / (L + sample size), where L is a limit of the noncentrality. Source: Steiger 2004,
        doi:10.1037/1082-989X.9.2.164, equations 9 and 17.
        """
        found = f_interval(self.statistic, self.df1, self.df2, ETA_CONFIDENCE)
        if found is None:
            return None
        return found[0] / (found[0] + self.people), found[1] / (found[1] + self.people)

    def p_of_equivalence(self, bound: float) -> float:
        """Return the p-value of the hypothesis that partial eta squared is not smaller than `bound`.

        This is the probability of an F no larger than the observed one if partial eta squared equals `bound`.
        Source: Campbell and Lakens 2021, doi:10.1111/bmsp.12201.
        """
        return float(ncfdtr(self.df1, self.df2, self.people * bound / (1.0 - bound), self.statistic))

    def as_json(self) -> dict[str, Any]:
        names = ("statistic", "df1", "df2", "people", "p", "eta_squared", "interval", "of")
        return {name: getattr(self, name) for name in names}


def partial_eta_squared(statistic: float, df1: float, df2: float) -> float:
    return statistic * df1 / (statistic * df1 + df2)


def hedges_g(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[float | None, Interval | None]:
    """Return the effect size Hedges' g and its 95 % confidence interval. Each is None if it is undefined.

    The effect is positive if the second group has the larger mean. The groups have shapes (n,) and (m,). The
    interval inverts the noncentral t distribution. Source: Hedges 1981, doi:10.3102/10769986006002107.
    """
    n, m = len(first), len(second)
    freedom = n + m - 2
    if min(n, m) < 1 or freedom < 1:
        return None, None
    squares = ((first - first.mean()) ** 2).sum() + ((second - second.mean()) ** 2).sum()
    spread, gap = math.sqrt(squares / freedom), float(second.mean() - first.mean())
    if spread <= 1e-12 * max(1.0, abs(gap)):
        return None, None
    scale, correction = math.sqrt(1 / n + 1 / m), 1.0
    if freedom > 1:
        correction = math.exp(gammaln(freedom / 2) - gammaln((freedom - 1) / 2)) / math.sqrt(freedom / 2)
    found = t_interval(gap / spread / scale, freedom, CONFIDENCE)
    unit = scale * correction
    return gap / spread * correction, None if found is None else (found[0] * unit, found[1] * unit)


def t_interval(statistic: float, freedom: int, confidence: float) -> Interval | None:
    """Return a confidence interval of the noncentrality of a t statistic, or None if the search fails.

    Source: Cumming and Finch 2001, doi:10.1177/0013164401614002.
    """
    step = math.sqrt(1.0 + statistic**2 / (2 * freedom))

    def bound(share: float) -> float | None:
        def excess(center: float) -> float:
            return float(nctdtr(freedom, center, statistic)) - share

        # Widen the search range in steps, because scipy returns NaN for values far from the statistic.
        for width in step * np.arange(1.0, MAX_WIDTH):
            if excess(statistic - width) > 0 > excess(statistic + width):
                return _root(excess, statistic - width, statistic + width)
        return None

    return _both(bound, confidence)


def f_interval(statistic: float, df1: int, df2: float, confidence: float) -> Interval | None:
    """Return a confidence interval of the noncentrality of an F statistic, or None if the search fails.

    Source: Steiger 2004, doi:10.1037/1082-989X.9.2.164.
    """

    def bound(share: float) -> float | None:
        def excess(center: float) -> float:
            return float(ncfdtr(df1, df2, center, statistic)) - share

        if not fdtr(df1, df2, statistic) > share:
            return 0.0
        low, high = 0.0, max(statistic * df1, 1.0)
        for _ in range(MAX_STEPS):
            value = excess(high)
            if not value > 0:
                return None if math.isnan(value) else _root(excess, low, high)
            low, high = high, high * 1.15
        return None

    return _both(bound, confidence)


def _both(bound: Callable[[float], float | None], confidence: float) -> Interval | None:
    low, high = bound(0.5 + confidence / 2), bound(0.5 - confidence / 2)
    return None if low is None or high is None else (low, high)


def _root(excess: Callable[[float], float], low: float, high: float) -> float | None:
    try:
        return float(brentq(excess, low, high, xtol=1e-12, rtol=1e-14))
    except ValueError:  # scipy returned NaN
        return None


def power_of(eta_squared: float, df1: int, df2: float, people: int, alpha: float = ALPHA) -> float:
    """Return the power of an F test if the true partial eta squared is `eta_squared`.

    The noncentrality is people * eta_squared / (1 - eta_squared). Source: Cohen 1988, Statistical Power Analysis for
    the Behavioral Sciences, chapter 8.
    """
    critical = f.ppf(1.0 - alpha, df1, df2)
    return float(ncf.sf(critical, df1, df2, people * eta_squared / (1.0 - eta_squared)))


def detectable_eta_squared(df1: int, df2: float, people: int, power: float = POWER) -> float:
    """Return the smallest partial eta squared that an F test detects with the given power."""
    return float(brentq(lambda eta: power_of(eta, df1, df2, people) - power, 1e-9, 0.999))


def people_per_cell(
    eta_squared: float, df1: int, cells: int, power: float = POWER, alpha: float = ALPHA
) -> int:
    """Return the smallest number of participants per cell with which an F test has the given power."""

    def enough(people: int) -> bool:
        return power_of(eta_squared, df1, cells * (people - 1), cells * people, alpha) >= power

    if not enough(MAX_PEOPLE):
        raise StatisticsError(
            f"an eta squared of {eta_squared:.2g} needs more than {MAX_PEOPLE} people in each cell"
        )
    return bisect.bisect_left(range(MAX_PEOPLE), True, lo=2, key=enough)
