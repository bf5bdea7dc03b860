"""Effect sizes of a population of which a pool is known: what a study without chance would find."""

from collections.abc import Iterator, Mapping

import numpy as np

from experiments.analysis.statistics.anova import two_way_squares
from experiments.analysis.study.table import StudyTable
from experiments.errors import StatisticsError
from studies.published import Published, PublishedTest

Cell = tuple[str, int]
REPLICATES = 200  # studies drawn from a pool


def population_eta_squared(pool: StudyTable, published: Published, test: PublishedTest) -> float:
    """Partial eta squared in the population, at the published numbers of people.

    The means of the pool's cells replace each person of a cell, which gives the noncentrality L of the published test;
    what the means of a pool differ by chance is taken off. Eta squared is L / (L + people), as in its confidence
    intervals.

    Raises:
        StatisticsError: The measure is not known in every cell, or does not vary.
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
    """Sum of squares of the effect if each person were as the mean of the cell."""
    counts = [sizes[cell] for cell in means]
    values = np.repeat(list(means.values()), counts)
    if test.objects is not None:
        return float(((values - values.mean()) ** 2).sum())
    first = np.repeat([condition for condition, _ in means], counts)
    second = np.repeat([objects for _, objects in means], counts)
    return two_way_squares(values, first, second)[test.effect]


def draw(pool: StudyTable, published: Published, seed: int, count: int = REPLICATES) -> Iterator[StudyTable]:
    """Studies of the published size: people drawn from the same cell of a pool, with replacement."""
    rng = np.random.default_rng(seed)
    cells = [
        (np.flatnonzero((pool.assistance == condition) & (pool.objects == objects)), size)
        for (condition, objects), size in published.people.sizes().items()
    ]
    for _ in range(count):
        yield pool.take(np.concatenate([rng.choice(people, size) for people, size in cells]))
