"""Whether the assumptions of analyses of variance hold: normal residuals and equal variances."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats

from experiments.analysis.statistics.anova import Values, brown_forsythe, check_groups
from experiments.analysis.statistics.effects import FTest

MAX_PEOPLE = 5000  # for which the p of Shapiro and Wilk's test is known


@dataclass(frozen=True)
class Diagnostics:
    """Residuals of a measure around the means of its cells."""

    shapiro_wilk: float  # W of the residuals; 1 where they lie on the line of the normal quantiles
    shapiro_wilk_p: float | None  # None for more than `MAX_PEOPLE`
    skewness: float
    kurtosis: float  # 0 for normal values
    equal_variances: FTest  # Brown and Forsythe's, over all cells
    largest_deviation: tuple[str, float]  # cell, and its standard deviation
    smallest_deviation: tuple[str, float]


def diagnose(cells: Mapping[str, Values]) -> Diagnostics:
    """Diagnostics of values by cell, two or more in each.

    Source: Shapiro and Wilk 1965, doi:10.1093/biomet/52.3-4.591; p by Royston 1995, AS R94.
    """
    check_groups(cells, least=2)
    residuals = residuals_of(cells)
    shapiro = stats.shapiro(residuals)
    spreads = {name: float(values.std(ddof=1)) for name, values in cells.items()}
    low, high = min(spreads, key=spreads.__getitem__), max(spreads, key=spreads.__getitem__)
    return Diagnostics(
        float(shapiro.statistic),
        float(shapiro.pvalue) if len(residuals) <= MAX_PEOPLE else None,
        float(stats.skew(residuals)),
        float(stats.kurtosis(residuals)),
        brown_forsythe(cells),
        (high, spreads[high]),
        (low, spreads[low]),
    )


def residuals_of(cells: Mapping[str, Values]) -> Values:
    """Values less the mean of their cell, cell by cell, (n,)."""
    return np.concatenate([values - values.mean() for values in cells.values()])
