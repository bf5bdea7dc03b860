"""Compare regrets with a plain recursion and with solving the remaining task after each visit."""

import dataclasses
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import optimum, random_problem

from planner import regret
from planner.errors import ProblemError
from planner.exact.instance import make_instance
from planner.exact.multipliers import first_bound, grown
from planner.exact.solver import ExactSolver
from planner.problem import after, possible_next, tour_length
from planner.regret import costs_by_pass, regrets
from planner.solvers import Deadline, SolveLimit, solver

seeds = st.integers(0, 2**32 - 1)
TABLE, PASS = ExactSolver(), ExactSolver(table_bytes=0)


def expected(problem):
    """Return the cost of the whole task for each possible next visit."""
    return {
        visit: problem.distances[problem.start, problem.location(visit)] + optimum(after(problem, visit))
        for visit in possible_next(problem)
    }


@pytest.mark.slow
@settings(max_examples=60, deadline=None)
@given(
    seed=seeds, n=st.integers(0, 5), onboard=st.integers(0, 2), coincide=st.booleans(), table=st.booleans()
)
def test_regrets_are_those_of_trying_everything(seed, n, onboard, coincide, table):
    problem = random_problem(seed, n, onboard, coincide=coincide)
    found = regrets(problem, TABLE if table else PASS, radius=100.0)
    costs = expected(problem)
    assert {r.visit for r in found} == set(costs)
    for r in found:
        assert r.proven
        assert not r.capped
        assert r.cost == pytest.approx(costs[r.visit], abs=5e-3)
        assert r.regret == pytest.approx(costs[r.visit] - min(costs.values()), abs=5e-3)
    assert [r.regret for r in found] == sorted(r.regret for r in found)


@settings(max_examples=25, deadline=None)
@given(seed=seeds, n=st.integers(3, 11), onboard=st.integers(0, 2), radius=st.floats(0, 4))
def test_within_the_radius_regrets_are_exact_and_beyond_it_true_lower_bounds(seed, n, onboard, radius):
    problem = random_problem(seed, n, onboard)
    exact = {r.visit: r for r in regrets(problem, TABLE)}
    found = regrets(problem, PASS, radius=radius)
    assert len(found) == len(exact)
    for r in found:
        truth = exact[r.visit].regret
        if r.capped:
            assert truth > radius - 1e-3
            assert radius - 1e-3 <= r.regret <= truth + 1e-3
        else:
            assert r.regret == pytest.approx(truth, abs=1e-9)
            assert r.regret <= radius + 1e-9


@settings(max_examples=25, deadline=None)
@given(seed=seeds, n=st.integers(3, 10), onboard=st.integers(0, 2))
def test_the_least_cost_of_each_next_visit_is_a_lower_bound(seed, n, onboard):
    """Also if objects have prices, which are part of the bound."""
    problem = random_problem(seed, n, onboard)
    plan, metric, unit = TABLE.solve(problem), problem.integers.metric, problem.integers.unit
    best = int(tour_length(problem, plan.visits, metric))
    first = first_bound(make_instance(problem, metric), best)
    costs = {r.visit: r.cost for r in regrets(problem, TABLE)}
    for bound in (first, grown(first, best, 1 << 20, Deadline.of(None))):
        least = regret._least(bound, problem)
        assert set(least) == set(costs)
        assert all(bound.root - 1 <= units <= costs[visit] / unit + 1 for visit, units in least.items())


def test_beyond_the_table_the_nearest_alternatives_are_exact():
    problem = random_problem(8, 20, bins=6)
    found = regrets(problem, TABLE, radius=0.5)
    assert found[0].regret == 0
    assert any(r.capped for r in found)
    for r in found[:3]:
        rest = TABLE.solve(after(problem, r.visit))
        truth = problem.distances[0, problem.location(r.visit)] + rest.cost
        if r.capped:
            assert truth >= r.cost - 5e-3
        else:
            assert truth == pytest.approx(r.cost, abs=5e-3)


