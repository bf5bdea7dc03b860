"""Fit linear models with crossed random factors, and compare conditions by a bootstrap over houses."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from experiments.analysis.statistics.anova import Values, cells_of, varies
from experiments.analysis.statistics.variance_components import VarianceComponents
from experiments.errors import StatisticsError

MIN_LEVELS = 5  # minimum number of levels of a random factor
RESAMPLES = 2000
BATCH = 100  # number of resamples that are processed at a time, to limit memory use


@dataclass(frozen=True)
class WaldTest:
    """A Wald F test of an effect, with Satterthwaite's error degrees of freedom."""

    statistic: float
    df1: int
    df2: float
    p: float


@dataclass(frozen=True)
class RandomFactor:
    """A random factor of a mixed model.

    Attributes:
        variance: Variance between the factor's levels, in squared units of the measure.
        share: Fraction of the variance within conditions that is due to this factor.
        interval: 95 % profile likelihood interval of `share`, or None if the model has a covariate.
    """

    levels: int
    variance: float
    share: float
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class MixedModel:
    """A fitted linear model with crossed random factors. `tests` lists the effects of a covariate last."""

    tests: Mapping[str, WaldTest]
    random: Mapping[str, RandomFactor]
    residual_variance: float


def mixed_model(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[Any],
    random: Mapping[str, NDArray[Any]],
    covariate: tuple[str, Values] | None = None,
) -> MixedModel:
    """Fit a linear mixed model with crossed random factors.

    The fixed effects are the assistance, the number of objects and their interaction. Each factor in `random`
    has a random intercept. All arrays have one entry per trial, shape (n,). A covariate is given with its
    name. It has a linear effect on the values and interacts with the condition.

    Raises:
        StatisticsError: A random factor has too few levels, a cell is empty, or two variances are confounded.
    """
    members = {name: np.unique(levels, return_inverse=True)[1] for name, levels in random.items()}
    for name, member in members.items():
        if member.max() + 1 < MIN_LEVELS and name != "trial_number":
            raise StatisticsError(
                f"a mixed model needs at least {MIN_LEVELS} levels of {name}; there are {member.max() + 1}"
            )
    if not varies(values):
        raise StatisticsError("the values do not vary")
    cells = cells_of(values, assistance, objects)
    columns = {effect: block[cells.member] for effect, block in cells.columns.items()}
    if covariate is not None:
        columns |= _with_covariate(*covariate, columns["assistance"])
    unit = float(values.std())
    fit = VarianceComponents(
        np.hstack(list(columns.values())), (values - values.mean()) / unit, list(members.values())
    )
    fit.climb()
    tests, start = {}, 1
    for effect, block in list(columns.items())[1:]:
        found = fit.test(np.arange(start, start + block.shape[1]))
        tests[effect] = WaldTest(*found, float(fdtrc(found[1], found[2], found[0])))
        start += block.shape[1]
    within = fit.residual * unit**2
    factors = {
        name: RandomFactor(
            int(fit.sizes[k]),
            float(fit.ratios[k]) * within,
            fit.share(k),
            None if covariate else fit.interval(k),
        )
        for k, name in enumerate(members)
    }
    return MixedModel(tests, factors, within)


def _with_covariate(name: str, values: Values, conditions: Values) -> dict[str, Values]:
    if not varies(values):
        raise StatisticsError(f"{name} is the same everywhere")
    column = ((values - values.mean()) / values.std())[:, None]
    return {name: column, f"{name} x assistance": column * conditions}


@dataclass(frozen=True)
class HouseDifference:
    """The difference between two condition means, with a 95 % interval from a bootstrap over houses."""

    first: str
    second: str
    difference: float
    interval: tuple[float, float]


def differences_by_house(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[np.int64],
    houses: NDArray[Any],
    conditions: Sequence[str],
    seed: int = 0,
) -> list[HouseDifference]:
    """Compare all pairs of conditions with a percentile bootstrap over houses. Arrays have shape (n,)."""
    names, house = np.unique(houses, return_inverse=True)
    if len(names) < MIN_LEVELS:
        raise StatisticsError(f"resampling needs at least {MIN_LEVELS} houses; there are {len(names)}")
    levels = np.unique(objects)
    shape = len(names), len(conditions), len(levels)
    sums, counts = np.zeros(shape), np.zeros(shape)
    index = {condition: k for k, condition in enumerate(conditions)}
    cell = house, np.array([index[c] for c in assistance]), np.searchsorted(levels, objects)
    np.add.at(sums, cell, values)
    np.add.at(counts, cell, 1.0)
    if not counts.sum(axis=0).all():
        raise StatisticsError("a condition has no trials at some number of objects")
    rng = np.random.default_rng(seed)
    even, resampled = np.full(len(names), 1 / len(names)), []
    for _ in range(0, RESAMPLES, BATCH):
        drawn = rng.multinomial(len(names), even, BATCH)
        with np.errstate(invalid="ignore"):  # a cell may be empty in a resample
            resampled.append(np.tensordot(drawn, sums, 1) / np.tensordot(drawn, counts, 1))
    means, own = np.concatenate(resampled).mean(axis=2), (sums.sum(axis=0) / counts.sum(axis=0)).mean(axis=1)
    found = []
    for i, j in itertools.combinations(range(len(conditions)), 2):
        low, high = np.nanquantile(means[:, j] - means[:, i], (0.025, 0.975)).tolist()
        found.append(HouseDifference(conditions[i], conditions[j], float(own[j] - own[i]), (low, high)))
    return found
