"""Full tables, which have one row for every subset of the objects, and the shortest tours in them.

A table is reused for successive states of a task until an object is moved, because it does not depend on the person's
position or the carried objects. It is filled as soon as at most 18 objects remain. Small tables are filled with NumPy
unless numba is already loaded, because loading numba takes 0.5 s.
"""

import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance, to_visits
from planner.exact.moves import moves_of
from planner.exact.table import CostTable, Solution, fill_layers, new_table, walk
from planner.plan import Certificate, Plan, Proof, Visit
from planner.problem import RoutingProblem, make_plan
from planner.solvers import NEVER, Deadline

COMPILER = "numba"
SLICE = 1 << 13  # number of rows filled between two checks of the deadline, which takes about 3 ms
SMALL_TABLE = 1 << 23  # size in bytes of a table for 14 objects and 6 bins; NumPy takes 50 ms, kernels 10 ms


def full_table_bytes(inst: Instance) -> int:
    """Return the approximate size of a full table with int32 entries."""
    n, m = inst.to_bin.shape
    return int(8 * (m * m + n) << n)


def by_table(inst: Instance, deadline: Deadline = NEVER) -> list[Solution]:
    """Return a shortest tour, or no tour if the deadline passes first."""
    table = filled_table(inst, deadline)
    if table is None:
        return []
    length, actions = follow(inst, table, len(table.bin) - 1)
    return [Solution(actions, length, Certificate(Proof.FULL_TABLE, inst.unit, length))]


def filled_table(inst: Instance, deadline: Deadline = NEVER) -> CostTable | None:
    table = new_table(inst, np.arange(len(inst.home)))
    if COMPILER not in sys.modules and full_table_bytes(inst) <= SMALL_TABLE:
        fill_layers(inst, table)
        return table
    from planner.exact.table_kernels import fill_rows  # imported here because it loads numba

    for first in range(0, len(table.bin), SLICE):
        if deadline.over():
            return None
        fill_rows(inst, table, first, min(first + SLICE, len(table.bin)))
    return table


def follow(inst: Instance, table: CostTable, row: int) -> tuple[int, list[int]]:
    """Return the length and the actions of a shortest tour in a full table.

    `row` is the table row of the objects that remain at the start.
    """
    actions: NDArray[np.int64] = np.empty(2 * len(inst.home) + 2, np.int64)
    if COMPILER in sys.modules:
        from planner.exact.table_kernels import walk as compiled_walk

        length, count = compiled_walk(moves_of(inst), table, row, actions)
    else:
        length, count = walk(moves_of(inst), table, row, actions)
    return int(length), actions[:count].tolist()


class TableState(NamedTuple):
    """A task state as a row of a full table. The root of the instance is the person's current position."""

    instance: Instance
    table: CostTable
    row: int
    names: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class _Filled:
    problem: RoutingProblem
    instance: Instance
    table: CostTable


class TaskTable:
    """A cache of a full table, which is kept until an object is moved.

    `tabled` returns the arrays of a problem that a full table can solve, or None, as `ExactSolver.tabled` does.
    """

    def __init__(self, tabled: Callable[[RoutingProblem], Instance | None]) -> None:
        self._tabled = tabled
        self._filled: _Filled | None = None

    def plan(self, problem: RoutingProblem) -> Plan | None:
        """Return a plan that is proven optimal, or None if no full table can be used for the problem."""
        started = time.perf_counter()
        state = self._at(problem)
        if state is None:
            return None
        length, actions = follow(state.instance, state.table, state.row)
        visits = to_visits(state.instance, actions, state.names, problem.names[len(problem.shipments) :])
        certificate = Certificate(Proof.FULL_TABLE, state.instance.unit, length)
        return make_plan(problem, visits, length, length, started, certificate)

    def costs(self, problem: RoutingProblem) -> tuple[dict[Visit, int], float] | None:
        """Return the cost of each possible next visit in units, and the unit in metres.

        A cost is the length of the remaining tour. The result is None if no full table can be used.
        """
        from planner.exact.table_regret import costs_in  # imported here because it loads the kernels

        state = self._at(problem)
        if state is None:
            return None
        carried, moves = problem.names[len(problem.shipments) :], moves_of(state.instance)
        return costs_in(moves, state.table, state.row, state.names, carried), state.instance.unit

    def _at(self, problem: RoutingProblem) -> TableState | None:
        state = _state(self._filled, problem) if self._filled is not None else None
        if state is not None:
            return state
        instance = self._tabled(problem)
        if instance is None:
            return None
        self._filled = _Filled(problem, instance, cast(CostTable, filled_table(instance)))
        return _state(self._filled, problem)


def _state(filled: _Filled, problem: RoutingProblem) -> TableState | None:
    """Return the state of a problem in an existing table, or None if the table does not contain it."""
    before, n = filled.problem, len(problem.shipments)
    same_kind = (problem.capacity, problem.resolution) == (before.capacity, before.resolution)
    if not same_kind or not set(problem.names) <= set(before.names):
        return None
    left = [before.number[name] for name in problem.names[:n]]
    if any(k >= len(before.shipments) for k in left):
        return None  # an object that is loose now was carried when the table was filled
    here, there = (each.stops(problem.visits)[1:] for each in (problem, before))
    if not np.array_equal(problem.distances[np.ix_(here, here)], before.distances[np.ix_(there, there)]):
        return None  # an object was moved
    # Lengths of shortest paths from the start to the location of each visit, via locations that the table contains
    metric = before.integers.metric[np.ix_(there, there)]
    direct = np.rint(problem.distances[problem.start, here] / before.integers.unit).astype(np.int64)
    legs = (direct[:, None] + metric).min(axis=0, initial=FAR)
    bins = sorted({s.delivery for s in before.shipments} | set(before.onboard))
    bin_of = [bins.index(location) for location in there[n:]]
    root, root_bin = np.full_like(filled.instance.root, FAR), np.full_like(filled.instance.root_bin, FAR)
    if len(problem.onboard) < problem.capacity:
        root[left] = legs[:n]
    root_bin[bin_of] = legs[n:]
    carried = np.array(bin_of[n:], dtype=np.int64)
    instance = filled.instance._replace(root=root, root_bin=root_bin, carried=carried)
    names = before.names[: len(before.shipments)]
    return TableState(instance, filled.table, sum(1 << k for k in left), names)
