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

This module needs numpy alone; `planner.exact.table_kernels` fills in the same numbers.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate
from planner.exact.instance import FAR, Instance

BIN_ROWS = 50_000  # of a table that counts objects by bin: 30 objects and 6 bins
SPARE = 8  # entries behind the last row: kernels read eight at a time
# Units of the longest leg, and of a price, with which tours of 40 objects fit in int32, and in int64.
LONGEST_32, DEAREST_32, DEAREST_64 = 1 << 21, 1 << 23, 1 << 53
INFINITE = 1 << 60  # longer than any sum of lengths


class Table(NamedTuple):
    """Cost-to-go of the relaxed problem, multipliers of picks included; a row for each way to be left of the groups.

    Row r has r / (number of rows of all groups before) mod (size + 1) of a group left. Where every object is a group
    of its own, the row is the subset of the objects left. Entries are int32 where all sums fit in, else int64.
    """

    group: NDArray[np.int64]  # group of each object, numbered from 0, (n,) int64
    size: NDArray[np.int64]  # how many objects each group has, (groups,) int64
    stride: NDArray[np.int64]  # by how many rows picking an object goes down, (n,) int64
    # of each row, V(., b, d) and then V(., d, b) for all d, for one b after the other, then Y; flat, with `SPARE`
    # more at the end
    entries: NDArray[np.integer[Any]]
    bin: NDArray[np.integer[Any]]  # E and V, (rows, m, m), entry [b, d]; a view of the entries
    # Y, (rows, n), a view of the entries; only where not all of the group of object i are left
    object: NDArray[np.integer[Any]]
    multipliers: NDArray[np.int64]  # price of a pick, (n,) int64
    dearest: int  # the largest multiplier, and minus it the smallest, that the entries have room for


@dataclass(frozen=True)
class Solution:
    """A tour and a bound."""

    # a tour: k >= 0 picks object k, -1 - b goes to bin b and leaves all that belongs there
    actions: list[int]
    bound: int  # no tour is shorter than this, units
    certificate: Certificate  # what proves the bound


def rows_of(group: NDArray[np.int64]) -> int:
    """How many rows the table has, by the group of each object, (n,)."""
    return math.prod(int(k) + 1 for k in np.bincount(group))


def new_table(inst: Instance, group: NDArray[np.int64]) -> Table:
    """An unfilled table with no multipliers, by the group of each object, numbered from 0, (n,)."""
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


def fill_layers(inst: Instance, table: Table) -> None:
    """Compute all rows in numpy, by how many objects are left; each object must be a group of its own."""
    n, m = inst.to_bin.shape
    bins, objects = np.arange(m), np.arange(n)
    there = (np.arange(1 << n)[:, None] >> objects & 1).astype(bool)
    count = there.sum(axis=1)
    drop = inst.to_bin[objects, inst.home]
    table.bin[0], table.object[0] = inst.bins, drop
    for k in range(1, n + 1):
        rows = np.flatnonzero(count == k)
        j = np.nonzero(there[rows])[1].reshape(-1, k)  # what may be picked, (rows, k)
        left, c, legs = rows[:, None] - (1 << j), inst.home[j], inst.to_bin[j]
        own = legs + table.bin[left[..., None], bins, c[..., None]]
        second = np.minimum(own, drop[j][..., None] + table.bin[left, c])  # W, (rows, k, m)
        empty = (legs + table.object[left, j][..., None]).min(axis=1)  # E, (rows, m)
        carrying = (legs[..., None] + second[:, :, None]).min(axis=1)  # V, (rows, m, m)
        carrying = np.minimum(carrying, inst.bins + empty[:, None])
        carrying[:, bins, bins] = empty
        alone = (inst.between[j] + second[..., inst.home]).min(axis=1)  # Y, (rows, n)
        table.bin[rows], table.object[rows] = carrying, np.minimum(alone, drop + empty[:, inst.home])


def walk(inst: Instance, table: Table, row: int, actions: NDArray[np.int64]) -> tuple[int, int]:
    """Follow a best (relaxed) tour from the root, in plain Python; `table_kernels` compiles it.

    `row` is that of the objects left at the root; `actions` receives those of `Solution`, at least (2 n + 2,).
    Returns the length of the tour with multipliers, and the number of actions.
    """
    to_object, to_bin, at = inst.root, inst.root_bin, -1
    first = inst.carried[0] if inst.carried.size > 0 else -1  # bins of what is in hand, -1 for none
    second = inst.carried[1] if inst.carried.size > 1 else -1
    total, count = 0, 0
    while True:
        best, action = INFINITE, 0
        for b in (first, second):
            if b >= 0:
                other = second if b == first else first
                cost = to_bin[b] + table.bin[row, b, other if other >= 0 else b]
                if cost < best:
                    best, action = cost, -1 - b
        for j in range(inst.home.size if second < 0 else 0):
            left, c = row - table.stride[j], inst.home[j]
            if row // table.stride[j] % (table.size[table.group[j]] + 1) == 0 or j == at:
                continue
            cost = to_object[j] + table.multipliers[j]
            if first >= 0:
                own_last = inst.to_bin[j, first] + table.bin[left, first, c]
                cost += min(own_last, inst.to_bin[j, c] + table.bin[left, c, first])
            else:
                cost += table.object[left, j]
            if cost < best:
                best, action = cost, j
        if best == INFINITE:
            return total, count
        if count == 0:
            total = best
        actions[count] = action
        count += 1
        if action >= 0:
            row -= table.stride[action]
            to_object, to_bin, at = inst.between[action], inst.to_bin[action], action
            c = inst.home[action]
            first, second = (first, c) if first >= 0 else (c, -1)
        else:
            b = -1 - action
            to_object, to_bin, at = inst.from_bin[b], inst.bins[b], -1
            other = second if first == b else first
            first, second = other if other != b else -1, -1
