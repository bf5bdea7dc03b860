"""Fill full tables, which have one row for every subset of the objects, and find shortest tours in them.

Small tables are filled with NumPy unless numba is already loaded, because loading numba takes 0.5 s.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import Instance
from planner.exact.moves import moves_of
from planner.exact.table import CostTable, Solution, fill_layers, new_table, walk
from planner.plan import Certificate, Proof
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
