"""The exact planner against all permutations, a plain recursion and itself: table, bound and search agree."""

import functools
import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.checker import check
from planner.exact.annealing import anneal, decode, propose, tour_actions
from planner.exact.beam import beam_pass
from planner.exact.deadline import NEVER
from planner.exact.groups import alone, numbered
from planner.exact.instance import make_instance, to_visits
from planner.exact.multipliers import counted_by_bin, first_bound, grown
from planner.exact.relaxation import fill
from planner.exact.relaxed_tour import walk
from planner.exact.search import row_of
from planner.exact.solver import ExactSolver
from planner.exact.table import new_table
from planner.plan import Status
from planner.problem import RoutingProblem, Shipment
from planner.solver import SolveLimit, solver
from planner.tour import tour_length

seeds = st.integers(0, 2**32 - 1)
TABLE, SEARCH = ExactSolver(), ExactSolver(table_bytes=0)


def random_problem(seed, shipments, onboard=0, bins=6, planar=True):
    """Location 0 is the start, then the bins, then the objects."""
    rng = np.random.default_rng(seed)
    count = 1 + bins + shipments
    if planar:
        points = rng.uniform(0, 10, (count, 2))
        d = np.hypot(*(points[:, None] - points[None]).transpose(2, 0, 1))
    else:  # any numbers between 1 and 2 are a metric, and one with many near ties
        d = np.triu(rng.uniform(1, 2, (count, count)).round(1), 1)
        d = d + d.T
    deliveries = rng.integers(1, bins + 1, shipments)
    return RoutingProblem(
        d,
        0,
        tuple(Shipment(1 + bins + k, int(deliveries[k])) for k in range(shipments)),
        tuple(int(j) for j in rng.integers(1, bins + 1, onboard)),
        2,
    )


def plain_optimum(problem):
    """Least integer length by recursion on sets; drops are explicit stops, one object at a time."""
    metric = problem.integers.metric
    pickups = [s.pickup for s in problem.shipments]
    homes = [s.delivery for s in problem.shipments]

    @functools.cache
    def go(here, loose, carried):
        if not loose and not carried:
            return 0
        ways = [
            metric[here, carried[k]] + go(carried[k], loose, carried[:k] + carried[k + 1 :])
            for k in range(len(carried))
        ]
        if len(carried) < problem.capacity:
            ways += [
                metric[here, pickups[j]] + go(pickups[j], loose - {j}, tuple(sorted((*carried, homes[j]))))
                for j in loose
            ]
        return min(ways)

    return int(go(problem.start, frozenset(range(len(pickups))), tuple(sorted(problem.onboard))))


def integer_length(problem, plan):
    return int(tour_length(problem, plan.visits, problem.integers.metric))


@settings(max_examples=60, deadline=None)
@given(
    seed=seeds, n=st.integers(0, 6), onboard=st.integers(0, 2), bins=st.integers(1, 6), planar=st.booleans()
)
def test_table_and_search_find_and_prove_the_optimum(seed, n, onboard, bins, planar):
    problem = random_problem(seed, n, onboard, bins, planar)
    expected = plain_optimum(problem)
    for exact in (TABLE, SEARCH):
        plan = exact.solve(problem)
        check(problem, plan)
        assert plan.status is Status.OPTIMAL
        assert integer_length(problem, plan) == expected


@settings(max_examples=25, deadline=None)
@given(
    seed=seeds, n=st.integers(7, 12), onboard=st.integers(0, 2), bins=st.integers(1, 12), planar=st.booleans()
)
def test_search_and_table_agree(seed, n, onboard, bins, planar):
    problem = random_problem(seed, n, onboard, bins, planar)
    by_table = ExactSolver(table_bytes=1 << 30).solve(problem)
    by_search = SEARCH.solve(problem)
    for plan in (by_table, by_search):
        check(problem, plan)
        assert plan.status is Status.OPTIMAL
    assert integer_length(problem, by_table) == integer_length(problem, by_search)


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
    poor = optimum + optimum // 3  # far from optimal, so that the claim rests on the states that were dropped
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
    group = numbered(rng.integers(0, groups, n)) if groups < 7 else alone(n)
    exact, relaxed = new_table(instance, alone(n)), new_table(instance, group)
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
    table = new_table(instance, alone(n))
    fill(instance, table)
    optimum, _ = walk(instance, table, len(table.bin) - 1, np.empty(2 * n + 2, np.int64))
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
    """Least length for an order of picks, over every choice of drops between them."""
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
            go(t, instance.from_bin[b], instance.bins[b], tuple(rest), length + int(legs_bin[b]))
        if t < n and len(held) < 2:
            i = order[t]
            home = int(instance.home[i])
            go(t + 1, instance.between[i], instance.to_bin[i], (*held, home), length + int(legs_object[i]))

    go(0, instance.root, instance.root_bin, carried, 0)
    return best


@settings(max_examples=40, deadline=None)
@given(seed=seeds, n=st.integers(0, 5), onboard=st.integers(0, 2), bins=st.integers(1, 4))
def test_drops_of_a_pick_order_are_decoded_optimally(seed, n, onboard, bins):
    problem = random_problem(seed, n, onboard, bins)
    instance = make_instance(problem, problem.integers.metric)
    order = np.random.default_rng(seed).permutation(n)
    costs = np.empty((n + 1, len(instance.bins) + 1), np.int64)
    length = decode(instance, order, 0, costs)
    assert length == dropped_every_way(instance, order)
    visits = to_visits(instance, tour_actions(instance, order).tolist(), problem.names[:n], problem.names[n:])
    assert tour_length(problem, visits, problem.integers.metric) == length
    assert [problem.number[v.object] for v in visits if v.kind.value == "pick"] == order.tolist()


