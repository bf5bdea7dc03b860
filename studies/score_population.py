"""Effect sizes of a population of which a pool is known: what a study without chance would find."""

from collections.abc import Mapping

import numpy as np

from experiments.analysis.statistics.anova import Values, two_way_squares
from experiments.errors import StatisticsError
from experiments.study.table import StudyTable
from studies.published import Published, PublishedTest

Cells = Mapping[tuple[str, int], Values]


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
    noncentrality = max(_squares(cells, sizes, test) / variance - chance, 0.0)
    return noncentrality / (noncentrality + people)


def _squares(cells: Cells, sizes: Mapping[tuple[str, int], int], test: PublishedTest) -> float:
    """Sum of squares of the effect if each person were as the mean of the cell."""
    counts = [sizes[cell] for cell in cells]
    means = np.repeat([float(v.mean()) for v in cells.values()], counts)
    if test.objects is not None:
        return float(((means - means.mean()) ** 2).sum())
    first = np.repeat([condition for condition, _ in cells], counts)
    second = np.repeat([objects for _, objects in cells], counts)
    return two_way_squares(means, first, second)[test.effect]
