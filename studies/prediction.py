"""Prediction intervals and scores for an F test, given an earlier test of the same effect.

Both tests have a sampling error. The noncentrality of the first test is unknown and follows a confidence
distribution. Source: Patil, Peng and Leek 2016, doi:10.1177/1745691616646366. They treat differences; this
module treats F tests.
"""

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq
from scipy.stats import f, ncf

from experiments.analysis.statistics.effects import ALPHA, FTest, Interval, partial_eta_squared
from studies.published import PublishedTest

SHARE = 0.9  # coverage of the intervals
LEVELS = (np.arange(200) + 0.5) / 200

Values = NDArray[np.float64]


@lru_cache(maxsize=64)
def _confidence(statistic: float, df1: int, df2: float) -> Values:
    """Return quantiles of the confidence distribution of the noncentrality, given an F statistic."""
    grid = np.linspace(0.0, math.sqrt(4.0 * statistic * df1 + 100.0), 1500) ** 2
    above = 1.0 - np.nan_to_num(ncf.cdf(statistic, df1, df2, grid))
    return np.interp(LEVELS, above, grid, left=0.0)


def effect_of(test: PublishedTest, people: int) -> Values:
    """Return quantiles of the noncentrality per participant, given a published test, (n,).

    If F is not printed, it is assumed to be below the critical value and distributed as without an effect.
    """
    if test.statistic is not None:
        return _confidence(test.statistic, *test.df) / people
    likely = f.ppf((1.0 - ALPHA) * LEVELS[::10], *test.df)
    return np.sort(np.concatenate([_confidence(float(one), *test.df) for one in likely])) / people


def _shares(test: PublishedTest) -> tuple[float, float]:
    """Return the probabilities below both ends of an interval. Without significance, the first is 0."""
    outside = (1.0 - SHARE) / 2
    return (outside if test.significant else 0.0), 1.0 - outside


def population_interval(test: PublishedTest, people: int) -> Interval:
    """Return an interval of partial eta squared in the population."""
    low, high = np.quantile(effect_of(test, people), _shares(test))
    return float(low / (1 + low)), float(high / (1 + high))


@lru_cache(maxsize=256)
def prediction_interval(test: PublishedTest, people: int, df2: float, others: int) -> Interval:
    """Return an interval of partial eta squared in a second sample of `others` from the same population."""
    centers = effect_of(test, people) * others

    def excess(statistic: float, share: float) -> float:
        return float(ncf.cdf(statistic, test.df[0], df2, centers).mean()) - share

    ends = (float(brentq(excess, 0.0, 1e4, (share,))) if share else 0.0 for share in _shares(test))
    low, high = (partial_eta_squared(end, test.df[0], df2) for end in ends)
    return low, high


def log_score(test: PublishedTest, people: int, effect: Values) -> tuple[float, float]:
    """Return the log probability of a published result, and its two-sided p value, for a given effect.

    If F is not printed, the result is a test that is not significant. `effect` holds equally likely
    noncentralities per participant, (n,).
    """
    if test.statistic is None:
        critical = float(f.ppf(1.0 - ALPHA, *test.df))
        chance = float(ncf.cdf(critical, *test.df, effect * people).mean())
        return math.log(max(chance, 1e-300)), chance
    below = float(ncf.cdf(test.statistic, *test.df, effect * people).mean())
    density = float(ncf.pdf(test.statistic, *test.df, effect * people).mean())
    return math.log(max(density, 1e-300)), 2.0 * min(below, 1.0 - below)


def effect_found(test: FTest) -> Values:
    """Return quantiles of the noncentrality per participant, given a test of our own data, (n,)."""
    return _confidence(test.statistic, test.df1, test.df2) / test.people
