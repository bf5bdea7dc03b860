"""Effect sizes with confidence intervals: partial eta squared of an F test, Hedges' g of two groups."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaln
from scipy.stats import f, ncf

from experiments.analysis.statistics.noncentral import f_noncentrality, t_noncentrality

Interval = tuple[float, float]

ETA_CONFIDENCE = 0.90  # its lower bound is above 0 exactly where p < .05 (Steiger 2004)
CONFIDENCE = 0.95
ALPHA = 0.05


@dataclass(frozen=True)
class FTest:
    """An F test with its effect size.

    Attributes:
        statistic: F.
        df1: Degrees of freedom of the effect.
        df2: Of the error; not a whole number in Welch's test.
        people: How many people it is of.
        p: Probability of such an F or a larger one without an effect.
        eta_squared: Partial eta squared, F df1 / (F df1 + df2).
        interval: Its 90 % confidence interval by the noncentral F; None where none is found.
    """

    statistic: float
    df1: int
    df2: float
    people: int
    p: float
    eta_squared: float
    interval: Interval | None

    @classmethod
    def of(cls, statistic: float, df1: int, df2: float, people: int) -> "FTest":
        """From the statistic and its degrees of freedom."""
        return cls(
            statistic,
            df1,
            df2,
            people,
            float(f.sf(statistic, df1, df2)),
            partial_eta_squared(statistic, df1, df2),
            eta_squared_interval(statistic, df1, df2, people),
        )

    def p_of_equivalence(self, bound: float) -> float:
        """Probability of such an F or a smaller one if partial eta squared were `bound`: below .05, it is smaller.

        Source: Campbell and Lakens 2021, doi:10.1111/bmsp.12201.
        """
        return float(ncf.cdf(self.statistic, self.df1, self.df2, self.people * bound / (1.0 - bound)))


def partial_eta_squared(statistic: float, df1: float, df2: float) -> float:
    """Share of the variance, besides that of other effects, that an effect explains in the sample."""
    return statistic * df1 / (statistic * df1 + df2)


def eta_squared_interval(
    statistic: float, df1: int, df2: float, people: int, confidence: float = ETA_CONFIDENCE
) -> Interval | None:
    """Confidence interval of partial eta squared; the noncentrality L gives L / (L + people).

    Source: Steiger 2004, doi:10.1037/1082-989X.9.2.164, equations 9 and 17.
    """
    bounds = [f_noncentrality(statistic, df1, df2, 0.5 + side * confidence / 2) for side in (1, -1)]
    if None in bounds:
        return None
    low, high = (float(b or 0.0) for b in bounds)
    return low / (low + people), high / (high + people)


def f_of_eta_squared(eta_squared: float, df1: float, df2: float) -> float:
    """The F that goes with a partial eta squared."""
    return eta_squared / (1.0 - eta_squared) * df2 / df1


def hedges_g(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[float | None, Interval | None]:
    """Difference of means, second minus first, in pooled standard deviations, without the bias of small samples.

    Args:
        first: Values of one group, (n,).
        second: Values of the other, (m,).

    Returns:
        The effect size and its 95 % confidence interval by the noncentral t; None where it cannot be known.

    Source: Hedges 1981, doi:10.3102/10769986006002107.
    """
    n, m = len(first), len(second)
    freedom = n + m - 2
    if min(n, m) < 1 or freedom < 1:
        return None, None
    squares = ((first - first.mean()) ** 2).sum() + ((second - second.mean()) ** 2).sum()
    spread = math.sqrt(squares / freedom)
    gap = float(second.mean() - first.mean())
    if spread <= 1e-12 * max(1.0, abs(gap)):
        return None, None
    scale = math.sqrt(1 / n + 1 / m)
    unbias = (
        math.exp(gammaln(freedom / 2) - gammaln((freedom - 1) / 2)) / math.sqrt(freedom / 2)
        if freedom > 1
        else 1
    )
    shares = (0.5 + CONFIDENCE / 2, 0.5 - CONFIDENCE / 2)
    bounds = [t_noncentrality(gap / spread / scale, freedom, share) for share in shares]
    interval = (
        None
        if None in bounds
        else (float(bounds[0] or 0) * scale * unbias, float(bounds[1] or 0) * scale * unbias)
    )
    return gap / spread * unbias, interval
