"""Power of F tests between subjects, and the sample size that they need."""

import bisect

from scipy.optimize import brentq
from scipy.stats import f, ncf

from experiments.analysis.statistics.effects import ALPHA
from experiments.errors import StatisticsError

POWER = 0.8
MAX_PEOPLE = 100_000  # in a cell


def power_of(eta_squared: float, df1: int, df2: float, people: int, alpha: float = ALPHA) -> float:
    """Probability that an F test finds an effect of this partial eta squared.

    The noncentrality is people eta squared / (1 - eta squared).

    Source: Cohen 1988, Statistical Power Analysis for the Behavioral Sciences, chapter 8.
    """
    critical = f.ppf(1.0 - alpha, df1, df2)
    return float(ncf.sf(critical, df1, df2, people * eta_squared / (1.0 - eta_squared)))


def detectable_eta_squared(df1: int, df2: float, people: int, power: float = POWER) -> float:
    """The smallest partial eta squared that such a test finds with this probability."""
    return float(brentq(lambda eta: power_of(eta, df1, df2, people) - power, 1e-9, 0.999))


def people_per_cell(
    eta_squared: float, df1: int, cells: int, power: float = POWER, alpha: float = ALPHA
) -> int:
    """The smallest number of people in each of `cells` equal cells with which a test reaches a power."""

    def enough(people: int) -> bool:
        return power_of(eta_squared, df1, cells * (people - 1), cells * people, alpha) >= power

    if not enough(MAX_PEOPLE):
        raise StatisticsError(
            f"an eta squared of {eta_squared:.2g} needs more than {MAX_PEOPLE} people in each cell"
        )
    return bisect.bisect_left(range(MAX_PEOPLE), True, lo=2, key=enough)
