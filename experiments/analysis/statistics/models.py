"""Fit proportional odds models to ordinal answers, and compute diagnostics of residuals.

The likelihood has a single maximum, which is found by Newton's method. statsmodels is a hundred times slower
and is accurate only to 1e-4.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import stats
from scipy.special import expit, logit
from scipy.stats import chi2

from experiments.analysis.statistics.anova import Values, brown_forsythe, check_groups, varies
from experiments.analysis.statistics.effects import FTest
from experiments.errors import StatisticsError

MAX_STEPS = 60
FARTHEST = 25.0  # largest parameter of a fit that has not diverged, in logits


@dataclass(frozen=True)
class Chi2Test:
    """A chi-squared test of one term of a model."""

    statistic: float
    df: int
    p: float


@dataclass(frozen=True)
class OrdinalModel:
    """A fitted proportional odds model. `odds_ratios` compares each condition with the first condition."""

    test: Chi2Test
    odds_ratios: Mapping[str, float]
    people: int


def ordinal_model(groups: Mapping[str, Values]) -> OrdinalModel:
    """Fit a proportional odds model to integer answers, grouped by condition.

    Source: McCullagh 1980, doi:10.1111/j.2517-6161.1980.tb01109.x.
    """
    if len(groups) < 2:
        raise StatisticsError("there is only one group")
    answers = np.concatenate(list(groups.values()))
    if not varies(answers):
        raise StatisticsError("all answers are the same")
    given = np.unique(answers)
    counts = np.array([(values[:, None] == given).sum(axis=0) for values in groups.values()], float)
    likelihood, shifts = _climb(counts)
    total = counts.sum(axis=0)
    alone = float((total * np.log(total / total.sum())).sum())  # the log likelihood of the null model
    gain, df = max(2 * (likelihood - alone), 0.0), len(groups) - 1
    return OrdinalModel(
        Chi2Test(gain, df, float(chi2.sf(gain, df))),
        dict(zip(list(groups)[1:], np.exp(shifts).tolist(), strict=True)),
        len(answers),
    )


def _climb(counts: Values) -> tuple[float, Values]:
    groups, cuts = counts.shape[0], counts.shape[1] - 1
    share = counts.sum(axis=0).cumsum()[:-1] / counts.sum()
    point = np.concatenate([logit(share), np.zeros(groups - 1)])
    # The logit of P(answer <= cut) is modelled as the cut minus the shift of the group.
    member = np.repeat(np.eye(groups)[:, 1:], cuts, axis=0)
    design = np.hstack([np.tile(np.eye(cuts), (groups, 1)), -member])
    value, gradient, curvature = _likelihood(counts, design, point)
    for _ in range(MAX_STEPS):
        step = np.linalg.solve(curvature, gradient)
        for _ in range(MAX_STEPS):
            found = _likelihood(counts, design, point + step)
            if found[0] >= value - 1e-12 * abs(value):
                break
            step /= 2
        point = point + step
        value, gradient, curvature = found
        if np.abs(point).max() > FARTHEST:
            break
        if np.abs(step).max() < 1e-10:
            return value, point[cuts:]
    raise StatisticsError("the ordinal model does not converge: a group gives none of the answers of another")


def _likelihood(counts: Values, design: Values, point: Values) -> tuple[float, Values, Values]:
    groups, cuts = counts.shape[0], counts.shape[1] - 1
    below = expit(design @ point).reshape(groups, cuts)
    chance = np.diff(below, prepend=0.0, append=1.0, axis=1)
    if chance.min() <= 0.0:
        return -np.inf, point, design
    slope = below * (1 - below)
    rate, curve = counts / chance, counts / chance**2
    by_logit = slope * (rate[:, :-1] - rate[:, 1:])
    inner = np.zeros((groups, cuts, groups, cuts))
    k = np.arange(groups)[:, None]
    j = np.arange(cuts)
    inner[k, j, k, j] = slope**2 * (curve[:, :-1] + curve[:, 1:]) - by_logit * (1 - 2 * below)
    between = -slope[:, :-1] * slope[:, 1:] * curve[:, 1:-1]
    inner[k, j[:-1], k, j[1:]] = inner[k, j[1:], k, j[:-1]] = between
    curvature = design.T @ inner.reshape(groups * cuts, -1) @ design
    return float((counts * np.log(chance)).sum()), design.T @ by_logit.ravel(), curvature


MAX_SHAPIRO = 5000  # largest sample for which scipy's p-value of the Shapiro-Wilk test is accurate


@dataclass(frozen=True)
class Diagnostics:
    """Diagnostics of the residuals of a measure, which are its deviations from the cell means.

    Attributes:
        shapiro_wilk: Statistic W of the Shapiro-Wilk test, which is 1 for perfectly normal residuals.
        shapiro_wilk_p: p-value of the Shapiro-Wilk test, or None for samples larger than `MAX_SHAPIRO`.
        kurtosis: Excess kurtosis, which is 0 for normal residuals.
        equal_variances: Brown-Forsythe test over all cells.
        largest_deviation: Name and standard deviation of the cell with the largest standard deviation.
    """

    shapiro_wilk: float
    shapiro_wilk_p: float | None
    skewness: float
    kurtosis: float
    equal_variances: FTest
    largest_deviation: tuple[str, float]
    smallest_deviation: tuple[str, float]


def diagnose(cells: Mapping[str, Values]) -> Diagnostics:
    """Compute diagnostics of the residuals in all cells. Each cell needs at least two values.

    Sources: Shapiro and Wilk 1965, doi:10.1093/biomet/52.3-4.591; p-value by Royston 1995, AS R94.
    """
    check_groups(cells, least=2)
    residuals = residuals_of(cells)
    shapiro = stats.shapiro(residuals)
    spreads = {name: float(values.std(ddof=1)) for name, values in cells.items()}
    low, high = min(spreads, key=spreads.__getitem__), max(spreads, key=spreads.__getitem__)
    return Diagnostics(
        float(shapiro.statistic),
        float(shapiro.pvalue) if len(residuals) <= MAX_SHAPIRO else None,
        float(stats.skew(residuals)),
        float(stats.kurtosis(residuals)),
        brown_forsythe(cells),
        (high, spreads[high]),
        (low, spreads[low]),
    )


def residuals_of(cells: Mapping[str, Values]) -> Values:
    """Return the residuals of all cells in one array. A residual is a value minus the mean of its cell."""
    return np.concatenate([values - values.mean() for values in cells.values()])