@settings(max_examples=50, deadline=None)
@given(seed=seeds, n=st.integers(2, 12))
def test_proposals_are_permutations_that_keep_the_announced_beginning(seed, n):
    order = np.random.default_rng(seed).permutation(n)
    candidate = np.empty_like(order)
    first = propose(order, candidate, np.array([seed], np.uint64))
    assert sorted(candidate) == list(range(n))
    np.testing.assert_array_equal(candidate[:first], order[:first])
    assert (candidate != order).any()


def test_annealing_costs_stay_consistent_with_decoding_from_scratch():
    problem = random_problem(3, 14, 1)
    instance = make_instance(problem, problem.integers.metric)
    length, order = anneal(instance, 7, 3000)
    costs = np.empty((15, len(instance.bins) + 1), np.int64)
    assert decode(instance, order, 0, costs) == length
    again, same = anneal(instance, 7, 3000)
    assert again == length
    np.testing.assert_array_equal(order, same)


def test_eighteen_objects_are_proven_and_repeat_bit_for_bit():
    problem = random_problem(11, 18)
    plans = [SEARCH.solve(problem, seed=s) for s in (0, 0, 1)]
    for plan in plans:
        check(problem, plan)
        assert plan.status is Status.OPTIMAL
    assert plans[0].visits == plans[1].visits
    assert integer_length(problem, plans[0]) == integer_length(problem, plans[2])


def test_a_budget_of_states_ends_the_search_with_an_honest_bound():
    problem = random_problem(4, 24)
    plan = SEARCH.solve(problem, limit=SolveLimit(work=30_000))
    check(problem, plan)
    assert 0.8 * plan.cost < plan.lower_bound <= plan.cost
    again = SEARCH.solve(problem, limit=SolveLimit(work=30_000))
    assert (plan.visits, plan.lower_bound) == (again.visits, again.lower_bound)


def test_hardly_any_time_still_gives_a_plan():
    problem = random_problem(4, 24)
    check(problem, solver("exact").solve(problem, limit=SolveLimit(seconds=1e-6)))


@pytest.mark.parametrize("capacity", [1, 3])
def test_other_capacities_are_planned_too(capacity):
    problem = random_problem(1, 5)
    problem = RoutingProblem(problem.distances, 0, problem.shipments, (), capacity)
    check(problem, solver("exact").solve(problem))


def test_everything_in_one_place_costs_nothing():
    for count in (0, 1, 6):
        problem = RoutingProblem(np.zeros((2, 2)), 0, tuple(Shipment(0, 1) for _ in range(count)), (1, 1), 2)
        for exact in (TABLE, SEARCH):
            plan = exact.solve(problem)
            check(problem, plan)
            assert (plan.cost, plan.status) == (0.0, Status.OPTIMAL)


def test_all_bins_distinct():
    problem = random_problem(2, 9, bins=9)
    problem = RoutingProblem(problem.distances, 0, tuple(Shipment(10 + k, 1 + k) for k in range(9)), (), 2)
    assert SEARCH.solve(problem).cost == pytest.approx(TABLE.solve(problem).cost, abs=1e-9)


def test_distances_that_are_no_metric_are_taken_as_given():
    # The closed metric goes 1 -> 0 -> 3 for 3, but the leg 1 -> 3 as given costs 50, and no visit lies between.
    d = np.array([[0, 1, 9, 2.0], [1, 0, 9, 50], [9, 9, 0, 9], [2.0, 50, 9, 0]])
    problem = RoutingProblem(d, 0, (Shipment(1, 3),), (), 2)
    plan = solver("exact").solve(problem)
    check(problem, plan)
    assert (plan.status, plan.cost) == (Status.OPTIMAL, 51.0)


@pytest.mark.parametrize("capacity", [1, 3, 4])
def test_many_objects_at_other_capacities_get_an_honest_bound(capacity):
    problem = random_problem(3, 16)
    problem = RoutingProblem(problem.distances, problem.start, problem.shipments, (), capacity)
    plan = solver("exact").solve(problem, limit=SolveLimit(seconds=0.5))
    check(problem, plan)
    assert 0 < plan.lower_bound <= plan.cost


def test_beyond_its_limits_it_keeps_the_better_bound():
    problem = random_problem(5, 41)
    limit = SolveLimit(seconds=0.4)
    plan, other = (solver(name).solve(problem, limit=limit) for name in ("exact", "ortools"))
    check(problem, plan)
    assert plan.cost >= plan.lower_bound >= other.lower_bound > 0


def test_never_worse_than_or_tools():
    for seed in range(4):
        problem = random_problem(seed, 10, seed % 3)
        exact, searched = (
            solver("exact").solve(problem),
            solver("ortools").solve(problem, limit=SolveLimit(work=40)),
        )
        assert exact.cost <= searched.cost + 5e-3


def test_the_recursion_used_here_agrees_with_listing_all_orders():
    problem = random_problem(9, 3, 1, bins=2)
    stops = [("p", k) for k in range(3)] + [("d", k) for k in range(3)] + [("o", 0)]
    metric = problem.integers.metric
    best = np.inf
    for order in itertools.permutations(stops):
        load, here, length, ok = 1, 0, 0, True
        for kind, k in order:
            ok = ok and (kind != "d" or order.index(("p", k)) < order.index(("d", k)))
            load += 1 if kind == "p" else -1
            ok = ok and load <= 2
            s = problem.shipments[k]
            at = {"p": s.pickup, "d": s.delivery, "o": problem.onboard[0]}[kind]
            length += metric[here, at]
            here = at
        best = min(best, length) if ok else best
    assert plain_optimum(problem) == best
