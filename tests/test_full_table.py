"""The full table in plain numpy against the one of the compiled kernels: same numbers, same choice between equals."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from planning_cases import random_problem

from planner.exact import full_table
from planner.exact.full_table import by_table, fill_layers, follow
from planner.exact.groups import alone
from planner.exact.instance import make_instance
from planner.exact.relaxation import fill, walk
from planner.exact.table import new_table

cases = given(
    seed=st.integers(0, 2**32 - 1),
    n=st.integers(0, 8),
    onboard=st.integers(0, 2),
    bins=st.integers(1, 6),
    coincide=st.booleans(),
)


def instance_of(seed, n, onboard, bins, coincide):
    problem = random_problem(seed, n, onboard, bins=bins, coincide=coincide)
    return make_instance(problem, problem.integers.metric)


@settings(max_examples=60, deadline=None)
@cases
def test_numpy_and_the_kernels_fill_in_and_follow_the_same(seed, n, onboard, bins, coincide):
    instance = instance_of(seed, n, onboard, bins, coincide)
    one, other = new_table(instance, alone(n)), new_table(instance, alone(n))
    fill(instance, one)
    fill_layers(instance, other)
    np.testing.assert_array_equal(other.bin, one.bin)
    gone = ~(np.arange(1 << n)[:, None] >> np.arange(n) & 1).astype(bool)  # the others are left undefined
    np.testing.assert_array_equal(other.object[gone], one.object[gone])
    actions = np.empty(2 * n + 2, np.int64)
    length, count = walk(instance, one, (1 << n) - 1, actions)
    assert follow(instance, other, (1 << n) - 1) == (length, actions[:count].tolist())


def test_a_table_is_the_same_before_and_after_the_kernels_are_loaded(monkeypatch):
    instance = instance_of(3, 9, 1, 4, True)
    loaded = by_table(instance)
    monkeypatch.setattr(full_table, "COMPILER", "not loaded")
    assert by_table(instance) == loaded
