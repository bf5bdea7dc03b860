"""Check that the plan checker accepts all valid proofs and rejects all false bounds."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import optimum, random_problem

from planner import checker
from planner.checker import allowance, check
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.greedy_solver import GreedySolver
from planner.plan import Proof, Status

SOLVERS = (ExactSolver(), ExactSolver(table_bytes=0), GreedySolver())
CAPACITIES = st.integers(1, 4)
RESOLUTIONS = st.sampled_from([None, 0.001, 0.1])


def problem_of(seed, n, capacity, resolution, onboard=0):
    made = random_problem(seed, n, min(onboard, capacity), capacity, bins=3)
    return dataclasses.replace(made, resolution=resolution)


def claim(plan, lower_bound):
    """Return a plan with another lower bound and no certificate."""
    status = Status.OPTIMAL if lower_bound >= plan.cost else Status.FEASIBLE
    return dataclasses.replace(plan, lower_bound=lower_bound, status=status, certificate=None)


@pytest.mark.slow
@settings(max_examples=40, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(5, 8),
    capacity=CAPACITIES,
    resolution=RESOLUTIONS,
    onboard=st.integers(0, 2),
)
def test_no_true_proof_is_refused_and_no_derived_bound_is_above_the_optimum(
    seed, n, capacity, resolution, onboard
):
    problem = problem_of(seed, n, capacity, resolution, onboard)
    best = optimum(problem)
    for solver in SOLVERS:
        plan = solver.solve(problem)
        derived = check(problem, plan)
        assert derived <= best + allowance(problem, plan)
        everything = n + len(problem.onboard) <= 7
        if everything:
            assert derived == pytest.approx(best, abs=1e-6)
        proof = plan.certificate.proof
        if not everything and capacity <= 2 and proof in (Proof.FULL_TABLE, Proof.RELAXATION):
            assert derived + allowance(problem, plan) >= plan.certificate.root * plan.certificate.unit > 0.0


@pytest.mark.slow
@settings(max_examples=30, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(6, 7), capacity=CAPACITIES, resolution=RESOLUTIONS)
def test_a_bound_above_the_optimum_is_refused_up_to_seven_objects(seed, n, capacity, resolution):
    """The bound is rejected only if rounding cannot explain the excess."""
    problem = problem_of(seed, n, capacity, resolution)
    best, longer = optimum(problem), GreedySolver().solve(problem)
    slack = problem.tolerance(longer.cost) + 2 * (resolution or 0.0)
    if longer.cost < best + 1.2 * slack + 1e-6:
        return
    check(problem, claim(longer, best + 0.9 * slack))
    if resolution:
        check(problem, claim(longer, best + slack - resolution))
    with pytest.raises(ProblemError, match="lower bound claims"):
        check(problem, claim(longer, best + 1.1 * slack + 1e-7))
    with pytest.raises(ProblemError, match="lower bound claims"):
        check(problem, claim(longer, longer.cost))


@pytest.mark.parametrize("objects", [7, 8])
def test_beyond_seven_objects_nothing_is_derived_without_a_certificate(objects):
    plan = GreedySolver().solve(random_problem(5, objects))
    lie = claim(plan, plan.cost)
    assert optimum(random_problem(5, objects)) < plan.cost - 0.01
    if objects == 8:
        assert check(random_problem(5, objects), lie) == 0.0
    else:
        with pytest.raises(ProblemError, match="lower bound claims"):
            check(random_problem(5, objects), lie)


@pytest.mark.parametrize("capacity", [1, 2])
@pytest.mark.parametrize(("solver", "rows"), [(ExactSolver(), 2**8), (ExactSolver(table_bytes=0), None)])
def test_a_table_is_filled_up_to_and_including_the_limit(capacity, solver, rows, monkeypatch):
    problem = random_problem(4, 8, capacity=capacity)
    plan = solver.solve(problem)
    certificate = plan.certificate
    rows = rows or int(np.prod([len(group) + 1 for group in certificate.groups]))
    false = dataclasses.replace(certificate, root=certificate.root + round(0.01 / certificate.unit))
    lie = dataclasses.replace(plan, certificate=false)
    monkeypatch.setattr(checker, "CHECK_ROWS", rows)
    assert check(problem, plan) == pytest.approx(certificate.root * certificate.unit)
    with pytest.raises(ProblemError, match="certificate's root claims"):
        check(problem, lie)
    monkeypatch.setattr(checker, "CHECK_ROWS", rows - 1)
    assert check(problem, plan) == check(problem, lie) == 0.0


@pytest.mark.parametrize("capacity", [3, 4])
def test_tables_for_more_than_two_hands_are_not_derived(capacity):
    problem = random_problem(4, 8, capacity=capacity)
    two = ExactSolver().solve(dataclasses.replace(problem, capacity=2))
    assert two.certificate.proof is Proof.FULL_TABLE
    assert check(problem, two) == 0.0


@pytest.mark.parametrize("resolution", [None, 0.05])
def test_a_root_is_refused_where_rounding_does_not_explain_it(resolution):
    problem = problem_of(9, 9, 2, resolution)
    plan = GreedySolver().solve(problem)
    certificate = plan.certificate
    assert certificate.proof is Proof.SPANNING_TREE
    derived = check(problem, dataclasses.replace(plan, lower_bound=0.0))
    slack = allowance(problem, plan)
    for share in (0.9, 1.1):
        root = round((derived + share * slack) / certificate.unit) + (share > 1)
        other = dataclasses.replace(
            plan, lower_bound=0.0, certificate=dataclasses.replace(certificate, root=root)
        )
        if share < 1:
            check(problem, other)
        else:
            with pytest.raises(ProblemError, match="certificate's root claims"):
                check(problem, other)
