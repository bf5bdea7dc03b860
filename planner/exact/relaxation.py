"""Compiled kernels that fill a table of `planner.exact.table`, and follow a best tour in it."""

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel
from planner.exact.deadline import NEVER, Deadline
from planner.exact.instance import Instance
from planner.exact.table import INFINITE, Table

SLICE = 1 << 13  # rows that are filled between looks at the clock: some 5 ms


@kernel
def row_without(table: Table, row: int, j: int) -> int:
    """Row after picking j, or -1 where none of its group is left."""
    left = row // table.stride[j] % (table.size[table.group[j]] + 1)
    return int(row - table.stride[j]) if left else -1


@kernel
def after_pick(inst: Instance, table: Table, row: int, j: int, d: int) -> int:
    """W with its pick: at j with it and one object for d, where `row` no longer has j."""
    c = inst.home[j]
    first = inst.to_bin[j, d] + table.bin[row, d, c]
    second = inst.to_bin[j, c] + table.bin[row, c, d]
    return int(table.multipliers[j] + min(first, second))


def fill(inst: Instance, table: Table, deadline: Deadline = NEVER) -> bool:
    """Compute all rows, smaller ones first; whether that was done before the deadline."""
    rows = table.bin.shape[0]
    for first in range(0, rows, SLICE):
        if first and deadline.over():
            return False
        fill_rows(inst, table, first, min(rows, first + SLICE))
    return True


@kernel
def left_of(table: Table, row: int) -> NDArray[np.int64]:
    """How many of each group are left in a row, shape (groups,)."""
    left = np.empty(table.size.size, np.int64)
    for g in range(left.size):
        left[g] = row % (table.size[g] + 1)
        row //= table.size[g] + 1
    return left


@kernel
def count_on(table: Table, left: NDArray[np.int64]) -> None:
    """Update the numbers left of each group, shape (groups,), from a row to the next."""
    for g in range(left.size):
        left[g] += 1
        if left[g] <= table.size[g]:
            break
        left[g] = 0


@kernel
def fill_rows(inst: Instance, table: Table, first: int, last: int) -> None:
    """Compute some rows; all before must have been.

    Its parts index whole arrays: to make a view of a row takes numba longer than to add it up.
    """
    n, m = inst.to_bin.shape
    second = np.empty((m, n), np.int64)  # W with its pick, [d, j]; infinite where j cannot be picked
    only = np.empty((1, n), np.int64)  # Y with its pick; the same
    carrying, empty = np.empty((m, m), np.int64), np.empty((m, 1), np.int64)
    left = left_of(table, first)
    for row in range(first, last):
        _picked(inst, table, left, row, second, only)
        _least_sums(inst.from_bin, only, empty)
        _least_sums(inst.from_bin, second, carrying)
        for d in range(m):
            e = empty[d, 0] if row else 0
            for b in range(m):
                table.bin[row, b, d] = min(inst.bins[b, d] + e, carrying[b, d])
            table.bin[row, d, d] = e
        _holding(inst, table, left, row, second)
        count_on(table, left)


@kernel
def _picked(
    inst: Instance,
    table: Table,
    left: NDArray[np.int64],
    row: int,
    second: NDArray[np.int64],
    only: NDArray[np.int64],
) -> None:
    """W (second, [d, j]) and Y (only, [0, j]), with the pick, of every object j in a row."""
    n, m = inst.to_bin.shape
    for j in range(n):
        if left[table.group[j]] == 0:
            only[0, j] = INFINITE
            for d in range(m):
                second[d, j] = INFINITE
            continue
        after, price, c = row - table.stride[j], table.multipliers[j], inst.home[j]
        only[0, j] = table.object[after, j] + price
        last = inst.to_bin[j, c] + price
        for d in range(m):
            other_first = inst.to_bin[j, d] + price + table.bin[after, d, c]
            second[d, j] = min(other_first, last + table.bin[after, c, d])


@kernel
def _least_sums(a: NDArray[np.int64], b: NDArray[np.int64], sums: NDArray[np.int64]) -> None:
    """Least sum of each row of `a` (p, n) and each row of `b` (q, n), entry by entry, into `sums` (p, q)."""
    for q in range(b.shape[0]):
        for p in range(a.shape[0]):
            best = INFINITE
            for k in range(a.shape[1]):
                best = min(best, a[p, k] + b[q, k])
            sums[p, q] = best


@kernel
def _holding(
    inst: Instance, table: Table, left: NDArray[np.int64], row: int, second: NDArray[np.int64]
) -> None:
    """Y of the objects of which some of the group were picked."""
    n = inst.to_bin.shape[0]
    for i in range(n):
        if left[table.group[i]] == table.size[table.group[i]]:
            continue
        c = inst.home[i]
        best = inst.to_bin[i, c] + table.bin[row, c, c]
        for k in range(n):  # no object follows itself, as `between` is infinite there
            best = min(best, inst.between[i, k] + second[c, k])
        table.object[row, i] = best


@kernel
def choose(
    inst: Instance,
    table: Table,
    row: int,
    at: int,
    to_object: NDArray[np.int64],
    to_bin: NDArray[np.int64],
    first: int,
    second: int,
) -> tuple[int, int]:
    """The best next action and the cost-to-go with it; `INFINITE` when nothing is left.

    Args:
        inst: The instance.
        table: A filled table.
        row: Row of the objects left.
        at: Object that was just picked, -1 if it was not a pick.
        to_object: Distances from here to objects, units, (n,).
        to_bin: Distances from here to bins, units, (m,).
        first: Bin of an object in hand, -1 for none.
        second: Bin of another object in hand, -1 for none.
    """
    best, action = INFINITE, 0
    for b in (first, second):
        if b >= 0:
            other = second if b == first else first
            cost = to_bin[b] + (table.bin[row, b, other] if other >= 0 else table.bin[row, b, b])
            if cost < best:
                best, action = cost, -1 - b
    if second >= 0:
        return best, action
    for j in range(inst.home.size):
        left = row_without(table, row, j)
        if left < 0 or j == at:
            continue
        if first >= 0:
            cost = to_object[j] + after_pick(inst, table, left, j, first)
        else:
            cost = to_object[j] + table.object[left, j] + table.multipliers[j]
        if cost < best:
            best, action = cost, j
    return best, action


@kernel
def walk(inst: Instance, table: Table, row: int, actions: NDArray[np.int64]) -> tuple[int, int]:
    """Follow a best relaxed tour from the root.

    Args:
        inst: The instance.
        table: A filled table.
        row: Row of the objects left at the root.
        actions: Receives the actions, at least (2 n + 2,): k >= 0 picks object k, -1 - b goes to bin b.

    Returns:
        Length of the tour with multipliers, and the number of actions.
    """
    to_object, to_bin, at = inst.root, inst.root_bin, -1
    first = inst.carried[0] if inst.carried.size > 0 else -1
    second = inst.carried[1] if inst.carried.size > 1 else -1
    total, count = 0, 0
    while True:
        best, action = choose(inst, table, row, at, to_object, to_bin, first, second)
        if best == INFINITE:
            return total, count
        if count == 0:
            total = best
        actions[count] = action
        count += 1
        if action >= 0:
            row -= table.stride[action]
            to_object, to_bin, at = inst.between[action], inst.to_bin[action], action
            if first >= 0:
                second = inst.home[action]
            else:
                first = inst.home[action]
        else:
            b = -1 - action
            to_object, to_bin, at = inst.from_bin[b], inst.bins[b], -1
            if first == b:
                first, second = second, -1
            if first == b:
                first = -1
            if second == b:
                second = -1
