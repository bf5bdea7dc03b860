"""Find types of participants that differ in how often they accept suggestions.

Acceptance is modelled as a mixture of beta-binomial distributions. Each participant has an acceptance rate,
which is drawn from the Beta distribution of their type, and accepts each suggested visit with that
probability. The number of types is selected by the Bayesian information criterion (BIC).
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize
from scipy.special import betaln, digamma, expit, logit

from experiments.errors import StatisticsError

MAX_KINDS = 3
MIN_PEOPLE = 10
PRECISIONS = (0.0, 7.0)  # bounds on log(a + b); at the upper bound, people of the same type hardly differ
STARTS = 10  # number of random starting points, in addition to those computed from the data

Counts = NDArray[np.int64]


@dataclass(frozen=True)
class Mixture:
    """A fitted mixture of k types of participants, sorted by descending mean acceptance rate.

    Attributes:
        precisions: Sum a + b of each Beta distribution's parameters, shape (k,). Participants of a type with a higher
            precision are more similar.
        bic: Bayesian information criterion. Smaller is better.
    """

    shares: tuple[float, ...]
    means: tuple[float, ...]
    precisions: tuple[float, ...]
    log_likelihood: float
    bic: float


def fit_mixtures(accepted: Counts, visits: Counts) -> list[Mixture]:
    """Fit mixtures of one, two and three types by maximum likelihood. Return them with the best BIC first.

    `accepted` and `visits`, shape (n,), count the accepted visits and all visits of each participant.

    Raises:
        StatisticsError: There are too few participants, or the counts are invalid.
    """
    if len(accepted) < MIN_PEOPLE:
        raise StatisticsError(f"a mixture needs at least {MIN_PEOPLE} people; there are {len(accepted)}")
    if (visits < 1).any() or (accepted < 0).any() or (accepted > visits).any():
        raise StatisticsError("a number of accepted visits is below 0 or above the number of visits")
    # Compute the likelihood only once for all participants with the same counts.
    cases, people = np.unique(np.stack([accepted, visits], axis=1), axis=0, return_counts=True)
    found: list[Mixture] = []
    for kinds in range(1, MAX_KINDS + 1):
        found.append(_fit(cases, people, kinds, found[-1] if found else None))
    return sorted(found, key=lambda m: m.bic)


def _fit(cases: Counts, people: Counts, kinds: int, fewer: Mixture | None) -> Mixture:
    bounds = [(-8.0, 8.0)] * (2 * kinds - 1) + [PRECISIONS] * kinds
    climbs = [
        minimize(_loss, first, (cases, people, kinds), jac=True, method="L-BFGS-B", bounds=bounds)
        for first in _starts(cases, people, kinds, fewer)
    ]
    best = min(climbs, key=lambda climb: float(climb.fun))
    weights, means, precisions = _parts(best.x, kinds)
    order = np.argsort(-means)
    likelihood = -float(best.fun)
    return Mixture(
        tuple(np.exp(weights)[order].tolist()),
        tuple(means[order].tolist()),
        tuple(precisions[order].tolist()),
        likelihood,
        (3 * kinds - 1) * math.log(int(people.sum())) - 2 * likelihood,
    )


def _starts(
    cases: Counts, people: Counts, kinds: int, fewer: Mixture | None
) -> Iterator[NDArray[np.float64]]:
    rng = np.random.default_rng(kinds)
    rates = np.sort(np.repeat(cases[:, 0] / cases[:, 1], people))
    spread = np.quantile(rates, (np.arange(kinds) + 0.5) / kinds).clip(0.02, 0.98)
    yield _start(np.ones(kinds), spread, np.full(kinds, math.exp(2.0)))
    if fewer is not None:
        for k in range(kinds - 1):
            parts = (np.array(v) for v in (fewer.shares, fewer.means, fewer.precisions))
            shares, means, precisions = (np.insert(v, k, v[k]) for v in parts)
            shares[k : k + 2] /= 2
            means[k : k + 2] = expit(logit(means[k]) + np.array([0.5, -0.5]))
            yield _start(shares, means, precisions)
    for _ in range(STARTS if kinds > 1 else 0):
        means = np.sort(rng.uniform(0.05, 0.95, kinds))
        for logs in (np.full(kinds, 2.0), rng.uniform(*PRECISIONS, kinds)):
            yield _start(np.ones(kinds), means, np.exp(logs))


def _start(
    shares: NDArray[np.float64], means: NDArray[np.float64], precisions: NDArray[np.float64]
) -> NDArray[np.float64]:
    weights = np.log(shares)
    return np.concatenate([weights[:-1] - weights[-1], logit(means), np.log(precisions)]).clip(-8.0, 8.0)


def _parts(
    parameters: NDArray[np.float64], kinds: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    weights = np.append(parameters[: kinds - 1], 0.0)
    means = expit(parameters[kinds - 1 : 2 * kinds - 1])
    return weights - np.logaddexp.reduce(weights), means, np.exp(parameters[2 * kinds - 1 :])


def _loss(
    parameters: NDArray[np.float64], cases: Counts, people: Counts, kinds: int
) -> tuple[float, NDArray[np.float64]]:
    weights, means, precisions = _parts(parameters, kinds)
    accepted, others = cases[:, :1], cases[:, 1:] - cases[:, :1]
    a, b = means * precisions, (1 - means) * precisions
    # The binomial coefficient is omitted because it does not depend on the mixture.
    each = betaln(accepted + a, others + b) - betaln(a, b) + weights
    everyone = np.logaddexp.reduce(each, axis=1)
    belonging = np.exp(each - everyone[:, None]) * people[:, None]
    total = digamma(a + b) - digamma(cases[:, 1:] + a + b)
    by_a = digamma(accepted + a) - digamma(a) + total
    by_b = digamma(others + b) - digamma(b) + total
    by_mean = (belonging * (by_a - by_b)).sum(axis=0) * precisions * means * (1 - means)
    by_precision = (belonging * (means * by_a + (1 - means) * by_b)).sum(axis=0) * precisions
    by_weight = belonging.sum(axis=0) - people.sum() * np.exp(weights)
    gradient = np.concatenate([by_weight[:-1], by_mean, by_precision])
    return -float((people * everyone).sum()), -gradient
