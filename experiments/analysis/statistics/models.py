"""Regressions of statsmodels: ordinal answers, and houses as a random factor."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from experiments.analysis.statistics.anova import EFFECTS, Values, sum_coded, varies
from experiments.errors import StatisticsError

MIN_HOUSES = 5  # fewer say little about the variance between houses


@dataclass(frozen=True)
class Chi2Test:
    """A chi squared test of a model's term: statistic, degrees of freedom, and p."""

    statistic: float
    df: int
    p: float


@dataclass(frozen=True)
class OrdinalModel:
    """Proportional odds of answers by condition."""

    test: Chi2Test  # likelihood ratio test of the condition
    # by condition: odds of a higher answer, over those under the first condition
    odds_ratios: Mapping[str, float]
    people: int  # number of answers


@dataclass(frozen=True)
class MixedModel:
    """A linear model with houses as a random factor, fitted by restricted maximum likelihood."""

    # Wald tests by effect: `assistance`, and where there are several levels, `objects` and `interaction`
    tests: Mapping[str, Chi2Test]
    house_variance: float  # variance between houses, in squared units of the measure
    residual_variance: float  # variance between people in a house
    houses: int  # number of houses


def ordinal_model(groups: Mapping[str, Values]) -> OrdinalModel:
    """Fit proportional odds to answers by condition; answers must be whole numbers.

    Source: McCullagh 1980, doi:10.1111/j.2517-6161.1980.tb01109.x.
    """
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    if len(groups) < 2:
        raise StatisticsError("there is only one group")
    answers = np.concatenate(list(groups.values()))
    if not varies(answers):
        raise StatisticsError("all answers are the same")
    codes, counts = np.unique(answers, return_inverse=True)[1], np.unique(answers, return_counts=True)[1]
    members = np.repeat(np.arange(len(groups)), [len(v) for v in groups.values()])
    dummies = (members[:, None] == np.arange(1, len(groups))).astype(float)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # convergence is checked below
        fit = OrderedModel(codes, dummies, distr="logit").fit(method="bfgs", maxiter=500, disp=False)
    if not fit.mle_retvals["converged"] or not np.isfinite(fit.llf):
        raise StatisticsError(
            "the ordinal model does not converge: a group gives none of the answers of another"
        )
    alone = float((counts * np.log(counts / counts.sum())).sum())  # likelihood without conditions
    gain, df = max(2 * (float(fit.llf) - alone), 0.0), len(groups) - 1
    ratios = np.exp(fit.params[:df])
    return OrdinalModel(
        Chi2Test(gain, df, float(chi2.sf(gain, df))),
        dict(zip(list(groups)[1:], ratios.tolist(), strict=True)),
        len(answers),
    )


def mixed_model(
    values: Values, assistance: NDArray[Any], objects: NDArray[Any], houses: NDArray[Any]
) -> MixedModel:
    """Fit assistance, number of objects and both together as fixed effects, and houses as a random one.

    All arrays have one entry per person, (n,). Raises `StatisticsError` if houses are few, a cell is empty or it fails.
    """
    count = len(np.unique(houses))
    if count < MIN_HOUSES:
        raise StatisticsError(f"a mixed model needs at least {MIN_HOUSES} houses; there are {count}")
    if not varies(values):
        raise StatisticsError("the values do not vary")
    terms = "C(assistance, Sum)"
    if len(np.unique(objects)) > 1:
        sum_coded(assistance, objects)  # which finds empty cells
        terms += " * C(objects, Sum)"
    spread = float(values.std())  # in its units, so that small and large measures converge alike
    data = {"y": values / spread, "assistance": assistance, "objects": objects}
    fit = _fit_mixed(f"y ~ {terms}", data, houses)
    found = fit.wald_test_terms(scalar=True).table.iloc[1:]  # without the constant
    tests = (Chi2Test(float(x), int(df), float(p)) for x, p, df in found.itertuples(index=False))
    return MixedModel(
        dict(zip(EFFECTS, tests, strict=False)),
        float(np.asarray(fit.cov_re)[0, 0]) * spread**2,
        float(fit.scale) * spread**2,
        count,
    )


def _fit_mixed(formula: str, data: Mapping[str, NDArray[Any]], houses: NDArray[Any]) -> Any:
    from statsmodels.formula.api import mixedlm

    for method in ("bfgs", "powell"):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of a variance between houses of zero
            try:
                fit = mixedlm(formula, data, groups=houses).fit(method=method)
            except (np.linalg.LinAlgError, ValueError):
                continue
        # At the edge, some optimizations end in an infinite likelihood.
        if fit.converged and np.isfinite(fit.llf):
            return fit
    raise StatisticsError("the mixed model does not converge")
