"""A surrogate model that predicts the measures of a trial from the parameters of the simulated participant.

Each parameter is first converted to the share of the pool with smaller values. The expectation of a measure
is a quadratic function of these shares, and the logarithm of its variance is a linear function. Both are
fitted by ridge regression. Generalized cross-validation selects the penalty for the expectation.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.errors import StatisticsError

Values = NDArray[np.float64]
PENALTIES = np.logspace(-3, 4, 29)
FEWEST = 30  # minimum number of participants for learning a surrogate model
ITERATIONS, STEP = 200, 0.2  # number and size of the steps that fit the variances
SLOPE_PENALTY = 2.0
SMALLEST = 1e-4  # smallest variance of an outcome, as a share of the variance in the pool


@dataclass(frozen=True, eq=False)
class Surrogate:
    """A surrogate model of the measures in one cell.

    Attributes:
        knots: Sorted parameter values of the pool, (n, inputs).
        mean: Coefficients of the expectations, (quadratic terms, measures).
        log_variance: Coefficients of the logarithms of the variances around them, (linear terms, measures).
        left_out_r2: Share of the variance explained in leave-one-out cross-validation, (measures,).
    """

    knots: Values
    mean: Values
    log_variance: Values
    left_out_r2: Values

    @property
    def people(self) -> int:
        """The number of participants from which the model was learned."""
        return len(self.knots)

    def moments(self, people: Values) -> tuple[Values, Values]:
        """Return means and variances of the measures, (measures,) each, over participants (n, inputs)."""
        shares = _shares(self.knots, people)
        expected, left = _quadratic(shares) @ self.mean, np.exp(_linear(shares) @ self.log_variance)
        return expected.mean(axis=0), expected.var(axis=0) + left.mean(axis=0)


def learn(people: Values, outcomes: Values) -> Surrogate:
    """Learn a surrogate model from the simulated participants in one cell.

    Args:
        people: Parameters of the participants, (n, inputs).
        outcomes: Measures of the participants, (n, measures).

    Raises:
        StatisticsError: There are too few participants, or a measure does not vary.
    """
    if len(outcomes) < FEWEST:
        raise StatisticsError(f"{len(outcomes)} people are too few to learn from; {FEWEST} are needed")
    if not outcomes.var(axis=0).min() > 0:
        raise StatisticsError("a measure does not vary")
    knots = np.sort(people, axis=0)
    shares = _shares(knots, people)
    parts = [_learn_one(shares, outcome) for outcome in outcomes.T]
    mean, log_variance, left_out_r2 = (np.array(part).T for part in zip(*parts, strict=True))
    return Surrogate(knots, mean, log_variance, left_out_r2)


def _learn_one(shares: Values, outcome: Values) -> tuple[Values, Values, float]:
    mean, left_out = ridge(_quadratic(shares), outcome)
    squares = np.maximum(left_out**2, SMALLEST * outcome.var())
    return mean, log_linear(_linear(shares), squares), float(1.0 - np.mean(left_out**2) / outcome.var())


def log_linear(terms: Values, squares: Values) -> Values:
    """Fit the logarithm of the expected squares by gamma regression with a ridge penalty.

    This assumes a normal distribution whose variance differs between participants.

    Args:
        terms: Predictors, of which the first one is constantly 1, (n, terms).
        squares: Positive squared errors, (n,).

    Source: McCullagh and Nelder 1989, Generalized Linear Models, chapter 8.
    """
    penalty = np.diag([0.0] + [SLOPE_PENALTY] * (terms.shape[1] - 1))
    normal, found = terms.T @ terms + penalty, np.zeros(terms.shape[1])
    found[0] = np.log(squares.mean())
    for _ in range(ITERATIONS):
        surprise = squares / np.exp(terms @ found) - 1.0
        found = found + STEP * np.linalg.solve(normal, terms.T @ surprise - penalty @ found)
    return found


def ridge(terms: Values, outcome: Values) -> tuple[Values, Values]:
    """Fit a ridge regression in which the first term, the intercept, has no penalty.

    Args:
        terms: Predictors, of which the first one is constantly 1, (n, terms).
        outcome: Dependent variable, (n,).

    Returns:
        The coefficients, and the leave-one-out residuals, (n,).

    Source: Golub, Heath and Wahba 1979, doi:10.1080/00401706.1979.10489751.
    """
    centre, level = terms[:, 1:].mean(axis=0), outcome.mean()
    left, spectrum, right = np.linalg.svd(terms[:, 1:] - centre, full_matrices=False)
    projected, best = left.T @ (outcome - level), (np.inf, np.zeros(0), np.zeros(0))
    for penalty in PENALTIES:
        kept = spectrum**2 / (spectrum**2 + penalty)
        residual = outcome - level - left @ (kept * projected)
        freedom = 1.0 - (1.0 + kept.sum()) / len(outcome)
        if freedom > 0 and (loss := float((residual**2).mean()) / freedom**2) < best[0]:
            leverage = 1.0 / len(outcome) + (left**2) @ kept
            coefficients = right.T @ (kept / np.maximum(spectrum, 1e-12) * projected)
            best = loss, coefficients, residual / (1.0 - leverage)
    slopes = best[1]
    return np.concatenate([[level - centre @ slopes], slopes]), best[2]


def _shares(knots: Values, people: Values) -> Values:
    """Convert each parameter value to the share of the pool that is not above it, (n, inputs)."""
    found = [np.searchsorted(k, v, side="right") for k, v in zip(knots.T, people.T, strict=True)]
    return np.array(found).T / len(knots)


def _linear(shares: Values) -> Values:
    return np.column_stack([np.ones(len(shares)), shares])


def _quadratic(shares: Values) -> Values:
    first, second = np.triu_indices(shares.shape[1])
    return np.column_stack([_linear(shares), shares[:, first] * shares[:, second]])
