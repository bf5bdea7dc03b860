"""Effect sizes with confidence intervals: partial eta squared of an F test, Hedges' g of two groups."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc, gammaln, ncfdtr

from experiments.analysis.statistics.noncentral import Interval, f_interval, t_interval

ETA_CONFIDENCE = 0.90  # its lower bound is above 0 exactly where p < .05 (Steiger 2004)
CONFIDENCE = 0.95
ALPHA = 0.05


@dataclass(frozen=True)
class FTest:
    """An F test with its effect size."""

    statistic: float  # F
    df1: int  # degrees of freedom of the effect
    df2: float  # of the error; not a whole number in Welch's test
    people: int  # sample size
    # degrees of freedom within groups, if they are not df2; and what the effect size is a share of
    within: int | None = None
    of: str = "variance"

    @cached_property
    def p(self) -> float:
        """Probability of such an F or a larger one without an effect."""
        return float(fdtrc(self.df1, self.df2, self.statistic))

    @property
    def eta_squared(self) -> float:
        """Partial eta squared, F df1 / (F df1 + degrees of freedom within groups)."""
        return partial_eta_squared(self.statistic, self.df1, self.df2 if self.within is None else self.within)

    @cached_property
    def interval(self) -> Interval | None:
        """90 % confidence interval of partial eta squared; the noncentrality L gives L / (L + people).

        Source: Steiger 2004, doi:10.1037/1082-989X.9.2.164, equations 9 and 17.
        """
        found = f_interval(self.statistic, self.df1, self.df2, ETA_CONFIDENCE)
        return (
            None
            if found is None
            else (found[0] / (found[0] + self.people), found[1] / (found[1] + self.people))
        )

    def p_of_equivalence(self, bound: float) -> float:
        """Probability of such an F or a smaller one if partial eta squared were `bound`: below .05, it is smaller.

        Source: Campbell and Lakens 2021, doi:10.1111/bmsp.12201.
        """
        return float(ncfdtr(self.df1, self.df2, self.people * bound / (1.0 - bound), self.statistic))

    def as_json(self) -> dict[str, Any]:
        """The test, its p, and its effect size."""
        names = ("statistic", "df1", "df2", "people", "p", "eta_squared", "interval", "of")
        return {name: getattr(self, name) for name in names}


def partial_eta_squared(statistic: float, df1: float, df2: float) -> float:
    """Share of the variance, without that of other effects, that an effect explains in the sample."""
    return statistic * df1 / (statistic * df1 + df2)


def hedges_g(first: NDArray[np.float64], second: NDArray[np.float64]) -> tuple[float | None, Interval | None]:
    """Difference of means, second minus first, in pooled standard deviations, without the bias of small samples.

    Groups have shapes (n,) and (m,). The 95 % confidence interval is by the noncentral t; None where it is undefined.
    Source: Hedges 1981, doi:10.3102/10769986006002107.
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
