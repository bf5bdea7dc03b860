"""Cost-to-go tables over subsets: exact ones, and relaxed ones that bound it from below.

States, with U the objects not yet picked and c_j the bin of j: E(U, b) at bin b with empty hands; V(U, b, d) at
bin b carrying one object for d, with V(U, d, d) = E(U, d); Y(U, i) at object i holding only it; W(U, j, d) at
object j holding it and one for d. Leaving what belongs here is free and always right in a metric.

    W(U, j, d) = min( D(j, d) + V(U, d, c_j),  D(j, c_j) + V(U, c_j, d) )
    V(U, b, d) = min( D(b, d) + E(U, d),       min_{j in U} D(b, j) + W(U - j, j, d) )
    Y(U, i)    = min( D(i, c_i) + E(U, c_i),   min_{j in U} D(i, j) + W(U - j, j, c_i) )
    E(U, b)    = min_{i in U} D(b, i) + Y(U - i, i);    E({}, b) = 0

The relaxation (Christofides, Mingozzi and Toth 1981) puts objects into groups and keeps of each group only how
many are left; any of a group may then be picked, though none twice in a row. Each pick of j costs a multiplier
more; subtracting the multipliers of U gives a lower bound of the cost-to-go from every U, for any multipliers and
groups. With each object in a group of its own and no multipliers the table is exact.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance

SPARE = 8  # entries behind the last row: kernels read and write so many at a time
# Units of the longest leg, and of a price, with which tours of 40 objects fit in int32, and in int64.
LONGEST_32, DEAREST_32, DEAREST_64 = 1 << 21, 1 << 23, 1 << 53
INFINITE = 1 << 60  # longer than any sum of lengths


class Table(NamedTuple):
    """Cost-to-go of the relaxed problem, multipliers of picks included; a row for each way to be left of the groups.

    Row r has r / (number of rows of all groups before) mod (size + 1) of a group left. Where every object is a group
    of its own, the row is the subset of the objects left.

    Entries are int32 where all sums fit in, else int64.

    Attributes:
        group: Group of each object, numbered from 0, (n,) int64.
        size: How many objects each group has, (groups,) int64.
        stride: By how many rows picking an object goes down, (n,) int64.
        entries: Of each row, V(., b, d) and then V(., d, b) for all d, for one b after the other, then Y; flat, with
            `SPARE` more at the end.
        bin: E and V, (rows, m, m), entry [b, d]; a view of the entries.
        object: Y, (rows, n), a view of the entries; only where not all of the group of object i are left.
        multipliers: Price of a pick, (n,) int64.
        dearest: The largest multiplier, and minus it the smallest, that the entries have room for.
    """

    group: NDArray[np.int64]
    size: NDArray[np.int64]
    stride: NDArray[np.int64]
    entries: NDArray[np.integer[Any]]
    bin: NDArray[np.integer[Any]]
    object: NDArray[np.integer[Any]]
    multipliers: NDArray[np.int64]
    dearest: int


def rows_of(group: NDArray[np.int64]) -> int:
    """How many rows the table has, by the group of each object, (n,)."""
    return math.prod(int(k) + 1 for k in np.bincount(group))


def new_table(inst: Instance, group: NDArray[np.int64]) -> Table:
    """An unfilled table with no multipliers.

    Args:
        inst: The instance.
        group: Group of each object, numbered from 0, (n,).
    """
    n, m = inst.to_bin.shape
    size = np.bincount(group).astype(np.int64)
    below = np.ones(len(size) + 1, np.int64)
    below[1:] = np.cumprod(size + 1)
    rows, width, narrow = int(below[-1]), 2 * m * m + n, _longest(inst) <= LONGEST_32
    entries = np.empty(rows * width + SPARE, np.int32 if narrow else np.int64)
    table = entries[: rows * width].reshape(rows, width)
    return Table(
        group,
        size,
        below[:-1][group] if n else group,
        entries,
        table[:, : 2 * m * m].reshape(rows, m, 2 * m)[:, :, :m],
        table[:, 2 * m * m :],
        np.zeros(n, np.int64),
        DEAREST_32 if narrow else DEAREST_64,
    )


def _longest(inst: Instance) -> int:
    """The longest leg between objects and bins, units."""
    longest = max(legs.max(initial=0) for legs in (inst.to_bin, inst.from_bin, inst.bins))
    return int(np.where(inst.between < FAR, inst.between, 0).max(initial=longest))


def table_bytes(inst: Instance, rows: int) -> int:
    """Memory of a table in int32, about."""
    n, m = inst.to_bin.shape
    return int(8 * (m * m + n) * rows)
