"""Noncentrality of F and t statistics: what confidence intervals of effect sizes are made of."""

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.stats import f, ncf, nct

STEPS = 12  # standard errors in which the noncentrality of a t is looked for
DOUBLINGS = 60


def t_noncentrality(statistic: float, freedom: int, share: float) -> float | None:
    """The noncentrality with which a share of the t distribution lies below the statistic; None where none is found.

    Source: Cumming and Finch 2001, doi:10.1177/0013164401614002.
    """

    def excess(center: float) -> float:
        return float(nct.cdf(statistic, freedom, center)) - share

    # Widened step by step: far away from the statistic, scipy's values are not numbers.
    step = math.sqrt(1.0 + statistic**2 / (2 * freedom))
    for width in step * np.arange(1.0, STEPS):
        if excess(statistic - width) > 0 > excess(statistic + width):
            try:
                return float(brentq(excess, statistic - width, statistic + width))
            except ValueError:  # one in between is no number: two pairs that differ by nearly the same
                return None
    return None


def f_noncentrality(statistic: float, df1: int, df2: float, share: float) -> float | None:
    """The noncentrality with which a share of the F distribution lies below the statistic.

    0 where even the central distribution has less below it; None where none is found.

    Source: Steiger 2004, doi:10.1037/1082-989X.9.2.164.
    """
    if not f.cdf(statistic, df1, df2) > share:
        return 0.0

    def excess(center: float) -> float:
        return float(ncf.cdf(statistic, df1, df2, center)) - share

    low, high = 0.0, max(statistic * df1, 1.0)
    for _ in range(DOUBLINGS):
        value = excess(high)
        if value <= 0:
            return _root(excess, low, high)
        if math.isnan(value):
            return None
        low, high = high, high * 1.15
    return None


def _root(excess: Callable[[float], float], low: float, high: float) -> float | None:
    try:
        return float(brentq(excess, low, high, xtol=1e-12, rtol=1e-14))
    except ValueError:  # a value in between is no number
        return None
