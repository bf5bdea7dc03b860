"""Power of F tests between subjects, and how many people they need."""

from collections.abc import Callable

from scipy.optimize import brentq
from scipy.stats import f, ncf

from experiments.analysis.statistics.effects import ALPHA
from experiments.errors import StatisticsError

POWER = 0.8
MOST = 100_000  # people in a cell


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
    """The smallest number of people in each cell with which a test reaches a power.

    Args:
        eta_squared: Partial eta squared of the effect.
        df1: Its degrees of freedom.
        cells: Number of cells; all have equally many people.
        power: Wanted probability of finding it.
        alpha: Level of the test.

    Raises:
        StatisticsError: More people than anybody could ask would be needed.
    """

    def reached(people: int) -> bool:
        return power_of(eta_squared, df1, cells * (people - 1), cells * people, alpha) >= power

    if not reached(MOST):
        raise StatisticsError(
            f"an eta squared of {eta_squared:.2g} needs more than {MOST} people in each cell"
        )
    return _first(reached, 2, MOST)


def _first(holds: Callable[[int], bool], low: int, high: int) -> int:
    """The smallest number from `low` to `high` from which on something holds."""
    while low < high:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle + 1, high)
    return low
