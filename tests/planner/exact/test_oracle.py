"""Compare the exact planner with a simple table of all states, on small problems with many ties."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import expected, grid_problem

from planner.checker import check
from planner.exact.solver import ExactSolver
from planner.plan import Proof, Status
from planner.problem import RoutingProblem, Shipment, tour_length
from planner.solvers import SolveLimit

TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)


def assert_optimal(problem, planner, length):
    plan = planner.solve(problem)
    assert plan.status is Status.OPTIMAL
    assert int(tour_length(problem, plan.visits, problem.integers.metric)) == length
    return plan


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), capacity=st.integers(1, 2))
def test_any_problem_is_solved_to_the_optimum(seed, capacity):
    problem = grid_problem(np.random.default_rng(seed), 6, capacity)
    length = expected(problem)
    for planner in (TABLE, SEARCH):
        check(problem, assert_optimal(problem, planner, length))


@settings(max_examples=6, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), capacity=st.integers(3, 4))
def test_with_more_hands_or_tools_finds_a_tour_next_to_a_true_bound(seed, capacity):
    problem = grid_problem(np.random.default_rng(seed), 6, capacity)
    limit, unit = SolveLimit(seconds=0.2), problem.integers.unit
    for plan in (TABLE.solve(problem, limit=limit), *TABLE.improve(problem, limit=limit)):
        check(problem, plan)
        assert plan.certificate.proof in (Proof.EXHAUSTIVE, Proof.SPANNING_TREE)
        assert plan.lower_bound <= expected(problem) * unit + 1e-6 <= plan.cost + 2e-6


def test_the_oracle_knows_a_tour_that_was_worked_out_by_hand():
    d = np.abs(np.subtract.outer([0.0, 1, 2, 5], [0.0, 1, 2, 5]))  # person at 0, objects at 1 and 5, bin at 2
    pair = (Shipment(1, 2), Shipment(3, 2))
    assert expected(RoutingProblem(d, 0, pair, (), 1, resolution=1e-4)) == 80_000  # tour: 0 1 2 5 2
    assert expected(RoutingProblem(d, 0, pair, (), 2, resolution=1e-4)) == 80_000
    assert (
        expected(RoutingProblem(d, 0, pair, (0,), 1, resolution=1e-4)) == 80_000
    )  # the carried object belongs to the start
    assert expected(RoutingProblem(d, 0, pair, (3,), 1, resolution=1e-4)) == 100_000  # tour: 0 5 2 1 2


@pytest.mark.slow
@pytest.mark.parametrize("capacity", [1, 2])
@pytest.mark.parametrize("n", [13, 15, 16, 18])
def test_search_and_full_table_agree_up_to_eighteen_objects(n, capacity):
    for seed in range(capacity + 1):
        rng = np.random.default_rng([n, seed])
        bins = int(rng.integers(2, 7))
        points = rng.uniform(0, 10, (1 + bins + n, 2)) if seed else rng.integers(0, 8, (1 + bins + n, 2))
        d = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1).astype(float))
        shipments = tuple(Shipment(1 + bins + k, 1 + int(rng.integers(bins))) for k in range(n))
        problem = RoutingProblem(d, 0, shipments, (1,) * seed, capacity)
        by_table = ExactSolver(table_bytes=1 << 30).solve(problem)
        length = int(tour_length(problem, by_table.visits, problem.integers.metric))
        assert_optimal(problem, SEARCH, length)
