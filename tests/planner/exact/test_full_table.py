"""Compare the full table in NumPy with the compiled kernels: values and tie-breaking must be equal."""

import dataclasses

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem

from planner.exact import full_table
from planner.exact.full_table import by_table
from planner.exact.instance import FAR, make_instance
from planner.exact.moves import moves_of
from planner.exact.solver import ExactSolver
from planner.exact.table import fill_layers, new_table, walk
from planner.exact.table_kernels import fill
from planner.exact.table_kernels import walk as compiled_walk
from planner.plan import Status
from planner.solvers import Deadline, SolveLimit

cases = given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 9),  # the kernels process eight objects of a bin, and eight bins, at a time
    onboard=st.integers(0, 2),
    bins=st.integers(1, 10),
    coincide=st.booleans(),
)


def instance_of(seed, n, onboard, bins, coincide):
    problem = random_problem(seed, n, onboard, bins=bins, coincide=coincide)
    return make_instance(problem, problem.integers.metric)


@settings(max_examples=60, deadline=None)
@cases
def test_numpy_and_the_kernels_fill_in_and_follow_the_same(seed, n, onboard, bins, coincide):
    instance = instance_of(seed, n, onboard, bins, coincide)
    one, other = new_table(instance, np.arange(n)), new_table(instance, np.arange(n))
    fill(instance, one)
    fill_layers(instance, other)
    np.testing.assert_array_equal(other.bin, one.bin)
    gone = ~(np.arange(1 << n)[:, None] >> np.arange(n) & 1).astype(bool)  # the other values are undefined
    np.testing.assert_array_equal(other.object[gone], one.object[gone])
    actions, plain = np.empty(2 * n + 2, np.int64), np.empty(2 * n + 2, np.int64)
    length, count = compiled_walk(moves_of(instance), one, (1 << n) - 1, actions)
    assert walk(moves_of(instance), other, (1 << n) - 1, plain) == (length, count)
    np.testing.assert_array_equal(plain[:count], actions[:count])


def test_a_table_is_the_same_before_and_after_the_kernels_are_loaded(monkeypatch):
    instance = instance_of(3, 9, 1, 4, True)
    loaded = by_table(instance)
    monkeypatch.setattr(full_table, "COMPILER", "not loaded")
    assert by_table(instance) == loaded


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 8), groups=st.integers(1, 8))
def test_a_table_is_the_same_whether_its_numbers_fit_in_32_bits_or_not(seed, n, groups):
    rng = np.random.default_rng(seed)
    problem = dataclasses.replace(random_problem(seed, n, bins=5), resolution=1e-4)
    narrow = make_instance(problem, problem.integers.metric)
    scale = 1 << 24
    legs = {name: getattr(narrow, name) * scale for name in ("to_bin", "bins", "root", "root_bin")}
    between = np.where(narrow.between < FAR, narrow.between * scale, FAR)
    wide = narrow._replace(**legs, between=between)
    group = np.unique(rng.integers(0, groups, n), return_inverse=True)[1]
    prices = rng.integers(-20_000, 40_000, n)
    one, other = new_table(narrow, group), new_table(wide, group)
    one.multipliers[:], other.multipliers[:] = prices, prices * scale
    assert (one.entries.dtype, other.entries.dtype) == (np.int32, np.int64)
    fill(narrow, one)
    fill(wide, other)
    np.testing.assert_array_equal(one.bin.astype(np.int64) * scale, other.bin)
    rows = np.arange(len(one.bin))
    for j in range(n):
        some_picked = rows // one.stride[j] % (one.size[group[j]] + 1) < one.size[group[j]]
        np.testing.assert_array_equal(
            one.object[some_picked, j].astype(np.int64) * scale, other.object[some_picked, j]
        )


def test_a_table_is_given_up_when_time_is_over():
    problem = random_problem(0, 10)
    assert by_table(make_instance(problem, problem.integers.metric), Deadline(0.0)) == []
    plan = ExactSolver().solve(random_problem(0, 18), limit=SolveLimit(seconds=1e-3))
    assert plan.status is Status.FEASIBLE


def test_a_time_limit_that_suffices_leaves_the_proof_of_the_table():
    problem = random_problem(0, 16)
    limited, plan = ExactSolver().solve(problem, limit=SolveLimit(seconds=1e3)), ExactSolver().solve(problem)
    assert (limited.visits, limited.certificate) == (plan.visits, plan.certificate)
    assert limited.status is Status.OPTIMAL
