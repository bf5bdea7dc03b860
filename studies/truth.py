"""Random studies from a population that has the published effects, as a reference for scores.

Values are normally distributed with the published order of means, and effects are as published but without
bias.
"""

from collections.abc import Iterator, Mapping
from dataclasses import replace

import numpy as np
from scipy.optimize import least_squares

from experiments.analysis.statistics.anova import Values
from experiments.analysis.study.table import StudyTable
from studies.published import Published, PublishedTest
from studies.score_population import effect_squares

Cell = tuple[str, int]
# Relative means by condition, with the published order and distances.
STEPS: Mapping[str, Mapping[str, float]] = {
    "deviations": {"none": 0.6, "highlight": 0.4, "optimal": -1.0},
    "ipl": {"none": -0.9, "highlight": -0.1, "optimal": 1.0},
    "distance": {"none": 1.0, "highlight": -0.4, "optimal": -0.6},
    "time": {"none": 1.0, "highlight": 0.0, "optimal": -1.0},
}
SPREADS = {
    "none": 1.0,
    "highlight": 1.0,
    "optimal": 1.4,
}  # standard deviations of the measure that varies most under `optimal`


def true_studies(pattern: StudyTable, published: Published, seed: int, count: int) -> Iterator[StudyTable]:
    """Yield random studies of the published size from this population, as tables like `pattern`."""
    rng = np.random.default_rng(seed)
    sizes = published.people.sizes()
    cells = [cell for cell, size in sizes.items() for _ in range(size)]
    people = {name: _population(published, name) for name in STEPS}
    centers = {name: np.array([p[cell][0] for cell in cells]) for name, p in people.items()}
    spreads = {name: np.array([p[cell][1] for cell in cells]) for name, p in people.items()}
    for _ in range(count):
        columns = {name: rng.normal(centers[name], spreads[name]) for name in STEPS}
        yield replace(
            pattern,
            rows=[{}] * len(cells),
            assistance=np.array([condition for condition, _ in cells]),
            objects=np.array([objects for _, objects in cells]),
            houses=np.zeros(len(cells), int),
            columns=columns,
        )


def _population(published: Published, measure: str) -> dict[Cell, tuple[float, float]]:
    """Return the mean and standard deviation of a measure in each cell."""
    tests = [t for t in published.tests if t.measure == measure]
    wanted = [_noncentrality(t) for t in tests]

    def misses(parameters: Values) -> list[float]:
        cells = _cells(published, measure, parameters)
        return [np.sqrt(_found(cells, published, t)) - np.sqrt(w) for t, w in zip(tests, wanted, strict=True)]

    first = np.array(
        [0.5, 0.5 if any(t.effect == "objects" and t.statistic for t in tests) else 0.0, 0.1, 0.0]
    )
    return _cells(published, measure, least_squares(misses, first).x)


def _noncentrality(test: PublishedTest) -> float:
    """Return an unbiased estimate of the noncentrality, or 0 if F is not printed."""
    df1, df2 = test.df
    return max((test.statistic or 0.0) * df1 * (df2 - 2) / df2 - df1, 0.0)


def _cells(published: Published, measure: str, parameters: Values) -> dict[Cell, tuple[float, float]]:
    """Return means and standard deviations by effect sizes and the logarithm of the spread at 6 objects."""
    assistance, objects, both, tightness = parameters
    spreads = SPREADS if measure == published.variances.measure else dict.fromkeys(SPREADS, 1.0)
    found = {}
    for condition, number in published.people.sizes():
        level, step = (number - 15) / 9, STEPS[measure][condition]
        mean = assistance * step + objects * level + both * step * level
        spread = spreads[condition] * (np.exp(tightness) if number == 6 else 1.0)
        found[condition, number] = (float(mean), float(spread))
    return found


def _found(cells: Mapping[Cell, tuple[float, float]], published: Published, test: PublishedTest) -> float:
    sizes = {c: n for c, n in published.people.sizes().items() if test.objects in (None, c[1])}
    variance = sum((n - 1) * cells[c][1] ** 2 for c, n in sizes.items()) / test.df[1]
    return effect_squares({c: cells[c][0] for c in sizes}, sizes, test) / variance
