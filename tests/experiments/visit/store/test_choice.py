"""The rule that chooses a cell, over whole studies in which people drop out."""

import heapq

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.visit.store.assignments import choose

CELLS, PEOPLE = 12, 447
HOUR = 60.0  # min


@given(st.data(), st.sampled_from(["uniform", "balanced"]), st.integers(0, 2**32))
def test_a_cell_that_is_full_is_never_chosen(data, rule, seed):
    quotas = data.draw(st.lists(st.integers(0, 5), min_size=1, max_size=6))
    counts = [data.draw(st.integers(0, quota + 1)) for quota in quotas]
    cell = choose(counts, quotas, rule, np.random.default_rng(seed))
    room = [index for index in range(len(quotas)) if counts[index] < quotas[index]]
    assert (cell in room) if room else cell is None
    if rule == "balanced" and room:
        assert all(counts[cell] / quotas[cell] <= counts[index] / quotas[index] for index in room)


def test_ties_are_broken_at_random():
    rng = np.random.default_rng(0)
    chosen = [choose([1, 0, 0, 0], [5] * 4, "balanced", rng) for _ in range(3000)]
    assert np.bincount(chosen, minlength=4).tolist() == pytest.approx([0, 1000, 1000, 1000], abs=120)


def finished_by_cell(rule, seed, abandoned_after):
    """447 people arrive over 8 hours and take about 25 minutes; 15 to 30 % leave on the way without a word."""
    rng = np.random.default_rng(seed)
    dropouts = rng.uniform(0.15, 0.30)
    counted, finished = np.zeros(CELLS, int), np.zeros(CELLS, int)
    ends = []  # time, cell, whether finished
    for arrival in np.sort(rng.uniform(0, 8 * HOUR, PEOPLE)):
        while ends and ends[0][0] <= arrival:
            _, cell, done = heapq.heappop(ends)
            counted[cell] -= not done
            finished[cell] += done
        cell = choose(counted.tolist(), [PEOPLE] * CELLS, rule, rng)
        counted[cell] += 1
        duration = rng.lognormal(np.log(25), 0.35)
        if rng.random() < dropouts:
            heapq.heappush(ends, (arrival + rng.uniform(0, duration) + abandoned_after, cell, False))
        else:
            heapq.heappush(ends, (arrival + duration, cell, True))
    for _, cell, done in ends:
        finished[cell] += done
    return int(np.ptp(finished))


def spread(rule, abandoned_after):
    return np.mean([finished_by_cell(rule, seed, abandoned_after) for seed in range(50)])


@pytest.mark.slow
def test_balanced_assignment_with_release_differs_by_at_most_3_over_cells():
    with_release = spread("balanced", abandoned_after=30.0)
    assert with_release <= 3.0
    assert spread("balanced", abandoned_after=1e9) > with_release
    assert spread("uniform", abandoned_after=30.0) > 15.0
