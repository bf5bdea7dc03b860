"""Check that OR-Tools and the greedy solver return feasible and repeatable plans."""

import threading

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from planning_cases import optimum, random_problem

from planner.checker import check
from planner.plan import Status
from planner.problem import RoutingProblem, Shipment
from planner.solvers import SolveLimit, solver

seeds = st.integers(0, 2**32 - 1)


@settings(max_examples=40, deadline=None)
@given(
    seed=seeds,
    shipments=st.integers(0, 3),
    onboard=st.integers(0, 2),
    capacity=st.integers(1, 4),
    coincide=st.booleans(),
)
def test_up_to_three_objects_are_proven_optimal(seed, shipments, onboard, capacity, coincide):
    problem = random_problem(
        seed, shipments, min(onboard, capacity, 3 - shipments), capacity, coincide=coincide
    )
    plan = solver("ortools").solve(problem)
    check(problem, plan)
    assert plan.status is Status.OPTIMAL
    assert plan.cost == pytest.approx(optimum(problem), abs=5e-3)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize(("shipments", "onboard"), [(4, 0), (3, 1), (2, 2)])
def test_local_search_finds_the_optimum_of_four_objects(seed, shipments, onboard):
    problem = random_problem(seed, shipments, onboard)
    plan = solver("ortools").solve(problem, limit=SolveLimit(work=150))
    check(problem, plan)
    assert plan.cost == pytest.approx(optimum(problem), abs=5e-3)


@settings(max_examples=15, deadline=None)
@given(
    seed=seeds,
    shipments=st.integers(0, 8),
    onboard=st.integers(0, 3),
    capacity=st.integers(1, 4),
    coincide=st.booleans(),
    name=st.sampled_from(["ortools", "greedy"]),
)
@example(seed=0, shipments=0, onboard=0, capacity=1, coincide=False, name="greedy")
def test_plans_are_feasible_and_bounded_from_any_state(seed, shipments, onboard, capacity, coincide, name):
    problem = random_problem(seed, shipments, min(onboard, capacity), capacity, coincide=coincide)
    plan = solver(name).solve(problem, limit=SolveLimit(work=20))
    derived = check(problem, plan)
    assert (plan.status is Status.OPTIMAL) == (plan.lower_bound == plan.cost)
    if 0 < shipments <= 4:
        assert derived == pytest.approx(optimum(problem)), "the checker tries every order of so few"
        assert coincide or plan.lower_bound > 0
        assert plan.lower_bound <= optimum(problem) + 1e-9


def test_the_same_work_gives_the_same_plan():
    problem = random_problem(5, 12, 1, bins=6)
    first, second = (solver("ortools").solve(problem, seed=1, limit=SolveLimit(work=50)) for _ in range(2))
    assert (first.visits, first.cost) == (second.visits, second.cost)


def test_a_search_ends_after_the_given_number_of_solutions():
    problem = random_problem(5, 12, 1, bins=6)
    short, long = (solver("ortools").solve(problem, limit=SolveLimit(work=work)) for work in (1, 20))
    assert short.cost > long.cost


def test_a_search_asks_whether_to_stop_and_then_returns_a_plan():
    class StopsSoon(threading.Event):
        """An event that is set by another thread after it was asked for five times."""

        asked = 0

        def is_set(self):
            self.asked += 1
            return self.asked > 5

    problem, stop = random_problem(5, 12, 1, bins=6), StopsSoon()
    plan = solver("ortools").solve(problem, limit=SolveLimit(work=50, stop=stop))
    check(problem, plan)
    assert stop.asked > 5


def test_everything_in_one_place_still_ends():
    here = RoutingProblem(np.zeros((2, 2)), 0, tuple(Shipment(0, 1) for _ in range(4)), (1,), 2)
    plan = solver("ortools").solve(here, limit=SolveLimit(work=20))
    check(here, plan)
    assert plan.cost == 0