def test_other_capacities_are_solved_visit_by_visit():
    problem = random_problem(4, 4, 1, capacity=3)
    costs = expected(problem)
    found = regrets(problem, TABLE)
    assert {r.visit for r in found} == set(costs)
    for r in found:
        assert r.cost == pytest.approx(costs[r.visit], abs=5e-3)


def test_regrets_of_other_capacities_start_with_the_best_visit():
    found = regrets(random_problem(4, 4, 1, capacity=3), TABLE)
    assert found[0].regret == 0.0 < found[-1].regret
    assert [r.regret for r in found] == sorted(r.regret for r in found)


def test_other_solvers_cannot_prove_their_regrets():
    problem = random_problem(4, 6)
    costs = expected(problem)
    for r in regrets(problem, solver("greedy")):
        assert not r.proven
        assert r.cost >= costs[r.visit] - 1e-6


def test_a_regret_is_estimated_where_the_best_visit_is_not_proven():
    problem = random_problem(4, 16)
    exact = {r.visit: r for r in regrets(problem, TABLE)}
    found = regrets(problem, PASS, limit=SolveLimit(work=10))
    assert {r.visit for r in found} == set(exact)
    assert not any(r.proven for r in found)
    assert found[0].regret == 0.0 and [r.regret for r in found] == sorted(r.regret for r in found)
    assert all(abs(r.regret - exact[r.visit].regret) < 2.0 for r in found)


def test_equal_visits_have_equal_regrets():
    one = random_problem(2, 5)
    twin = dataclasses.replace(one, shipments=(*one.shipments, one.shipments[2]), names=())
    by_shipment = {twin.number[r.visit.object]: r.regret for r in regrets(twin, TABLE)}
    assert by_shipment[2] == by_shipment[5]


def test_a_pass_that_is_too_large_is_repeated_with_half_the_radius(monkeypatch):
    """The first two passes are made to fail."""
    problem, longest = random_problem(1, 8), []
    first = PASS.solve(problem)

    def limited(*arguments):
        longest.append(arguments[3])
        return (None, 0) if len(longest) <= 2 else costs_by_pass(*arguments)

    monkeypatch.setattr(regret, "costs_by_pass", limited)
    found = regrets(problem, PASS, radius=4.0)
    assert all(r.proven for r in found)
    over = np.array(longest) * problem.integers.unit - first.cost
    assert over == pytest.approx([4.0, 2.0, 1.0], abs=0.01)


def test_a_negative_radius_and_an_impossible_visit_are_refused():
    problem = random_problem(1, 2, 2)
    with pytest.raises(ProblemError, match="radius"):
        regrets(problem, TABLE, radius=-1.0)
    with pytest.raises(ProblemError, match="not possible now"):
        after(problem, problem.pick(0))


def test_regrets_can_be_given_up():
    stop = threading.Event()
    stop.set()
    found = regrets(random_problem(1, 12), PASS, limit=SolveLimit(stop=stop))
    assert len(found) == 12


@pytest.mark.parametrize(
    ("radius", "succeeds", "passes"),
    [
        (1.0, 9, [1.0, 0.5, 0.25, 0.125]),
        (1.0, 2, [1.0, 0.5, 0.25]),
        (0.2, 9, [0.2, 0.1]),
        (0.05, 9, [0.05]),
    ],
)
def test_a_pass_that_is_too_large_is_repeated_with_half_the_radius_down_to_a_tenth_of_a_metre(
    monkeypatch, radius, succeeds, passes
):
    problem = random_problem(1, 9)
    plan, tried = PASS.solve(problem), []
    best = tour_length(problem, plan.visits, problem.integers.metric)

    def attempt(*args):
        tried.append(round((args[3] - best) * problem.integers.unit, 6))
        return costs_by_pass(*args) if len(tried) > succeeds else (None, 7)

    monkeypatch.setattr(regret, "costs_by_pass", attempt)
    found = regrets(problem, PASS, radius=radius, plan=plan)
    assert tried == pytest.approx(passes, abs=1e-3)
    assert {one.proven for one in found} == {len(passes) > succeeds}
