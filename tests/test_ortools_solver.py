"""OR-Tools and the greedy baseline: feasible in every state, optimal where all tours can be listed, repeatable."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem

from planner.checker import check
from planner.plan import Status, VisitKind
from planner.problem import RoutingProblem, Shipment
from planner.solver import SolveLimit, solver

seeds = st.integers(0, 2**32 - 1)


def shortest_by_permutations(problem):
    """Length of the best of all orders of all stops, checked one by one."""
    n, m = len(problem.shipments), len(problem.onboard)
    stops = [s.pickup for s in problem.shipments] + [s.delivery for s in problem.shipments]
    stops += list(problem.onboard)
    best = np.inf
    for order in itertools.permutations(range(len(stops))):
        if any(order.index(k) > order.index(n + k) for k in range(n)):
            continue
        loads = m + np.cumsum([1 if k < n else -1 for k in order])
        if len(loads) and loads.max() > problem.capacity:
            continue
        walk = [problem.start, *(stops[k] for k in order)]
        best = min(best, sum(problem.distances[a, b] for a, b in itertools.pairwise(walk)))
    return best


@settings(max_examples=40, deadline=None)
@given(seed=seeds, shipments=st.integers(0, 3), onboard=st.integers(0, 2), capacity=st.integers(1, 3))
def test_up_to_three_objects_are_proven_optimal(seed, shipments, onboard, capacity):
    problem = random_problem(seed, shipments, min(onboard, capacity, 3 - shipments), capacity)
    plan = solver("ortools").solve(problem)
    check(problem, plan)
    assert plan.status is Status.OPTIMAL
    assert plan.cost == pytest.approx(shortest_by_permutations(problem), abs=5e-3)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("shipments", "onboard"), [(4, 0), (3, 1), (2, 2)])
def test_local_search_finds_the_optimum_of_four_objects(seed, shipments, onboard):
    problem = random_problem(seed, shipments, onboard)
    plan = solver("ortools").solve(problem, limit=SolveLimit(work=150))
    check(problem, plan)
    assert plan.cost == pytest.approx(shortest_by_permutations(problem), abs=5e-3)


@settings(max_examples=15, deadline=None)
@given(
    seed=seeds,
    shipments=st.integers(0, 8),
    onboard=st.integers(0, 3),
    capacity=st.integers(1, 4),
    name=st.sampled_from(["ortools", "greedy"]),
)
def test_plans_are_feasible_and_bounded_from_any_state(seed, shipments, onboard, capacity, name):
    problem = random_problem(seed, shipments, min(onboard, capacity), capacity)
    plan = solver(name).solve(problem, limit=SolveLimit(work=20))
    check(problem, plan)
    assert (plan.status is Status.OPTIMAL) == (plan.lower_bound == plan.cost)


@settings(max_examples=10, deadline=None)
@given(seed=seeds)
def test_the_lower_bound_is_below_the_optimum(seed):
    problem = random_problem(seed, 3, 1)
    for name in ("greedy", "ortools"):
        plan = solver(name).solve(problem, limit=SolveLimit(work=10))
        assert 0 < plan.lower_bound <= shortest_by_permutations(problem) + 1e-9


def test_the_same_work_gives_the_same_plan():
    problem = random_problem(5, 12, 1, bins=6)
    first, second = (solver("ortools").solve(problem, seed=1, limit=SolveLimit(work=50)) for _ in range(2))
    assert (first.visits, first.cost) == (second.visits, second.cost)


def test_searching_on_beats_the_nearest_first():
    problem = random_problem(2, 10, bins=6)
    greedy = solver("greedy").solve(problem)
    searched = solver("ortools").solve(problem, limit=SolveLimit(work=50))
    assert searched.cost < greedy.cost


def test_one_object_is_fetched_and_brought():
    problem = random_problem(1, 1)
    plan = solver("ortools").solve(problem)
    assert [v.kind for v in plan.visits] == [VisitKind.PICK, VisitKind.PLACE]
    assert plan.status is Status.OPTIMAL


def test_nothing_left_is_an_empty_proven_plan():
    plan = solver("ortools").solve(random_problem(1, 0))
    assert (plan.visits, plan.cost, plan.lower_bound, plan.status) == ((), 0.0, 0.0, Status.OPTIMAL)


def test_everything_in_one_place_still_ends():
    here = RoutingProblem(np.zeros((2, 2)), 0, tuple(Shipment(0, 1) for _ in range(4)), (1,), 2)
    plan = solver("ortools").solve(here, limit=SolveLimit(work=20))
    check(here, plan)
    assert plan.cost == 0


def test_a_hopeless_time_limit_still_gives_a_plan():
    problem = random_problem(3, 24, bins=6)
    check(problem, solver("ortools").solve(problem, limit=SolveLimit(seconds=1e-9)))
