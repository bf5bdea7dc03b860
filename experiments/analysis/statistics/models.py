"""Proportional odds of ordinal answers, by statsmodels."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.stats import chi2

from experiments.analysis.statistics.anova import Values, varies
from experiments.errors import StatisticsError


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
