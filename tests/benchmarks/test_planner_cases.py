"""Check that the problems of the planner benchmark are the ones that its page describes."""

import numpy as np

from benchmarks.support.planner_cases import COUNTS, make_cases, meal_problem, random_problem


def test_there_are_five_hundred_problems():
    assert sum(sum(sizes.values()) for sizes in COUNTS.values()) == 500
    assert len(COUNTS) == 6


def test_equal_seeds_give_equal_problems():
    counts = {"apartment": {6: 1}, "mid-task": {12: 1}, "random": {12: 2}, "many bins": {6: 1}}
    first, again = (list(make_cases(counts)) for _ in range(2))
    assert [(c.kind, c.objects, c.seed) for c in first] == [
        ("apartment", 6, 0),
        ("mid-task", 12, 0),
        ("random", 12, 0),
        ("random", 12, 1),
        ("many bins", 6, 0),
    ]
    for one, other in zip(first, again, strict=True):
        assert np.array_equal(one.problem.distances, other.problem.distances)
        assert one.problem.shipments == other.problem.shipments
    assert not np.array_equal(first[2].problem.distances, first[3].problem.distances)


def test_each_object_has_its_own_bin_if_there_are_many():
    shipments = random_problem(18, 18, 0).shipments
    assert len({s.delivery for s in shipments}) == len({s.pickup for s in shipments}) == 18


def test_a_published_problem_keeps_travel_times_unless_a_detour_is_quicker():
    problem = meal_problem(6, 0)
    assert [(s.pickup, s.delivery) for s in problem.shipments] == [(k, k + 1) for k in range(1, 13, 2)]
    published = [582, 455, 655, 547, 134, 646, 730, 674, 310, 671]  # the triangle's first rows
    assert [problem.distances[k, i] for k in range(5) for i in range(k)] == published
    detours = problem.distances[:, :, None] + problem.distances[None]
    assert (detours.min(axis=1) == problem.distances).all()
