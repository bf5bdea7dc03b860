"""Proven tours from the full table: by compiled kernels, or in plain numpy where their compiler is not loaded.

Both fill in the same numbers and break ties alike, so the plan does not depend on which of them was used.
"""

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.certificate import Certificate, Proof
from planner.exact.groups import alone
from planner.exact.instance import Instance
from planner.exact.table import Table, new_table, table_bytes

COMPILER = "numba"  # takes 0.5 s to load; where something else has loaded it, the kernels cost little more
SMALL_TABLE = 1 << 23  # bytes, 14 objects and 6 bins: filled in 10 ms by kernels, in 50 by numpy


@dataclass(frozen=True)
class Solution:
    """A tour and a bound.

    Attributes:
        actions: A tour: k >= 0 picks object k, -1 - b goes to bin b and leaves all that belongs there.
        bound: No tour is shorter than this, units.
        certificate: What proves the bound.
    """

    actions: list[int]
    bound: int
    certificate: Certificate


def full_table_bytes(instance: Instance) -> int:
    """Memory of the full table."""
    return table_bytes(instance, 1 << len(instance.home))


def by_table(instance: Instance) -> Solution:
    """Fill the full table and follow a shortest tour."""
    table = filled_table(instance)
    length, actions = follow_table(instance, table, len(table.bin) - 1)
    return Solution(actions, length, Certificate(Proof.FULL_TABLE, instance.unit, length))


def filled_table(instance: Instance) -> Table:
    """The full table, filled by kernels, or in plain numpy where it is small and their compiler is not loaded."""
    table = new_table(instance, alone(len(instance.home)))
    if COMPILER in sys.modules or full_table_bytes(instance) > SMALL_TABLE:
        from planner.exact.relaxation import fill  # loaded only where it is needed

        fill(instance, table)
    else:
        fill_layers(instance, table)
    return table


def follow_table(instance: Instance, table: Table, row: int) -> tuple[int, list[int]]:
    """A shortest tour by a full table: its length, and its actions as in `Solution`.

    Args:
        instance: The instance, with its root.
        table: The filled table.
        row: Row of the objects left at the root.
    """
    if COMPILER not in sys.modules:
        return follow(instance, table, row)
    from planner.exact.relaxed_tour import walk  # loaded only where it is needed

    actions: NDArray[np.int64] = np.empty(2 * len(instance.home) + 2, np.int64)
    length, count = walk(instance, table, row, actions)
    return int(length), actions[:count].tolist()


def fill_layers(inst: Instance, table: Table) -> None:
    """Compute all rows in plain numpy, by how many objects are left; each object must be a group of its own."""
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


def follow(inst: Instance, table: Table, row: int) -> tuple[int, list[int]]:
    """A best tour from the root by a full table, in plain Python; the arguments are those of `follow_table`.

    Returns:
        Its length, and its actions: k >= 0 picks object k, -1 - b goes to bin b.
    """
    left, held = row, [int(b) for b in inst.carried]
    to_object, to_bin = inst.root, inst.root_bin
    length = 0
    actions: list[int] = []
    while left or held:
        options = [
            (int(to_bin[b]) + int(table.bin[left, b, held[1 - k] if len(held) == 2 else b]), -1 - b)
            for k, b in enumerate(held)
        ]
        if len(held) < 2:
            options += [
                (int(to_object[j]) + _picked(inst, table, left ^ 1 << j, j, held), j)
                for j in range(len(inst.home))
                if left >> j & 1
            ]
        cost, action = min(options, key=lambda option: option[0])  # the first of equals
        length = length if actions else cost
        actions.append(action)
        if action >= 0:
            left ^= 1 << action
            held.append(int(inst.home[action]))
            to_object, to_bin = inst.between[action], inst.to_bin[action]
        else:
            held = [b for b in held if b != -1 - action]
            to_object, to_bin = inst.from_bin[-1 - action], inst.bins[-1 - action]
    return length, actions


def _picked(inst: Instance, table: Table, left: int, j: int, held: list[int]) -> int:
    """Cost-to-go at object j with it in hand: W with one for another bin held before, else Y."""
    if not held:
        return int(table.object[left, j])
    c, d = int(inst.home[j]), held[0]
    first = int(inst.to_bin[j, d]) + int(table.bin[left, d, c])
    return min(first, int(inst.to_bin[j, c]) + int(table.bin[left, c, d]))
