"""Check that bounds and tours of earlier task states hold for later states."""

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import expected, random_problem

from planner.exact.solver import ExactSolver
from planner.exact.task_search import rest_of
from planner.problem import after, possible_next, tour_length


def later_states(problem, rng):
    """Return a later state, in which the person may stand elsewhere and an object may have been moved."""
    for _ in range(rng.integers(4)):
        options = list(possible_next(problem))
        problem = after(problem, options[rng.integers(len(options))]) if options else problem
    if rng.random() < 0.5:
        problem = dataclasses.replace(problem, start=int(rng.integers(len(problem.distances))))
    if rng.random() < 0.3:
        distances, k = problem.distances.copy(), int(rng.integers(len(problem.distances)))
        distances[k] = distances[:, k] = distances[int(rng.integers(len(distances)))]
        np.fill_diagonal(distances, 0.0)
        problem = dataclasses.replace(problem, distances=distances)
    return problem


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 2**32 - 1))
def test_a_bound_for_an_earlier_state_bounds_all_later_ones(seed):
    rng = np.random.default_rng(seed)
    problem = random_problem(seed, int(rng.integers(2, 7)), seed % 3)
    later = later_states(problem, rng)
    rest, lower = rest_of(problem, ExactSolver().solve(problem), later)
    assert lower <= expected(later) * later.integers.unit + 1e-6
    assert rest is None or set(rest) == set(later.visits)


@given(seed=st.integers(0, 2**32 - 1))
def test_the_rest_of_a_followed_plan_keeps_its_whole_bound(seed):
    problem = random_problem(seed, 5, seed % 3)
    plan = ExactSolver().solve(problem)
    later, done = problem, int(np.random.default_rng(seed).integers(len(plan.visits)))
    for visit in plan.visits[:done]:
        later = after(later, visit)
    rest, lower = rest_of(problem, plan, later)
    assert rest == plan.visits[done:]
    assert np.isclose(lower, tour_length(later, rest))


def test_a_deviation_costs_its_way():
    problem = random_problem(1, 5)
    plan = ExactSolver().solve(problem)
    far = max(problem.visits[:5], key=lambda visit: problem.distances[problem.start, problem.location(visit)])
    later = after(problem, far)
    rest, lower = rest_of(problem, plan, later)
    assert rest is None
    assert np.isclose(lower, plan.cost - problem.distances[problem.start, problem.location(far)])
    assert rest_of(later, ExactSolver().solve(later), problem) == (None, 0.0)
