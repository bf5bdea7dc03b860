"""Compare the exact planner with a simple table of all states, on small problems with many ties."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.support.kernels import kernel
from planner.checker import check
from planner.exact.solver import ExactSolver
from planner.plan import Status
from planner.problem import RoutingProblem, Shipment, tour_length

TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)
FAR = 1 << 60


@kernel
def oracle(d, start, pickup, delivery, onboard, capacity):
    """Return the minimum tour length by dynamic programming over the states of all objects.

    An object is loose (0), carried (1) or delivered (2). The row of the table is a number in base 3 whose
    digit k is the state of object k, with carried objects last. The column is the current location.
    """
    n, k = pickup.size, pickup.size + onboard.size
    codes = 3**k
    cost = np.full((codes, len(d)), FAR, np.int64)
    code = 0
    for i in range(n, k):
        code += 3**i
    cost[code, start] = 0
    best = FAR
    for code in range(codes):  # every visit leads to a larger code
        carried, done = 0, 0
        for i in range(k):
            carried += code // 3**i % 3 == 1
            done += code // 3**i % 3 == 2
        for here in range(len(d)):
            so_far = cost[code, here]
            if so_far == FAR:
                continue
            if done == k:
                best = min(best, so_far)
            for i in range(k):
                state = code // 3**i % 3
                if state == 2 or (state == 0 and carried == capacity):
                    continue
                goal = delivery[i] if i < n else onboard[i - n]
                there = pickup[i] if state == 0 else goal
                after = code + 3**i
                cost[after, there] = min(cost[after, there], so_far + d[here, there])
    return best


def expected(problem):
    return int(
        oracle(
            problem.integers.metric,
            problem.start,
            np.array([s.pickup for s in problem.shipments], np.int64),
            np.array([s.delivery for s in problem.shipments], np.int64),
            np.array(problem.onboard, np.int64),
            problem.capacity,
        )
    )


def grid_problem(rng, most, capacity):
    """Return a problem on a coarse grid with Manhattan or Euclidean distances. Places may coincide."""
    n, side = int(rng.integers(0, most + 1)), int(rng.integers(1, 6))
    places = int(rng.integers(2, 3 + n + 4))
    points = rng.integers(0, side, (places, 2)).astype(float)
    apart = np.abs(points[:, None] - points[None])
    d = apart.sum(axis=2) if rng.random() < 0.5 else np.hypot(apart[..., 0], apart[..., 1])
    bins = rng.integers(0, places, int(rng.integers(1, n + 2)))  # often a different bin for every object
    shipments = tuple(Shipment(int(rng.integers(places)), int(rng.choice(bins))) for _ in range(n))
    onboard = tuple(int(j) for j in rng.choice(bins, int(rng.integers(0, capacity + 1))))
    return RoutingProblem(d, int(rng.integers(places)), shipments, onboard, capacity)


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
