"""Check with exact fractions that optimal plans are optimal to a relative 1e-9 at any scale of distances."""

import dataclasses
import itertools
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import optimum, random_problem

from planner.checker import check, verify_optimal
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.integer_distances import TOLERANCE
from planner.plan import Status
from planner.problem import RoutingProblem, Shipment
from planner.solvers import SOLVERS, solver

TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)
SCALES = [1e-200, 1e-9, 1e-5, 0.1, 1 / 3, 1.0, 1e3, 6e13, 1e15, 1e200]
seeds = st.integers(0, 2**32 - 1)


def length(problem, plan):
    """Return the length of a plan's tour as a fraction."""
    stops = problem.stops(plan.visits)
    return sum((Fraction(problem.distances[a, b]) for a, b in itertools.pairwise(stops)), Fraction(0))


def assert_true(problem, plan):
    """Check the cost, the lower bound and, within the tolerance, the optimality of a plan."""
    best, cost = optimum(problem, Fraction), length(problem, plan)
    assert abs(Fraction(plan.cost) - cost) <= cost * Fraction(1, 10**14)
    assert Fraction(plan.lower_bound) <= best * (1 + Fraction(TOLERANCE))
    if plan.status is Status.OPTIMAL:
        assert cost <= best * (1 + Fraction(TOLERANCE))


def scaled(problem, factor):
    return dataclasses.replace(problem, distances=problem.distances * factor)


def no_metric(seed, n, capacity, spread):
    """Return a problem with distances of very different magnitudes that do not form a metric."""
    rng = np.random.default_rng(seed)
    d = np.triu(10 ** rng.uniform(-spread, spread, (n + 3, n + 3)), 1)
    shipments = tuple(Shipment(3 + k, int(rng.integers(1, 3))) for k in range(n))
    return RoutingProblem(d + d.T, 0, shipments, (), capacity)


@settings(max_examples=60, deadline=None)
@given(
    seed=seeds,
    n=st.integers(0, 5),
    onboard=st.integers(0, 2),
    scale=st.sampled_from(SCALES),
    coincide=st.booleans(),
)
def test_at_any_scale_the_optimum_is_found_proven_and_verified(seed, n, onboard, scale, coincide):
    problem = scaled(random_problem(seed, n, onboard, coincide=coincide), scale)
    for planner in (TABLE, SEARCH):
        plan = planner.solve(problem)
        assert plan.status is Status.OPTIMAL
        assert_true(problem, plan)
        check(problem, plan)
        assert verify_optimal(problem, plan).optimal


@pytest.mark.parametrize("name", sorted(SOLVERS))
@pytest.mark.parametrize("scale", [1e-9, 6e13, 1e15])
def test_no_planner_is_wrong_about_itself_at_odd_scales(name, scale):
    for seed in range(4):
        problem = scaled(random_problem(seed, 2 + seed, seed % 3), scale)
        plan = solver(name).solve(problem)
        assert_true(problem, plan)
        check(problem, plan)


@settings(max_examples=60, deadline=None)
@given(seed=seeds, n=st.integers(1, 3), capacity=st.integers(1, 3), spread=st.sampled_from([0.5, 3, 12]))
def test_plans_in_distances_of_mixed_magnitudes_are_true(seed, n, capacity, spread):
    problem = no_metric(seed, n, capacity, spread)
    assert_true(problem, TABLE.solve(problem))


@settings(max_examples=40, deadline=None)
@given(seed=seeds, gap=st.sampled_from([1e-3, 1e-6, 1e-8]), scale=st.sampled_from(SCALES))
def test_of_two_tours_that_nearly_tie_the_shorter_is_taken(seed, gap, scale):
    """One object is on each side of the start. The slightly nearer one must be picked up first."""
    left, right = (1.0, 1.0 + gap) if seed % 2 else (1.0 + gap, 1.0)
    at = np.array([0.0, -left, right]) * scale
    problem = RoutingProblem(np.abs(np.subtract.outer(at, at)), 0, (Shipment(1, 1), Shipment(2, 2)), (), 2)
    for planner in (TABLE, SEARCH):
        plan = planner.solve(problem)
        first = problem.location(plan.visits[0])
        assert first == (1 if left < right else 2)
        assert plan.status is Status.OPTIMAL


@settings(max_examples=30, deadline=None)
@given(
    seed=seeds,
    n=st.integers(1, 9),
    onboard=st.integers(0, 2),
    far=st.sampled_from([0.0, 1e-300, 1e15, 1e300]),
)
def test_neither_the_order_of_locations_nor_places_nobody_visits_matter(seed, n, onboard, far):
    problem = random_problem(seed, n, onboard)
    k = len(problem.distances)
    order = np.random.default_rng(seed).permutation(k + 2)
    wide = np.full((k + 2, k + 2), far)
    wide[np.ix_(order[:k], order[:k])] = problem.distances
    np.fill_diagonal(wide, 0.0)
    to = order.tolist()
    embedded = RoutingProblem(
        wide,
        to[problem.start],
        tuple(Shipment(to[s.pickup], to[s.delivery]) for s in problem.shipments),
        tuple(to[j] for j in problem.onboard),
    )
    for planner in (TABLE, SEARCH):
        one, other = planner.solve(problem), planner.solve(embedded)
        assert other.cost == pytest.approx(one.cost, rel=2 * TOLERANCE)
        assert other.status is one.status is Status.OPTIMAL
        check(embedded, other)


def test_whole_numbers_and_few_decimals_are_exact():
    points = np.random.default_rng(0).integers(0, 900, (8, 2))
    streets = np.abs(points[:, None] - points[None]).sum(axis=2)
    for unit in (1e-3, 0.1, 1.0, 1e6):
        problem = RoutingProblem(streets * unit, 0, tuple(Shipment(4 + k, 1 + k % 3) for k in range(4)))
        assert problem.integers.rounding == 0
        assert TABLE.solve(problem).cost == pytest.approx(float(optimum(problem, Fraction)), rel=1e-15)


@pytest.mark.parametrize("largest", [1e-280, 1e290])
def test_what_floats_cannot_hold_is_refused(largest):
    with pytest.raises(ProblemError, match="choose a unit"):
        RoutingProblem(np.array([[0.0, largest], [largest, 0.0]]), 0, (Shipment(1, 0),))
