"""Regressions of statsmodels: ordinal answers, and houses as a random factor."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from experiments.analysis.statistics.anova import Design, Values, sum_coded, varies
from experiments.errors import StatisticsError

LEAST_HOUSES = 5  # with fewer, nothing is learned about how houses differ


@dataclass(frozen=True)
class Chi2Test:
    """A chi squared test of a model's term.

    Attributes:
        statistic: Chi squared.
        df: Degrees of freedom.
        p: Probability of such a statistic or a larger one without an effect.
    """

    statistic: float
    df: int
    p: float


@dataclass(frozen=True)
class OrdinalModel:
    """Proportional odds of answers by condition.

    Attributes:
        test: Likelihood ratio test of the condition.
        odds_ratios: By condition: odds of a higher answer, over those under the first condition.
        people: How many answered.
    """

    test: Chi2Test
    odds_ratios: Mapping[str, float]
    people: int


@dataclass(frozen=True)
class MixedModel:
    """A linear model with houses as a random factor, fitted by restricted maximum likelihood.

    Attributes:
        tests: Wald tests by effect: `assistance`, and where there are several levels, `objects` and `interaction`.
        house_variance: Variance between houses, in squared units of the measure.
        residual_variance: Variance between people in a house.
        houses: How many houses there are.
    """

    tests: Mapping[str, Chi2Test]
    house_variance: float
    residual_variance: float
    houses: int


def ordinal_model(groups: Mapping[str, Values]) -> OrdinalModel:
    """Fit proportional odds to answers by condition; answers must be whole numbers.

    Source: McCullagh 1980, doi:10.1111/j.2517-6161.1980.tb01109.x.

    Raises:
        StatisticsError: There is one condition only, everybody answers the same, or the fit does not converge.
    """
    from statsmodels.miscmodels.ordinal_model import OrderedModel

    if len(groups) < 2:
        raise StatisticsError("there is only one group")
    answers = np.concatenate(list(groups.values()))
    if not varies(answers):
        raise StatisticsError("everybody gave the same answer")
    codes, counts = np.unique(answers, return_inverse=True)[1], np.unique(answers, return_counts=True)[1]
    members = np.repeat(np.arange(len(groups)), [len(v) for v in groups.values()])
    dummies = (members[:, None] == np.arange(1, len(groups))).astype(float)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # whether it converged is asked below
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

    Args:
        values: One per person, (n,), none missing.
        assistance: Condition of each, (n,).
        objects: Number of objects of each, (n,); all the same is fine.
        houses: House of each, (n,).

    Raises:
        StatisticsError: There are too few houses, a cell is empty, or the fit fails.
    """
    count = len(np.unique(houses))
    if count < LEAST_HOUSES:
        raise StatisticsError(f"a mixed model needs at least {LEAST_HOUSES} houses; there are {count}")
    if not varies(values):
        raise StatisticsError("the values do not vary")
    blocks = _blocks(assistance, objects)
    # In units of their spread, so that small and large measures converge alike.
    spread = float(values.std())
    fit = _fit_mixed(values / spread, np.hstack(list(blocks.values())), houses)
    return MixedModel(
        _wald_tests(np.asarray(fit.fe_params), np.asarray(fit.cov_params()), blocks),
        float(np.asarray(fit.cov_re)[0, 0]) * spread**2,
        float(fit.scale) * spread**2,
        count,
    )


def _fit_mixed(values: Values, columns: Values, houses: NDArray[Any]) -> Any:
    from statsmodels.regression.mixed_linear_model import MixedLM

    for method in ("bfgs", "powell"):
        with warnings.catch_warnings(), np.errstate(all="ignore"):
            warnings.simplefilter("ignore")  # of a variance between houses of zero
            try:
                fit = MixedLM(values, columns, groups=houses).fit(method=method)
            except (np.linalg.LinAlgError, ValueError):
                continue
        # At the edge, some climbs end in an infinite likelihood.
        if fit.converged and np.isfinite(fit.llf):
            return fit
    raise StatisticsError("the mixed model does not converge")


def _blocks(assistance: NDArray[Any], objects: NDArray[Any]) -> dict[str, Values]:
    if len(np.unique(objects)) == 1:
        return {"constant": np.ones((len(assistance), 1)), "assistance": sum_coded(assistance)}
    blocks = Design.of(assistance, objects).blocks
    names = {"first": "assistance", "second": "objects", "both": "interaction"}
    return {names.get(name, name): columns for name, columns in blocks.items()}


def _wald_tests(parameters: Values, covariance: Values, blocks: Mapping[str, Values]) -> dict[str, Chi2Test]:
    tests, first = {}, 0
    for name, columns in blocks.items():
        here = slice(first, first + columns.shape[1])
        first = here.stop
        if name != "constant":
            b, v = parameters[here], covariance[here, here]
            statistic = float(b @ np.linalg.solve(v, b))
            tests[name] = Chi2Test(statistic, len(b), float(chi2.sf(statistic, len(b))))
    return tests
