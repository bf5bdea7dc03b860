"""Fit the free parameters to the published results at 6 objects by approximate Bayesian computation.

Parameters are drawn from their priors. For each draw, the surrogate models predict the means and variances of
the cells. These give the effect sizes in the population, and those of one random study of the published size.
The draws whose study is nearest to the published study are kept (Beaumont 2010,
doi:10.1146/annurev-ecolsys-102209-144621). Results that combine several numbers of objects are not used.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.stats import rankdata

from experiments.analysis.statistics.pairs import tukey_quantile
from studies.calibration.population import FreeParameters, stratified_shares
from studies.calibration.surrogate import Surrogate
from studies.published import Direction, Published, PublishedTest

Values = NDArray[np.float64]
Cells = Mapping[str, Surrogate]  # surrogate models of the measures, by condition

OBJECTS = 6  # the number of objects in the results that may be fitted
PEOPLE = 128  # number of participants that the surrogate model simulates for each draw
KEPT = 0.01  # share of the draws that are kept
NORMAL_95 = 1.645


@dataclass(frozen=True, eq=False)
class Rows:
    """The published results that are fitted.

    Attributes:
        tests: F tests of assistance.
        directions: Published orders of two conditions.
        sizes: Number of participants by condition.
        varies_most: A measure, and the condition in which it varies most.
    """

    tests: Sequence[PublishedTest]
    directions: Sequence[Direction]
    sizes: Mapping[str, int]
    varies_most: tuple[str, str]

    @classmethod
    def of(cls, published: Published) -> "Rows":
        """Select the published results at 6 objects, except those about survey answers."""
        sizes = {c: n for (c, objects), n in published.people.sizes().items() if objects == OBJECTS}
        tests = [t for t in published.tests if t.objects == OBJECTS and not t.measure.startswith("likert_")]
        directions = [
            d for d in published.directions if d.objects == OBJECTS and not d.measure.startswith("likert_")
        ]
        return cls(tests, directions, sizes, (published.variances.measure, published.variances.largest))

    @property
    def people(self) -> int:
        """The total number of participants."""
        return sum(self.sizes.values())

    def measures(self) -> list[str]:
        """Return the short names of the measures."""
        return [test.measure for test in self.tests]

    def orders(self) -> list[str]:
        """Describe in words the published orders of means, then the published order of variances."""
        measure, condition = self.varies_most
        return [
            *(f"{d.measure}: {d.label()}" for d in self.directions),
            f"{measure} vary most under {condition}",
        ]


@dataclass(frozen=True, eq=False)
class Outcome:
    """Means and variances of the cells, for n draws of the parameters.

    Attributes:
        means: Means, shape (n, measures, conditions).
        variances: Variances, shape (n, measures, conditions).
    """

    means: Values
    variances: Values

    def with_chance(self, sizes: Values, rng: np.random.Generator) -> "Outcome":
        """Return means and variances of random samples of these sizes, (conditions,), by normal theory."""
        means = self.means + np.sqrt(self.variances / sizes) * rng.standard_normal(self.means.shape)
        return Outcome(means, self.variances * rng.chisquare(sizes - 1, self.variances.shape) / (sizes - 1))


@dataclass(frozen=True, eq=False)
class Fit:
    """All draws of the parameters, and their distances from the published study.

    Attributes:
        draws: Values of the free parameters, (n, parameters).
        outcome: Means and variances in the population of each draw.
        eta_squared: Partial eta squared of assistance in the populations, (n, tests).
        distance: Distance of a random study of each population from the published study, (n,).
        population_distance: Distance of each population from the published study, (n,).
        kept: Indices of the kept draws, the nearest first.
        best: Index of the draw whose population is nearest.
    """

    draws: Values
    outcome: Outcome
    eta_squared: Values
    distance: Values
    population_distance: Values
    kept: NDArray[np.int64]
    best: int

    def contraction(self) -> Values:
        """Return the relative reduction of each parameter's variance by the fit, (parameters,)."""
        return np.asarray(1.0 - self.draws[self.kept].var(axis=0) / self.draws.var(axis=0))

    def sensitivity(self) -> Values:
        """Return rank correlations between parameters and effect sizes, (parameters, tests)."""
        return _rank_correlation(self.draws, self.eta_squared)

    def trade_offs(self) -> Values:
        """Return the rank correlations between parameters among the kept draws, (parameters, parameters)."""
        return _rank_correlation(self.draws[self.kept], self.draws[self.kept])


