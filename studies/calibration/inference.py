"""Which free parameters go with the published rows at 6 objects: approximate Bayesian computation by rejection.

Parameters are drawn from their priors. For each draw, the surrogate gives means and variances of the cells, and from
these come effect sizes of the population and one study of the published size, with its chance. Draws whose study is
nearest to the published one are kept (Beaumont 2010, doi:10.1146/annurev-ecolsys-102209-144621). No row over several
numbers of objects is looked at.
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
Cells = Mapping[str, Surrogate]  # condition -> surrogate of the measures

OBJECTS = 6  # the only rows that may be fitted
PEOPLE = 128  # simulated by the surrogate for each draw
KEPT = 0.01  # share of the draws
NORMAL_95 = 1.645


@dataclass(frozen=True, eq=False)
class Rows:
    """The published rows that are fitted.

    Attributes:
        tests: F tests of assistance.
        directions: Orders of two conditions.
        sizes: People by condition.
        varies_most: Measure and condition of the variance order.
    """

    tests: Sequence[PublishedTest]
    directions: Sequence[Direction]
    sizes: Mapping[str, int]
    varies_most: tuple[str, str]

    @classmethod
    def of(cls, published: Published) -> "Rows":
        """Those at 6 objects, without answers of people."""
        sizes = {c: n for (c, objects), n in published.people.sizes().items() if objects == OBJECTS}
        tests = [t for t in published.tests if t.objects == OBJECTS and not t.measure.startswith("likert_")]
        directions = [
            d for d in published.directions if d.objects == OBJECTS and not d.measure.startswith("likert_")
        ]
        return cls(tests, directions, sizes, (published.variances.measure, published.variances.largest))

    @property
    def people(self) -> int:
        """In all cells."""
        return sum(self.sizes.values())

    def measures(self) -> list[str]:
        """Short names of the measures."""
        return [test.measure for test in self.tests]

    def orders(self) -> list[str]:
        """The orders in words: of two conditions each, then of variances."""
        measure, condition = self.varies_most
        return [
            *(f"{d.measure}: {d.label()}" for d in self.directions),
            f"{measure} vary most under {condition}",
        ]


@dataclass(frozen=True, eq=False)
class Outcome:
    """What studies of one size find, for n draws: means and variances of cells.

    Attributes:
        means: (n, measures, conditions).
        variances: (n, measures, conditions).
    """

    means: Values
    variances: Values

    def with_chance(self, sizes: Values, rng: np.random.Generator) -> "Outcome":
        """Means and variances of samples of these sizes, (conditions,); normal theory."""
        means = self.means + np.sqrt(self.variances / sizes) * rng.standard_normal(self.means.shape)
        return Outcome(means, self.variances * rng.chisquare(sizes - 1, self.variances.shape) / (sizes - 1))


@dataclass(frozen=True, eq=False)
class Fit:
    """Draws, and how near their studies are.

    Attributes:
        draws: Values of the free parameters, (n, parameters).
        outcome: Their populations.
        eta_squared: Partial eta squared of assistance in the populations, (n, tests).
        distance: From the published study, of a study with chance, (n,).
        population_distance: Of the population, without chance, (n,).
        kept: Numbers of the draws that are kept, the nearest first.
        best: Number of the draw whose population is nearest.
    """

    draws: Values
    outcome: Outcome
    eta_squared: Values
    distance: Values
    population_distance: Values
    kept: NDArray[np.int64]
    best: int

    def contraction(self) -> Values:
        """By how much knowing the rows narrows each parameter: 1 - variance after / variance before, (parameters,)."""
        return np.asarray(1.0 - self.draws[self.kept].var(axis=0) / self.draws.var(axis=0))

    def sensitivity(self) -> Values:
        """Rank correlation of each parameter with each effect size, over the priors, (parameters, tests)."""
        return _rank_correlation(self.draws, self.eta_squared)

    def trade_offs(self) -> Values:
        """Rank correlation of the parameters with each other among the kept draws, (parameters, parameters)."""
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
    """Draw, compare, keep.

    Args:
        free: What is fitted.
        cells: Surrogates; their inputs are those of `free.inputs()`, their measures those of the rows.
        rows: The published rows.
        draws: How many.
        seed: Of all chance.
        on_progress: Called with how many draws are done.
    """
    rng = np.random.default_rng(seed)
    values = free.draw(draws, rng)
    shares = stratified_shares(PEOPLE, len(free.inputs()), rng)
    moments = []
    for k, draw in enumerate(values):
        people = free.people(draw, shares)
        moments.append([cells[condition].moments(people) for condition in rows.sizes])
        on_progress(k + 1)
    found = np.array(moments).transpose(2, 0, 3, 1)  # mean or variance, draw, measure, condition
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
    """Partial eta squared of populations at these numbers of people, (n, measures)."""
    noncentrality = _between(outcome, sizes) / _within(outcome, sizes)
    return np.asarray(noncentrality / (noncentrality + sizes.sum()))


def sample_effects(study: Outcome, sizes: Values) -> Values:
    """Partial eta squared of samples, (n, measures)."""
    between = _between(study, sizes)
    return np.asarray(between / (between + _within(study, sizes) * (sizes.sum() - len(sizes))))


def _between(outcome: Outcome, sizes: Values) -> Values:
    grand = (outcome.means @ sizes / sizes.sum())[..., None]
    return np.asarray((outcome.means - grand) ** 2 @ sizes)


def _within(outcome: Outcome, sizes: Values) -> Values:
    return np.asarray(outcome.variances @ (sizes - 1) / (sizes.sum() - len(sizes)))


def _distance(effects: Values, outcome: Outcome, rows: Rows, target: Values) -> Values:
    """Root of the sum of squared differences of effect sizes, in standard errors; a wrong order counts as one."""
    errors = (_angle(effects) - _angle(target)) / _standard_errors(rows)
    return np.asarray(np.sqrt((errors**2).sum(axis=1) + missed_orders(outcome, rows).sum(axis=1)))


def missed_orders(outcome: Outcome, rows: Rows) -> NDArray[np.bool_]:
    """Which of the published orders studies of these means and variances miss, (n, orders), as `Rows.orders`."""
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
    """On this scale, chance is about as large for large effects as for small ones."""
    return np.arcsin(np.sqrt(eta_squared))


def _intervals(rows: Rows) -> Values:
    return np.array([test.interval(rows.people) for test in rows.tests], float)


def _standard_errors(rows: Rows) -> Values:
    low, high = _intervals(rows).T
    return np.asarray((_angle(high) - _angle(low)) / (2 * NORMAL_95))


def _printed(rows: Rows) -> Values:
    """Effect sizes of the published study."""
    tests = [test.test(rows.people) for test in rows.tests]
    return np.array([test.eta_squared for test in tests if test is not None])


def _middle(rows: Rows) -> Values:
    """What the published effect sizes are most likely to be in the population: the middle of their intervals."""
    low, high = _intervals(rows).T
    return np.asarray(np.sin((_angle(low) + _angle(high)) / 2) ** 2)


def _rank_correlation(one: Values, other: Values) -> Values:
    """Spearman's, of every column of one with every column of the other."""
    first, second = (rankdata(x, axis=0) for x in (one, other))
    first, second = (x - x.mean(axis=0) for x in (first, second))
    return np.asarray(first.T @ second / np.sqrt(np.outer((first**2).sum(axis=0), (second**2).sum(axis=0))))
