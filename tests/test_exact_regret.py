"""Regrets of next visits against all permutations, and the exact planner inside a live task."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem

from planner.errors import ProblemError
from planner.geodesics import Geodesics
from planner.navmesh import NavMesh
from planner.plan import Status, VisitKind
from planner.regret import after, regrets
from planner.replanner import Replanner
from planner.route import TaskState
from planner.solver import solver


def best_by_first_stop(problem):
    """Least length over all orders of stops, for each first stop; stops are (kind, index)."""
    n, m = len(problem.shipments), len(problem.onboard)
    stops = [("pick", k) for k in range(n)] + [("place", k) for k in range(n)]
    stops += [("onboard", k) for k in range(m)]
    best = {}
    for order in itertools.permutations(stops):
        load, here, length = m, problem.start, 0.0
        for t, (kind, k) in enumerate(order):
            if kind == "place" and ("pick", k) not in order[:t]:
                break
            load += 1 if kind == "pick" else -1
            if load > 2:
                break
            at = {
                "pick": lambda k: problem.shipments[k].pickup,
                "place": lambda k: problem.shipments[k].delivery,
                "onboard": lambda k: problem.onboard[k],
            }[kind](k)
            length += problem.distances[here, at]
            here = at
        else:
            best[order[0]] = min(best.get(order[0], np.inf), length)
    return best


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), shipments=st.integers(1, 3), onboard=st.integers(0, 1))
def test_regrets_are_those_of_all_orders(seed, shipments, onboard):
    problem = random_problem(seed, shipments, onboard)
    found = regrets(problem, solver("exact"))
    expected = best_by_first_stop(problem)
    assert len(found) == len(expected)
    for regret in found:
        name = "pick" if regret.visit.kind is VisitKind.PICK else "onboard"
        index = problem.number[regret.visit.object] - (0 if name == "pick" else len(problem.shipments))
        assert regret.proven
        assert regret.cost == pytest.approx(expected[name, index], abs=5e-3)
        assert regret.regret == pytest.approx(expected[name, index] - min(expected.values()), abs=5e-3)
    assert [r.regret for r in found] == sorted(r.regret for r in found)


def test_the_best_next_visit_costs_what_the_plan_costs():
    problem = random_problem(1, 10, 1)
    plan, best = solver("exact").solve(problem), regrets(problem, solver("exact"))[0]
    assert best.regret == 0
    assert best.cost == pytest.approx(plan.cost, abs=5e-3)


def test_a_visit_that_is_not_possible_is_refused():
    problem = random_problem(1, 2, 2)
    with pytest.raises(ProblemError, match="not possible now"):
        after(problem, problem.pick(0))


def test_an_optimal_plan_stays_optimal_while_it_is_followed():
    rng = np.random.default_rng(4)
    walls = [
        np.array([(3.9, 0), (4.1, 0), (4.1, 5), (3.9, 5)]),
        np.array([(3, 6.4), (6, 6.4), (6, 6.6), (3, 6.6)]),
    ]
    mesh = NavMesh.build(walls, (0, 0, 8, 8))
    guide = Replanner(Geodesics(mesh), solver("exact"))
    loose = {f"object_{k}": tuple(map(float, mesh.sample(rng))) for k in range(9)}
    bins = [tuple(map(float, mesh.sample(rng))) for _ in range(3)]
    deliveries = {name: bins[k % 3] for k, name in enumerate(loose)}
    position, carried = tuple(map(float, mesh.sample(rng))), []
    while loose or carried:
        state = TaskState(position, dict(loose), tuple(carried), deliveries)
        route = guide.update(state)
        anew = solver("exact").solve(guide.problems.problem(state))
        assert anew.status is Status.OPTIMAL
        left = guide.problems.length(state, route.visits)
        assert left == pytest.approx(anew.cost, abs=5e-3)
        kind, name = route.next
        if kind is VisitKind.PICK:
            position = loose.pop(name)
            carried.append(name)
        else:
            position = deliveries[name]
            carried.remove(name)
    assert guide.replans == 0


def test_nothing_left_leaves_nothing_to_regret():
    assert regrets(random_problem(0, 0, 0), solver("exact")) == ()