def fit(
    free: FreeParameters,
    cells: Cells,
    rows: Rows,
    *,
    draws: int,
    seed: int,
    on_progress: Callable[[int], None] = lambda _: None,
) -> Fit:
    """Draw parameters from their priors and keep the draws that best reproduce the published study.

    Args:
        free: The parameters to fit.
        cells: Surrogate models with the inputs of `free.inputs()` and the measures of `rows`, by condition.
        rows: The published results.
        draws: Number of draws.
        seed: Seed of the random number generator.
        on_progress: Called with the number of finished draws.
    """
    rng = np.random.default_rng(seed)
    values = free.draw(draws, rng)
    shares = stratified_shares(PEOPLE, len(free.inputs()), rng)
    moments = []
    for k, draw in enumerate(values):
        people = free.people(draw, shares)
        moments.append([cells[condition].moments(people) for condition in rows.sizes])
        on_progress(k + 1)
    found = np.array(moments).transpose(2, 0, 3, 1)  # axes: mean or variance, draw, measure, condition
    outcome = Outcome(found[0], found[1])
    sizes = np.array(list(rows.sizes.values()), float)
    study = outcome.with_chance(sizes, rng)
    eta_squared = population_effects(outcome, sizes)
    distance = _distance(sample_effects(study, sizes), study, rows, _printed(rows))
    population_distance = _distance(eta_squared, outcome, rows, _middle(rows))
    kept = np.argsort(distance, kind="stable")[: max(1, round(KEPT * draws))]
    best = int(np.argmin(population_distance))
    return Fit(values, outcome, eta_squared, distance, population_distance, kept, best)


def population_effects(outcome: Outcome, sizes: Values) -> Values:
    """Return partial eta squared in populations, for the given numbers of participants, as (n, measures)."""
    noncentrality = _between(outcome, sizes) / _within(outcome, sizes)
    return np.asarray(noncentrality / (noncentrality + sizes.sum()))


def sample_effects(study: Outcome, sizes: Values) -> Values:
    """Return partial eta squared in samples, as (n, measures)."""
    between = _between(study, sizes)
    return np.asarray(between / (between + _within(study, sizes) * (sizes.sum() - len(sizes))))


def _between(outcome: Outcome, sizes: Values) -> Values:
    grand = (outcome.means @ sizes / sizes.sum())[..., None]
    return np.asarray((outcome.means - grand) ** 2 @ sizes)


def _within(outcome: Outcome, sizes: Values) -> Values:
    return np.asarray(outcome.variances @ (sizes - 1) / (sizes.sum() - len(sizes)))


def _distance(effects: Values, outcome: Outcome, rows: Rows, target: Values) -> Values:
    """Return the root of the summed squared errors in standard errors. A missed order adds an error of 1."""
    errors = (_angle(effects) - _angle(target)) / _standard_errors(rows)
    return np.asarray(np.sqrt((errors**2).sum(axis=1) + missed_orders(outcome, rows).sum(axis=1)))


def missed_orders(outcome: Outcome, rows: Rows) -> NDArray[np.bool_]:
    """Return which of the published orders (`Rows.orders`) each study fails to reproduce, as (n, orders)."""
    names, sizes = list(rows.sizes), np.array(list(rows.sizes.values()), float)
    measures, within = rows.measures(), _within(outcome, sizes)
    quantile, missed = tukey_quantile(len(sizes), sizes.sum() - len(sizes)), []
    for direction in rows.directions:
        one, other = (names.index(name) for name in direction.pair or direction.same or ())
        m = measures.index(direction.measure)
        gap = outcome.means[:, m, other] - outcome.means[:, m, one]
        error = quantile * np.sqrt(within[:, m] * (1 / sizes[one] + 1 / sizes[other]))
        missed.append((np.abs(gap) > error) if direction.same else (gap <= error))
    measure, condition = rows.varies_most
    largest = outcome.variances[:, measures.index(measure)].argmax(axis=1)
    return np.column_stack([*missed, largest != names.index(condition)])


def _angle(eta_squared: Values) -> Values:
    """Transform effect sizes so that their sampling error hardly depends on their size."""
    return np.arcsin(np.sqrt(eta_squared))


def _intervals(rows: Rows) -> Values:
    return np.array([test.interval(rows.people) for test in rows.tests], float)


def _standard_errors(rows: Rows) -> Values:
    low, high = _intervals(rows).T
    return np.asarray((_angle(high) - _angle(low)) / (2 * NORMAL_95))


def _printed(rows: Rows) -> Values:
    """Return the effect sizes in the published study."""
    tests = [test.test(rows.people) for test in rows.tests]
    return np.array([test.eta_squared for test in tests if test is not None])


def _middle(rows: Rows) -> Values:
    """Estimate the published effect sizes in the population by the middle of their confidence intervals."""
    low, high = _intervals(rows).T
    return np.asarray(np.sin((_angle(low) + _angle(high)) / 2) ** 2)


def _rank_correlation(one: Values, other: Values) -> Values:
    """Return Spearman's rank correlations of all columns of one array with all columns of the other."""
    first, second = (rankdata(x, axis=0) for x in (one, other))
    first, second = (x - x.mean(axis=0) for x in (first, second))
    return np.asarray(first.T @ second / np.sqrt(np.outer((first**2).sum(axis=0), (second**2).sum(axis=0))))
