"""How often the interval of the people that a study needs holds the number that it does need."""

import numpy as np
import pytest

from experiments.analysis.planning.power import Wanted, _interval
from experiments.analysis.statistics.effects import people_per_cell
from experiments.errors import StatisticsError

CELLS = [(name, n) for name in ("none", "optimal") for n in (6, 12, 24)]


def normal(rng, people):
    return rng.normal(size=people)


def skewed(rng, people):
    return rng.gamma(2.0, np.sqrt(0.5), people)


@pytest.mark.slow
@pytest.mark.long
@pytest.mark.parametrize(("people", "slope", "draw"), [(30, 0.8, normal), (200, 0.4, skewed)])
def test_the_interval_of_people_needed_holds_their_number_in_nine_studies_of_ten(people, slope, draw):
    """Of people whose mean rises by `slope` standard deviations from 6 objects to 24."""
    means = {cell: slope * (cell[1] - 6) / 18 for cell in CELLS}
    ratio = np.var(list(means.values()))
    needed = people_per_cell(ratio / (1 + ratio), 2, len(CELLS))
    inside = []
    for seed in range(200):
        rng = np.random.default_rng(seed)
        pool = {cell: mean + draw(rng, people) for cell, mean in means.items()}
        try:
            low, high = _interval(pool, Wanted("x", "objects"), rng)
        except StatisticsError:  # it may be any number
            low, high = 0, np.inf
        inside.append(low <= needed <= high)
    assert np.mean(inside) == pytest.approx(0.9, abs=0.06)
