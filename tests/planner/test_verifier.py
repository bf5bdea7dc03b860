"""Check that a verifier that shares no code with the solvers confirms exactly the correct proofs."""

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from planner.checker import verify_optimal
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.greedy_solver import GreedySolver
from planner.plan import Certificate, Proof, Status
from planner.problem import RoutingProblem, Shipment
from planner.solvers import SolveLimit
from tests.planning_cases import optimum, random_problem

SEARCH = ExactSolver(table_bytes=0)


@pytest.mark.slow
@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 13),
    onboard=st.integers(0, 2),
    bins=st.integers(1, 12),
    coincide=st.booleans(),
    planar=st.booleans(),
)
def test_what_table_and_search_prove_is_confirmed(seed, n, onboard, bins, coincide, planar):
    problem = random_problem(seed, n, onboard, bins=bins, coincide=coincide, planar=planar)
    for planner in (ExactSolver(), SEARCH):
        plan = planner.solve(problem)
        found = verify_optimal(problem, plan)
        assert found.optimal and not found.why
        assert plan.cost * (1 - 1e-8) <= found.lower_bound <= plan.cost


@pytest.mark.slow
@settings(max_examples=12, deadline=None)
@given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(8, 12),
    onboard=st.integers(0, 2),
    scale=st.sampled_from([1e-9, 1e-3, 1.0, 6e13]),
)
def test_a_longer_tour_that_claims_to_be_optimal_is_refused(seed, n, onboard, scale):
    problem = random_problem(seed, n, onboard)
    problem = dataclasses.replace(problem, distances=problem.distances * scale)
    longer, best = GreedySolver().solve(problem), SEARCH.solve(problem)
    assume(longer.cost > best.cost * 1.002)
    for certificate in (best.certificate, ExactSolver().solve(problem).certificate):
        lie = dataclasses.replace(
            longer, lower_bound=longer.cost, status=Status.OPTIMAL, certificate=certificate
        )
        with pytest.raises(ProblemError, match=r"shorter tour|claims"):
            verify_optimal(problem, lie)


def test_a_bound_that_is_a_little_too_high_is_refused():
    problem = random_problem(5, 14, 1)
    best = SEARCH.solve(problem)
    for excess in (0.05, 1.0):
        lie = dataclasses.replace(
            GreedySolver().solve(problem), lower_bound=best.cost + excess, certificate=best.certificate
        )
        with pytest.raises(ProblemError, match="shorter tour"):
            verify_optimal(problem, lie)
    honest = dataclasses.replace(GreedySolver().solve(problem), lower_bound=best.cost - 0.05,
                                 certificate=best.certificate)  # fmt: skip
    found = verify_optimal(problem, honest)
    assert not found.optimal and not found.why and found.lower_bound > best.cost - 0.06


def test_other_prices_make_more_work_but_no_other_answer():
    problem = random_problem(8, 12, 1)
    plan = SEARCH.solve(problem)
    loose = Certificate(Proof.RELAXATION, 1e-4, -(10**9), (tuple(range(12)),), (0,) * 12)
    found = verify_optimal(problem, dataclasses.replace(plan, certificate=loose))
    assert found.optimal
    assert found.states > verify_optimal(problem, plan).states


def test_what_takes_too_much_is_said_and_not_claimed():
    problem = random_problem(3, 20)
    plan = SEARCH.solve(problem)
    loose = Certificate(Proof.RELAXATION, 1e-4, -(10**9), (tuple(range(20)),), (0,) * 20)
    found = verify_optimal(problem, dataclasses.replace(plan, certificate=loose), max_states=5)
    assert not found.optimal and "states" in found.why
    assert found.lower_bound < plan.cost
    without = verify_optimal(random_problem(3, 14), GreedySolver().solve(random_problem(3, 14)))
    assert not without.optimal


def test_the_bound_of_a_search_that_was_cut_short_is_confirmed():
    problem = random_problem(4, 22)
    plan = SEARCH.solve(problem, limit=SolveLimit(work=20_000))
    assert plan.status is Status.FEASIBLE and 0.8 * plan.cost < plan.lower_bound
    found = verify_optimal(problem, plan)
    assert not found.optimal and not found.why
    assert found.lower_bound == pytest.approx(plan.lower_bound, rel=1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("capacity", [3, 4])
def test_other_capacities_are_verified_by_trying_all(capacity):
    problem = random_problem(2, 8, 2, capacity)
    plan = ExactSolver().solve(problem)  # an optimal tour that OR-Tools cannot prove
    proof = Certificate(Proof.EXHAUSTIVE, problem.integers.unit, 0)
    plan = dataclasses.replace(plan, lower_bound=plan.cost, status=Status.OPTIMAL, certificate=proof)
    found = verify_optimal(problem, plan)
    assert found.optimal and found.states > 0
    longer = GreedySolver().solve(problem)
    assert longer.cost > plan.cost + 0.1
    lie = dataclasses.replace(
        longer, lower_bound=longer.cost, status=Status.OPTIMAL, certificate=plan.certificate
    )
    with pytest.raises(ProblemError, match="shorter tour"):
        verify_optimal(problem, lie)


def test_distances_that_are_no_metric_are_verified_as_given():
    rng = np.random.default_rng(1)
    d = np.triu(rng.uniform(1, 20, (12, 12)), 1)
    problem = RoutingProblem(d + d.T, 0, tuple(Shipment(4 + k, 1 + k % 3) for k in range(6)), (), 2)
    best = optimum(problem)
    plan = ExactSolver().solve(problem)
    assert plan.lower_bound <= best <= plan.cost + 1e-9
    assert verify_optimal(problem, plan).lower_bound == pytest.approx(best)
