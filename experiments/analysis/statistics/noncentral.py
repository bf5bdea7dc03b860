"""Confidence intervals of the noncentrality of t and F statistics, from which those of effect sizes follow.

Libraries have none as exact: the inverse noncentral F of scipy and statsmodels is good to 1e-4, and pingouin takes
Hedges' g for normally distributed.
"""

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq
from scipy.special import fdtr, ncfdtr, nctdtr

Interval = tuple[float, float]

MAX_WIDTH = 12  # standard errors within which the noncentrality of a t is searched
MAX_STEPS = 60


def t_interval(statistic: float, freedom: int, confidence: float) -> Interval | None:
    """Confidence interval of the noncentrality of a t statistic; None where none is found.

    Source: Cumming and Finch 2001, doi:10.1177/0013164401614002.
    """
    step = math.sqrt(1.0 + statistic**2 / (2 * freedom))

    def bound(share: float) -> float | None:
        def excess(center: float) -> float:
            return float(nctdtr(freedom, center, statistic)) - share

        # Widened step by step: far away from the statistic, scipy's values are NaN.
        for width in step * np.arange(1.0, MAX_WIDTH):
            if excess(statistic - width) > 0 > excess(statistic + width):
                return _root(excess, statistic - width, statistic + width)
        return None

    return _both(bound, confidence)


def f_interval(statistic: float, df1: int, df2: float, confidence: float) -> Interval | None:
    """Confidence interval of the noncentrality of an F statistic, from 0 on; None where none is found.

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
    except ValueError:  # a value in between is NaN
        return None
