"""The full table, which holds every subset of the objects: it is filled, and a shortest tour followed in it.

Small tables are filled by numpy where numba, which takes 0.5 s to load, is not loaded.
"""

import sys

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.exact.instance import Instance
from planner.exact.table import Solution, Table, fill_layers, new_table, walk

COMPILER = "numba"
SMALL_TABLE = 1 << 23  # bytes, 14 objects and 6 bins: filled in 10 ms by kernels, in 50 by numpy


def full_table_bytes(inst: Instance) -> int:
    """Memory of the full table in int32, about."""
    n, m = inst.to_bin.shape
    return int(8 * (m * m + n) << n)


def by_table(inst: Instance) -> Solution:
    """Fill the full table and follow a shortest tour."""
    table = filled_table(inst)
    length, actions = follow(inst, table, len(table.bin) - 1)
    return Solution(actions, length, Certificate(Proof.FULL_TABLE, inst.unit, length))


def filled_table(inst: Instance) -> Table:
    """The full table."""
    table = new_table(inst, np.arange(len(inst.home)))
    if COMPILER in sys.modules or full_table_bytes(inst) > SMALL_TABLE:
        from planner.exact.table_kernels import fill  # loaded only where it is needed

        fill(inst, table)
    else:
        fill_layers(inst, table)
    return table


def follow(inst: Instance, table: Table, row: int) -> tuple[int, list[int]]:
    """Length of a shortest tour by a full table, and its actions as in `Solution`; `row` is that of the root."""
    actions: NDArray[np.int64] = np.empty(2 * len(inst.home) + 2, np.int64)
    if COMPILER in sys.modules:
        from planner.exact.table_kernels import walk as compiled_walk  # loaded only where it is needed

        length, count = compiled_walk(inst, table, row, actions)
    else:
        length, count = walk(inst, table, row, actions)
    return int(length), actions[:count].tolist()
