"""Cost-to-go tables over subsets: exact tables, and relaxed tables that bound them from below.

States, with U the objects not yet picked and c_j the bin of j: E(U, b) at bin b with empty hands; V(U, b, d) at
bin b carrying one object for d, with V(U, d, d) = E(U, d); Y(U, i) at object i holding only it; W(U, j, d) at
object j holding it and one for d. Leaving what belongs here is free and always right in a metric.

    W(U, j, d) = min( D(j, d) + V(U, d, c_j),  D(j, c_j) + V(U, c_j, d) )
    V(U, b, d) = min( D(b, d) + E(U, d),       min_{j in U} D(b, j) + W(U - j, j, d) )
    Y(U, i)    = min( D(i, c_i) + E(U, c_i),   min_{j in U} D(i, j) + W(U - j, j, c_i) )
    E(U, b)    = min_{i in U} D(b, i) + Y(U - i, i);    E({}, b) = 0

The relaxation (Christofides, Mingozzi and Toth 1981) puts objects into groups and counts how many of each group are
left. Any object of a group may then be picked, but none twice in a row. Each pick of j costs an additional
multiplier. Subtracting the multipliers of U gives a lower bound of the cost-to-go from every U, for any multipliers
and groups. If each object is its own group and there are no multipliers, the table is exact.

This module needs only NumPy. `planner.exact.table_kernels` computes the same numbers.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance
from planner.plan import Certificate

BIN_ROWS = 50_000  # maximum rows of a table grouped by bin, enough for 30 objects and 6 bins
SPARE = 8  # entries after the last row, because kernels read eight at a time
# Largest leg and largest price with which tours of 40 objects fit into int32, and largest price for int64, units.
LONGEST_32, DEAREST_32, DEAREST_64 = 1 << 21, 1 << 23, 1 << 53
INFINITE = 1 << 60  # longer than any sum of lengths


class CostTable(NamedTuple):
    """Cost-to-go of the relaxed problem, including multipliers. There is a row for each combination of numbers left.

    In row r, r / (number of rows of all groups before) mod (size + 1) objects of a group are left. If every object is
    its own group, the row number is the set of the objects left. Entries are int32 if all sums fit, else int64.
    """

    group: NDArray[np.int64]  # group of each object, numbered from 0, (n,)
    size: NDArray[np.int64]  # number of objects of each group, (groups,)
    stride: NDArray[np.int64]  # decrease of the row index when an object is picked, (n,)
    # flat array of rows. Each has V(., b, d) for all d and V(., d, b) for all d, for every b, followed by Y.
    # `SPARE` entries follow the last row.
    entries: NDArray[np.integer[Any]]
    bin: NDArray[np.integer[Any]]  # view of E and V in `entries`, (rows, m, m), indexed [row, b, d]
    # view of Y in `entries`, (rows, n), valid at i only in rows in which an object of i's group has been picked
    object: NDArray[np.integer[Any]]
    multipliers: NDArray[np.int64]  # price of a pick, (n,)
    dearest: int  # largest absolute value of a multiplier that fits the type of the entries


@dataclass(frozen=True)
class Solution:
    """A tour and a bound."""

    # the tour: k >= 0 picks object k, -1 - b goes to bin b and leaves all objects that belong there
    actions: list[int]
    bound: int  # no tour is shorter than this, units
    certificate: Certificate  # proof of the bound


def rows_of(group: NDArray[np.int64]) -> int:
    """Return the number of rows of a table, given the group of each object, (n,)."""
    return math.prod(int(k) + 1 for k in np.bincount(group))


def new_table(inst: Instance, group: NDArray[np.int64]) -> CostTable:
    """Return an unfilled table without multipliers, given the group of each object, numbered from 0, (n,)."""
    n, m = inst.to_bin.shape
    size = np.bincount(group).astype(np.int64)
    below = np.ones(len(size) + 1, np.int64)
    below[1:] = np.cumprod(size + 1)
    rows, width, narrow = int(below[-1]), 2 * m * m + n, _longest(inst) <= LONGEST_32
    entries = np.empty(rows * width + SPARE, np.int32 if narrow else np.int64)
    table = entries[: rows * width].reshape(rows, width)
    return CostTable(
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
    longest = max(legs.max(initial=0) for legs in (inst.to_bin, inst.from_bin, inst.bins))
    return int(np.where(inst.between < FAR, inst.between, 0).max(initial=longest))


def fill_layers(inst: Instance, table: CostTable) -> None:
    """Fill all rows with NumPy, by number of objects left. Each object must be its own group."""
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


def walk(inst: Instance, table: CostTable, row: int, actions: NDArray[np.int64]) -> tuple[int, int]:
    """Follow a best (relaxed) tour from the root. `table_kernels` compiles this function.

    `row` is the row of the objects left at the root. `actions`, (2 n + 2,) or larger, receives the actions of
    `Solution`. Return the length of the tour with multipliers, and the number of actions.
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
