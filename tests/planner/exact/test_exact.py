"""Check that the table, the bound and the search of the exact planner agree."""

import dataclasses
import functools
import math
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem as points_or_metric

from planner.checker import check
from planner.exact import annealing
from planner.exact.annealing import anneal, decode, tour_actions
from planner.exact.expand import row_of
from planner.exact.instance import make_instance, to_visits
from planner.exact.moves import moves_of
from planner.exact.multipliers import counted_by_bin, first_bound, grown
from planner.exact.search import beam_pass
from planner.exact.solver import ExactSolver
from planner.exact.table import new_table
from planner.exact.table_kernels import fill, walk
from planner.plan import Status
from planner.problem import RoutingProblem, Shipment, tour_length
from planner.regret import one_by_one, regrets
from planner.solvers import NEVER, Deadline, SolveLimit, solver

seeds = st.integers(0, 2**32 - 1)
random_problem = functools.partial(points_or_metric, bins=6)
TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)


def integer_length(problem, plan):
    return int(tour_length(problem, plan.visits, problem.integers.metric))


@settings(max_examples=25, deadline=None)
@given(seed=seeds, n=st.integers(4, 11), width=st.integers(1, 30), rows=st.integers(1, 200))
def test_a_narrow_search_claims_no_more_than_it_knows(seed, n, width, rows):
    problem = random_problem(seed, n, seed % 3)
    optimum = ExactSolver(table_bytes=1 << 30).solve(problem)
    plan = ExactSolver(table_bytes=0, passes=((rows, width),)).solve(problem)
    check(problem, plan)
    assert plan.lower_bound <= optimum.cost + 1e-6
    if plan.status is Status.OPTIMAL:
        assert integer_length(problem, plan) == integer_length(problem, optimum)


@settings(max_examples=40, deadline=None)
@given(seed=seeds, n=st.integers(4, 9), width=st.integers(1, 20), rows=st.integers(1, 100))
def test_a_pass_that_drops_states_bounds_the_optimum_from_both_sides(seed, n, width, rows):
    problem = random_problem(seed, n, seed % 3)
    instance = make_instance(problem, problem.integers.metric)
    optimum = integer_length(problem, ExactSolver(table_bytes=1 << 30).solve(problem))
    poor = optimum + optimum // 3  # far from optimal, so that the bound depends on the dropped states
    bound = grown(first_bound(instance, poor), poor, rows, NEVER)
    found = beam_pass(bound, poor, width, 10**9, NEVER)
    assert found.lower <= optimum <= found.upper
    if found.actions is not None:
        visits = to_visits(instance, found.actions, problem.names[:n], problem.names[n:])
        assert tour_length(problem, visits, problem.integers.metric) == found.upper


@settings(max_examples=30, deadline=None)
@given(seed=seeds, n=st.integers(1, 7), groups=st.integers(1, 7))
def test_the_relaxation_bounds_every_state_for_any_multipliers_and_groups(seed, n, groups):
    rng = np.random.default_rng(seed)
    problem = random_problem(seed, n, bins=3)
    instance = make_instance(problem, problem.integers.metric)
    group = np.unique(rng.integers(0, groups, n), return_inverse=True)[1] if groups < 7 else np.arange(n)
    exact, relaxed = new_table(instance, np.arange(n)), new_table(instance, group)
    relaxed.multipliers[:] = rng.integers(-20_000, 40_000, n)
    fill(instance, exact)
    fill(instance, relaxed)
    separate = len(set(group)) == n
    for left in range(1 << n):
        inside = [j for j in range(n) if left >> j & 1]
        row = row_of(relaxed, left)
        assert row == sum(int(relaxed.stride[j]) for j in inside)
        price = sum(int(relaxed.multipliers[j]) for j in inside)
        pairs = [(relaxed.bin[row], exact.bin[left])]
        pairs += [(relaxed.object[row, i], exact.object[left, i]) for i in range(n) if i not in inside]
        for bound, truth in pairs:
            assert (bound - price <= truth).all()
            assert not separate or (bound - price == truth).all()


@settings(max_examples=20, deadline=None)
@given(seed=seeds, n=st.integers(2, 9), onboard=st.integers(0, 2))
def test_fitted_multipliers_bound_the_optimum_and_growing_does_not_harm(seed, n, onboard):
    problem = random_problem(seed, n, onboard)
    instance = make_instance(problem, problem.integers.metric)
    table = new_table(instance, np.arange(n))
    fill(instance, table)
    optimum, _ = walk(moves_of(instance), table, len(table.bin) - 1, np.empty(2 * n + 2, np.int64))
    bound = first_bound(instance, optimum)
    roots = [bound.root]
    roots.append(counted_by_bin(bound, optimum, 1 << n, NEVER).root)
    for rows in [3 << k for k in range(n)]:
        bound = grown(bound, optimum, rows, NEVER)
        roots.append(bound.root)
    assert all(root <= optimum for root in roots)
    assert roots[0] <= roots[1]
    assert roots[2:] == sorted(roots[2:]) and roots[2] >= roots[0]
    assert roots[-1] == optimum


