"""Effect sizes in a population, estimated from a pool of many participants."""

from collections.abc import Iterator, Mapping

import numpy as np

from experiments.analysis.statistics.anova import two_way_squares
from experiments.analysis.study.table import StudyTable
from experiments.errors import StatisticsError
from studies.published import Published, PublishedTest

Cell = tuple[str, int]
REPLICATES = 200  # number of random studies drawn from a pool


def population_eta_squared(pool: StudyTable, published: Published, test: PublishedTest) -> float:
    """Return partial eta squared in the population, at the published numbers of participants.

    The noncentrality L of the published test is computed as if each participant had the mean of their cell in
    the pool. The expected contribution of sampling error to these means is subtracted. Eta squared is L / (L
    + participants), as in its confidence intervals.

    Raises:
        StatisticsError: A cell has fewer than two values of the measure, or the measure does not vary.
    """
    sizes = {c: n for c, n in published.people.sizes().items() if test.objects in (None, c[1])}
    cells = (
        {cell: pool.groups(test.measure, cell[1]).get(cell[0], np.zeros(0)) for cell in sizes}
        if (test.measure in pool.columns)
        else {}
    )
    if not cells or min(map(len, cells.values())) < 2:
        raise StatisticsError(f"{test.measure} is not known in every cell")
    people = sum(sizes.values())
    variance = sum((sizes[c] - 1) * float(v.var(ddof=1)) for c, v in cells.items()) / (people - len(cells))
    if variance <= 0.0:
        raise StatisticsError(f"{test.measure} does not vary within any cell")
    chance = test.df[0] * people / sum(map(len, cells.values()))
    noncentrality = max(
        effect_squares({c: float(v.mean()) for c, v in cells.items()}, sizes, test) / variance - chance, 0.0
    )
    return noncentrality / (noncentrality + people)


def effect_squares(means: Mapping[Cell, float], sizes: Mapping[Cell, int], test: PublishedTest) -> float:
    """Return the sum of squares of an effect if every participant had the mean of their cell."""
    counts = [sizes[cell] for cell in means]
    values = np.repeat(list(means.values()), counts)
    if test.objects is not None:
        return float(((values - values.mean()) ** 2).sum())
    first = np.repeat([condition for condition, _ in means], counts)
    second = np.repeat([objects for _, objects in means], counts)
    return two_way_squares(values, first, second)[test.effect]


def draw(pool: StudyTable, published: Published, seed: int, count: int = REPLICATES) -> Iterator[StudyTable]:
    """Yield random studies of the published size, drawn from the cells of a pool with replacement."""
    rng = np.random.default_rng(seed)
    cells = [
        (np.flatnonzero((pool.assistance == condition) & (pool.objects == objects)), size)
        for (condition, objects), size in published.people.sizes().items()
    ]
    for _ in range(count):
        yield pool.take(np.concatenate([rng.choice(people, size) for people, size in cells]))
