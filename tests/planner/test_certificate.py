"""Check that certificates prove lower bounds, and that plans never get worse during a search."""

import dataclasses
import itertools
import threading

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem

from planner.checker import check, verify_optimal
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.plan import Certificate, Proof, Status
from planner.solvers import SOLVERS, SolveLimit, solver

seeds = st.integers(0, 2**32 - 1)
SEARCH = ExactSolver(table_bytes=0)


def claiming(plan, **changes):
    return dataclasses.replace(plan, certificate=dataclasses.replace(plan.certificate, **changes))


@settings(max_examples=20, deadline=None)
@given(seed=seeds, n=st.integers(8, 11), onboard=st.integers(0, 2))
def test_any_groups_at_any_price_bound_the_optimum(seed, n, onboard):
    problem = random_problem(seed, n, onboard)
    plan = solver("exact").solve(problem)
    assert plan.certificate.proof is Proof.FULL_TABLE
    assert check(problem, plan) == pytest.approx(plan.cost, rel=1e-9)
    rng = np.random.default_rng(seed)
    labels = rng.integers(0, 4, n)
    groups = tuple(tuple(np.flatnonzero(labels == g).tolist()) for g in sorted(set(labels)))
    prices = tuple(int(p) for p in rng.integers(-20_000, 40_000, n))
    relaxed = Certificate(Proof.RELAXATION, 1e-4, -(10**9), groups, prices)
    assert check(problem, dataclasses.replace(plan, certificate=relaxed)) <= plan.cost + 1e-6


@settings(max_examples=15, deadline=None)
@given(seed=seeds, n=st.integers(8, 14), onboard=st.integers(0, 2))
def test_the_relaxation_of_the_search_is_found_again(seed, n, onboard):
    problem = random_problem(seed, n, onboard)
    plan = SEARCH.solve(problem)
    certificate = plan.certificate
    assert certificate.proof is Proof.RELAXATION
    derived = check(problem, plan)
    assert derived == pytest.approx(certificate.root * certificate.unit)
    assert derived <= plan.lower_bound * (1 + 1e-9)


@pytest.mark.parametrize("judge", [check, verify_optimal])
@pytest.mark.parametrize("planner", [solver("exact"), SEARCH, solver("greedy")])
def test_a_proof_that_yields_less_than_it_claims_is_refused(planner, judge):
    problem = random_problem(3, 10)
    plan = planner.solve(problem)
    judge(problem, plan)
    with pytest.raises(ProblemError, match="claims"):
        judge(problem, claiming(plan, root=plan.certificate.root + round(0.01 / plan.certificate.unit)))
    if planner.name == "greedy":
        with pytest.raises(ProblemError, match="lower bound claims"):
            judge(problem, dataclasses.replace(plan, lower_bound=plan.cost))


ALL = tuple(range(10))


@pytest.mark.parametrize("judge", [check, verify_optimal])
@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"multipliers": (0,) * 10, "groups": (ALL,)}, "claims"),
        ({"multipliers": (0,) * 9}, "does not fit"),
        ({"groups": (ALL[:9], (10,))}, "does not fit"),
        ({"groups": (ALL[1:],)}, "does not fit"),
        ({"groups": (ALL, (0,))}, "does not fit"),
        ({"groups": (ALL, ())}, "does not fit"),
        ({"unit": 1e9}, "too large"),
    ],
)
def test_a_relaxation_that_fits_badly_is_refused(changes, fault, judge):
    problem = random_problem(3, 10)
    with pytest.raises(ProblemError, match=fault):
        judge(problem, claiming(SEARCH.solve(problem), **changes))


def test_a_false_bound_is_found_out_without_a_certificate():
    problem = random_problem(1, 6)
    best = solver("exact").solve(problem)
    worse = solver("greedy").solve(problem)
    assert worse.cost > best.cost + 0.1
    lie = dataclasses.replace(worse, lower_bound=worse.cost, status=Status.OPTIMAL, certificate=None)
    with pytest.raises(ProblemError, match="lower bound claims"):
        check(problem, lie)


def test_what_cannot_be_derived_is_not_claimed_by_the_checker():
    problem = random_problem(1, 12)
    plan = dataclasses.replace(solver("exact").solve(problem), certificate=None)
    assert check(problem, plan) == 0


@pytest.mark.parametrize(
    ("planner", "n", "work"),
    [
        (solver("exact"), 10, None),
        (SEARCH, 14, None),
        (SEARCH, 20, 100_000),
        (solver("ortools"), 8, 30),
        (solver("greedy"), 8, None),
    ],
)
def test_plans_only_get_better_and_end_with_the_solution(planner, n, work):
    problem, limit = random_problem(5, n, 1), SolveLimit(work=work, stop=threading.Event())
    plans = list(planner.improve(problem, seed=1, limit=limit))
    solution = planner.solve(problem, seed=1, limit=limit)
    for plan in plans:
        check(problem, plan)
    for earlier, later in itertools.pairwise(plans):
        assert later.improves_on(earlier)
        assert later.cost <= earlier.cost + 1e-9
        assert later.lower_bound >= earlier.lower_bound - 1e-9
    assert (plans[-1].cost, plans[-1].lower_bound) == pytest.approx((solution.cost, solution.lower_bound))
    if planner.name == "exact":
        assert plans[-1].visits == solution.visits
    assert plans[0].certificate is not None


def test_the_exact_planner_answers_first_with_a_tour_that_is_not_yet_proven():
    first, *others = SEARCH.improve(random_problem(2, 20))
    assert first.status is Status.FEASIBLE
    assert others[-1].status is Status.OPTIMAL


def test_capacities_above_two_have_an_anytime_form_too():
    problem = random_problem(7, 5, capacity=3)
    plans = list(solver("exact").improve(problem))
    assert check(problem, plans[-1]) == pytest.approx(min(plan.cost for plan in plans), rel=1e-9)
    assert plans[-1].certificate.proof is Proof.SPANNING_TREE


@pytest.mark.parametrize("name", SOLVERS)
def test_hardly_any_time_still_gives_a_plan(name):
    problem = random_problem(4, 24)
    check(problem, solver(name).solve(problem, limit=SolveLimit(seconds=1e-6)))


@pytest.mark.parametrize("planner", [SEARCH, solver("ortools")])
def test_a_stopped_solver_still_hands_out_its_first_plan(planner):
    stop = threading.Event()
    stop.set()
    problem = random_problem(2, 20)
    (plan,) = planner.improve(problem, limit=SolveLimit(stop=stop))
    check(problem, plan)