def dropped_every_way(instance, order):
    """Return the minimum length for an order of picks, over all possible drops between them."""
    n = len(order)
    best = np.inf
    carried = tuple(int(b) for b in instance.carried)

    def go(t, legs_object, legs_bin, held, length):
        nonlocal best
        if t == n and not held:
            best = min(best, length)
        for b in set(held):
            rest = list(held)
            rest.remove(b)
            go(t, instance.to_bin[:, b], instance.bins[b], tuple(rest), length + int(legs_bin[b]))
        if t < n and len(held) < 2:
            i = order[t]
            home = int(instance.home[i])
            go(t + 1, instance.between[i], instance.to_bin[i], (*held, home), length + int(legs_object[i]))

    go(0, instance.root, instance.root_bin, carried, 0)
    return best


@settings(max_examples=40, deadline=None)
@given(seed=seeds, n=st.integers(0, 5), onboard=st.integers(0, 2), bins=st.integers(1, 4))
def test_drops_of_a_pick_order_are_decoded_optimally(seed, n, onboard, bins):
    problem = random_problem(seed, n, onboard, bins=bins)
    instance = make_instance(problem, problem.integers.metric)
    order = np.random.default_rng(seed).permutation(n)
    costs = np.empty((n + 1, len(instance.bins) + 1), np.int64)
    length = decode(instance, order, 0, costs)
    assert length == dropped_every_way(instance, order)
    visits = to_visits(
        instance, tour_actions(moves_of(instance), order), problem.names[:n], problem.names[n:]
    )
    assert tour_length(problem, visits, problem.integers.metric) == length
    assert [problem.number[v.object] for v in visits if v.kind.value == "pick"] == order.tolist()


def test_annealing_costs_stay_consistent_with_decoding_from_scratch():
    problem = random_problem(3, 14, 1)
    instance = make_instance(problem, problem.integers.metric)
    length, order = anneal(instance, 7, 3000, np.arange(14), 0.5, 0.01)
    costs = np.empty((15, len(instance.bins) + 1), np.int64)
    assert sorted(order) == list(range(14))
    assert decode(instance, order, 0, costs) == length
    again, same = anneal(instance, 7, 3000, np.arange(14), 0.5, 0.01)
    assert again == length
    np.testing.assert_array_equal(order, same)


def test_annealing_is_the_same_in_slices_and_stops_at_the_deadline(monkeypatch):
    problem = random_problem(3, 14, 1)
    instance, first = make_instance(problem, problem.integers.metric), np.arange(14)
    length, order = anneal(instance, 7, 3000, first, 0.5, 0.01)
    monkeypatch.setattr(annealing, "SLICE", 170)
    again, same = anneal(instance, 7, 3000, first, 0.5, 0.01)
    assert (again, same.tolist()) == (length, order.tolist())
    stop = threading.Event()
    stop.set()
    longer, kept = anneal(instance, 7, 3000, first, 0.5, 0.01, Deadline(None, stop))
    assert kept.tolist() == first.tolist() and longer > length


@settings(max_examples=20, deadline=None)
@given(seed=seeds, n=st.integers(1, 7), onboard=st.integers(0, 1))
def test_with_one_hand_the_table_the_pass_and_single_plans_cost_each_next_visit_alike(seed, n, onboard):
    problem = dataclasses.replace(random_problem(seed, n, onboard), capacity=1)
    expected = {regret.visit: regret.cost for regret in one_by_one(problem, TABLE)}
    assert len(expected) == (1 if onboard else n)
    for exact in (TABLE, SEARCH):
        found = regrets(problem, exact, radius=math.inf)
        assert {regret.visit: regret.cost for regret in found} == pytest.approx(expected)


def test_distances_that_are_no_metric_are_taken_as_given():
    # The shortest path from 1 to 3 is via 0 and costs 3, but the given leg from 1 to 3 costs 50.
    d = np.array([[0, 1, 9, 2.0], [1, 0, 9, 50], [9, 9, 0, 9], [2.0, 50, 9, 0]])
    problem = RoutingProblem(d, 0, (Shipment(1, 3),), (), 2)
    plan = solver("exact").solve(problem)
    check(problem, plan)
    assert (plan.status, plan.cost) == (Status.OPTIMAL, 51.0)


@pytest.mark.parametrize(("n", "capacity"), [(16, 3), (16, 4), (61, 2)])
def test_beyond_its_limits_it_has_a_tour_and_no_worse_a_bound_than_or_tools(n, capacity):
    problem = dataclasses.replace(random_problem(5, n), capacity=capacity)
    limit = SolveLimit(seconds=0.4)
    plan, other = (solver(name).solve(problem, limit=limit) for name in ("exact", "ortools"))
    check(problem, plan)
    assert plan.cost >= plan.lower_bound >= other.lower_bound > 0
