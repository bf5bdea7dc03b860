"""Cost-to-go tables, which are either exact, or relaxed to give lower bounds.

U is the set of objects that have not been picked up, and c_j is the bin of object j. The cost-to-go is

    E(U, b)     at bin b with empty hands,
    V(U, b, d)  at bin b with an object for bin d in hand, where V(U, d, d) = E(U, d),
    Y(U, i)     at object i with only this object in hand, and
    W(U, j, d)  at object j with this object and an object for bin d in hand.

Placing an object as soon as its bin is reached is optimal if the triangle inequality holds.

    W(U, j, d) = min( D(j, d) + V(U, d, c_j),  D(j, c_j) + V(U, c_j, d) )
    V(U, b, d) = min( D(b, d) + E(U, d),       min_{j in U} D(b, j) + W(U - j, j, d) )
    Y(U, i)    = min( D(i, c_i) + E(U, c_i),   min_{j in U} D(i, j) + W(U - j, j, c_i) )
    E(U, b)    = min_{i in U} D(b, i) + Y(U - i, i);    E({}, b) = 0

The relaxation (Christofides, Mingozzi and Toth 1981) divides the objects into groups and counts the remaining
objects of each group. Any object of a group may be picked up, but not twice in a row. Each pick of an object
costs an additional multiplier. For any groups and multipliers, a lower bound on the cost-to-go is obtained by
subtracting the multipliers of U. The table is exact if each object forms a group and all multipliers are 0.

This module needs only NumPy. `planner.exact.table_kernels` computes the same values faster.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import FAR, Instance
from planner.exact.moves import NOTHING, Moves
from planner.plan import Certificate

BIN_ROWS = 50_000  # row limit of a table with one group per bin, enough for 30 objects and 6 bins
SPARE = 8  # number of unused entries after the last row, because kernels read eight at a time
# Maximum leg and price for which tours of 60 objects fit into int32, and maximum price for int64, in units
LONGEST_32, DEAREST_32, DEAREST_64 = 1 << 21, 1 << 23, 1 << 53
INFINITE = 1 << 60  # length greater than any sum of legs


class CostTable(NamedTuple):
    """A table of the relaxed cost-to-go, including multipliers.

    The row index is a mixed-radix number. It contains one digit per group, which is the number of remaining
    objects in that group. If every object forms its own group, the row index is the bit mask of the remaining
    objects. Entries are int32 if all sums fit, and otherwise int64.
    """

    group: NDArray[np.int64]  # group of each object, numbered from 0, shape (n,)
    size: NDArray[np.int64]  # number of objects in each group, shape (groups,)
    stride: NDArray[np.int64]  # amount by which picking up an object reduces the row index, shape (n,)
    # Each row contains V(., b, d) and V(., d, b) for all d, for one bin b after another, and then Y.
    entries: NDArray[np.integer[Any]]
    bin: NDArray[np.integer[Any]]  # view of E and V in `entries`, indexed [row, b, d], shape (rows, m, m)
    # View of Y in `entries`, shape (rows, n). Entry i is valid only if an object of i's group was picked up.
    object: NDArray[np.integer[Any]]
    multipliers: NDArray[np.int64]  # price of picking up each object, shape (n,)
    dearest: int  # maximum absolute value of a multiplier for the data type of the entries
    width: int  # number of entries per row


@dataclass(frozen=True)
class Solution:
    """A tour, a lower bound on the lengths of all tours, and a certificate of the bound."""

    # Action k >= 0 picks up object k. Action -1 - b goes to bin b and places all objects that belong there.
    actions: list[int]
    bound: int  # lower bound on tour lengths, in units
    certificate: Certificate
    expanded: int = 0  # number of states that the search has expanded so far


def rows_of(group: NDArray[np.int64]) -> int:
    """Return the number of rows of a table, given the group of each object."""
    return math.prod(int(k) + 1 for k in np.bincount(group))


def new_table(inst: Instance, group: NDArray[np.int64]) -> CostTable:
    """Return an unfilled table with multipliers of 0. `group` contains the group number of each object."""
    n, m = inst.to_bin.shape
    size = np.bincount(group).astype(np.int64)
    below = np.ones(len(size) + 1, np.int64)
    below[1:] = np.cumprod(size + 1)
    rows, width, narrow = int(below[-1]), 2 * m * m + n, longest(inst) <= LONGEST_32
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
        width,
    )


def longest(inst: Instance) -> int:
    """Return the length of the longest leg that does not begin at the root."""
    leg = max(legs.max(initial=0) for legs in (inst.to_bin, inst.bins))
    return int(np.where(inst.between < FAR, inst.between, 0).max(initial=leg))


def fill_layers(inst: Instance, table: CostTable) -> None:
    """Fill all rows with NumPy, starting with the fewest objects. Each object must form its own group."""
    n, m = inst.to_bin.shape
    bins, objects = np.arange(m), np.arange(n)
    there = (np.arange(1 << n)[:, None] >> objects & 1).astype(bool)
    count = there.sum(axis=1)
    drop = inst.to_bin[objects, inst.home]
    table.bin[0], table.object[0] = inst.bins, drop
    for k in range(1, n + 1):
        rows = np.flatnonzero(count == k)
        j = np.nonzero(there[rows])[1].reshape(-1, k)  # remaining objects, shape (rows, k)
        left, c, legs = rows[:, None] - (1 << j), inst.home[j], inst.to_bin[j]
        own = legs + table.bin[left[..., None], bins, c[..., None]]
        second = np.minimum(own, drop[j][..., None] + table.bin[left, c])  # values of W, shape (rows, k, m)
        empty = (legs + table.object[left, j][..., None]).min(axis=1)  # values of E, shape (rows, m)
        carrying = (legs[..., None] + second[:, :, None]).min(axis=1)  # values of V, shape (rows, m, m)
        carrying = np.minimum(carrying, inst.bins + empty[:, None])
        carrying[:, bins, bins] = empty
        alone = (inst.between[j] + second[..., inst.home]).min(axis=1)  # values of Y, shape (rows, n)
        table.bin[rows], table.object[rows] = carrying, np.minimum(alone, drop + empty[:, inst.home])


def walk(moves: Moves, table: CostTable, row: int, actions: NDArray[np.int64]) -> tuple[int, int]:
    """Follow a shortest tour in the table. Return its length with multipliers and its number of actions.

    `row` is the table row of the objects that remain at the start. The actions, as defined in `Solution`, are
    written to `actions`, of shape (2 n + 2,) or larger. `table_kernels` compiles this function.
    """
    n, place, total, count = moves.end.shape[1] - 1, moves.end.shape[0] - 1, 0, 0
    left = np.zeros(table.size.size, np.int64)  # number of remaining objects in each group
    for j in range(n):
        left[table.group[j]] = row // table.stride[j] % (table.size[table.group[j]] + 1)
    while True:
        best, picked, then = INFINITE, n, -1
        for j in range(NOTHING, n):
            if j >= 0 and left[table.group[j]] == 0:
                continue
            below, price = (row - table.stride[j], table.multipliers[j]) if j >= 0 else (row, 0)
            for way in range(2):
                end = moves.end[place, j, way]
                if end < 0:
                    continue
                rest = table.entries[below * table.width + moves.column[end]]
                cost = moves.length[place, j, way] + price + rest
                if cost < best:
                    best, picked, then = cost, j, end
        if then < 0:
            return total, count
        if count == 0:
            total = best
        if picked >= 0:
            actions[count], row, count = picked, row - table.stride[picked], count + 1
            left[table.group[picked]] -= 1
        if then < moves.bins**2:
            actions[count], count = -1 - then // moves.bins, count + 1
        place = then
