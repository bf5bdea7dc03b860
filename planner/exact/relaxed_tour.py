"""The best relaxed tour, read off a filled table action by action."""

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import inlined, kernel
from planner.exact.instance import Instance
from planner.exact.relaxation import after_pick, row_without
from planner.exact.table import INFINITE, Table


@inlined
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
