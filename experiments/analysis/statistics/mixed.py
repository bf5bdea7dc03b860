"""A linear model with crossed random factors, such as person and house, by restricted maximum likelihood."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import fdtrc

from experiments.analysis.statistics.anova import Values, cells_of, varies
from experiments.analysis.statistics.variance_components import VarianceComponents
from experiments.errors import StatisticsError

MIN_LEVELS = 5  # fewer say little about the variance between them


@dataclass(frozen=True)
class WaldTest:
    """A Wald F test of a model's term, with Satterthwaite's degrees of freedom of the error."""

    statistic: float  # F
    df1: int
    df2: float
    p: float


@dataclass(frozen=True)
class RandomFactor:
    """A random factor of a model."""

    levels: int
    variance: float  # between levels, in squared units of the measure
    share: float  # of the variance within conditions, from 0 to 1
    # its 95 % interval, by the profile of the restricted likelihood; None in models with a covariate
    interval: tuple[float, float] | None


@dataclass(frozen=True)
class MixedModel:
    """A linear model with crossed random factors."""

    # by effect: `assistance`, and where there are several levels, `objects` and `interaction`; then the covariate's
    tests: Mapping[str, WaldTest]
    random: Mapping[str, RandomFactor]  # by name
    residual_variance: float  # what is left, in squared units of the measure


def mixed_model(
    values: Values,
    assistance: NDArray[Any],
    objects: NDArray[Any],
    random: Mapping[str, NDArray[Any]],
    covariate: tuple[str, Values] | None = None,
) -> MixedModel:
    """Fit assistance, number of objects and both together as fixed effects, and random intercepts of the factors.

    All arrays have one entry per trial, (n,). A covariate, with its name, is linear, and so is its part in the
    differences between conditions. Raises `StatisticsError` if levels are few, a cell is empty or the variances cannot
    be told apart.
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
