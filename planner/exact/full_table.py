"""Fill full tables, which have one row for every subset of the objects, and find shortest tours in them.

Small tables are filled with NumPy unless numba is already loaded, because loading numba takes 0.5 s.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import Instance
from planner.exact.table import CostTable, Solution, fill_layers, new_table, walk
from planner.plan import Certificate, Proof

COMPILER = "numba"
SMALL_TABLE = 1 << 23  # size in bytes of a table for 14 objects and 6 bins; NumPy takes 50 ms, kernels 10 ms


def full_table_bytes(inst: Instance) -> int:
    """Return the approximate size of a full table with int32 entries."""
    n, m = inst.to_bin.shape
    return int(8 * (m * m + n) << n)


def by_table(inst: Instance) -> Solution:
    table = filled_table(inst)
    length, actions = follow(inst, table, len(table.bin) - 1)
    return Solution(actions, length, Certificate(Proof.FULL_TABLE, inst.unit, length))


def filled_table(inst: Instance) -> CostTable:
    table = new_table(inst, np.arange(len(inst.home)))
    if COMPILER in sys.modules or full_table_bytes(inst) > SMALL_TABLE:
        from planner.exact.table_kernels import fill  # imported here because it loads numba

        fill(inst, table)
    else:
        fill_layers(inst, table)
    return table


def follow(inst: Instance, table: CostTable, row: int) -> tuple[int, list[int]]:
    """Return the length and the actions of a shortest tour in a full table.

    `row` is the table row of the objects that remain at the start.
    """
    actions: NDArray[np.int64] = np.empty(2 * len(inst.home) + 2, np.int64)
    if COMPILER in sys.modules:
        from planner.exact.table_kernels import walk as compiled_walk

        length, count = compiled_walk(inst, table, row, actions)
    else:
        length, count = walk(inst, table, row, actions)
    return int(length), actions[:count].tolist()
