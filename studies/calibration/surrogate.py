"""A surrogate of trials: what a person's values make of the measures, learnt from simulated people of one cell.

The expectation is a quadratic function of the values, each as the share of the pool that lies below it; the logarithm
of the variance around it is a linear one. Slopes are shrunk (ridge regression), those of the expectation as generalised
cross-validation says.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.errors import StatisticsError

Values = NDArray[np.float64]
PENALTIES = np.logspace(-3, 4, 29)
FEWEST = 30  # people from whom anything can be learnt
ITERATIONS, STEP = 200, 0.2  # of the fit of variances
SLOPE_PENALTY = 2.0
SMALLEST = 1e-4  # of the variance of the pool: no outcome is more certain


@dataclass(frozen=True, eq=False)
class Surrogate:
    """The measures in one cell.

    Attributes:
        knots: Sorted values of the pool, (n, inputs).
        mean: Coefficients of the expectations, (quadratic terms, measures).
        log_variance: Coefficients of the logarithms of the variances around them, (linear terms, measures).
        left_out_r2: Share of the variance that is predicted of people left out of the fit, (measures,).
    """

    knots: Values
    mean: Values
    log_variance: Values
    left_out_r2: Values

    @property
    def people(self) -> int:
        """How many people it was learnt from."""
        return len(self.knots)

    def moments(self, people: Values) -> tuple[Values, Values]:
        """Means and variances of the measures over people, (n, inputs): (measures,) each."""
        shares = _shares(self.knots, people)
        expected, left = _quadratic(shares) @ self.mean, np.exp(_linear(shares) @ self.log_variance)
        return expected.mean(axis=0), expected.var(axis=0) + left.mean(axis=0)


def learn(people: Values, outcomes: Values) -> Surrogate:
    """Learn the measures from people of one cell.

    Args:
        people: Their values, (n, inputs).
        outcomes: Their measures, (n, measures).

    Raises:
        StatisticsError: There are too few people, or a measure does not vary.
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
    """Coefficients of the logarithm of the expectation of squares, by gamma regression with shrunk slopes.

    The likelihood is that of a normal distribution whose variance differs from person to person.

    Args:
        terms: The first one is 1, (n, terms).
        squares: All positive, (n,).

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
    """Regression with shrunk coefficients, but for the first term.

    Args:
        terms: The first one is 1, (n, terms).
        outcome: (n,).

    Returns:
        The coefficients, and what is left of each outcome where it is not used itself, (n,).

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
    """For each value, the share of the pool that is not above it, (n, inputs)."""
    found = [np.searchsorted(k, v, side="right") for k, v in zip(knots.T, people.T, strict=True)]
    return np.array(found).T / len(knots)


def _linear(shares: Values) -> Values:
    return np.column_stack([np.ones(len(shares)), shares])


def _quadratic(shares: Values) -> Values:
    first, second = np.triu_indices(shares.shape[1])
    return np.column_stack([_linear(shares), shares[:, first] * shares[:, second]])
