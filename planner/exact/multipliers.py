"""Lagrangian multipliers that make the relaxed tour pick each object about once."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.exact.deadline import Deadline
from planner.exact.instance import Instance
from planner.exact.relaxation import Table, fill, new_table, walk
from planner.kernels import kernel

MEMORY = 0.97  # of a step in the record of which objects are picked too often or too rarely
MOMENTUM = 0.8
MOST_BYTES = 1 << 25  # of a table
FIRST_STEPS = 150
MOST_STEPS, LEAST_STEPS = 30, 3  # after each growth: fewer as tables get larger
PATIENCE = 5  # steps without a better bound before the step shrinks
SHRINK = 0.7
RESTART = 0.2  # least step after growing; the relaxed tour changes, so there is something to gain again


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound of the cost-to-go from every state of an instance.

    Attributes:
        order: Object `order[k]` of the problem is object k of the permuted instance.
        instance: The permuted instance: the first `table.s` objects are kept exactly.
        table: Relaxed cost-to-go.
        root: Bound at the root, units.
        trouble: How far the relaxed tours were from picking each object once, lately, (n,).
        step: Step size that the fit ended with.
    """

    order: tuple[int, ...]
    instance: Instance
    table: Table
    root: int
    trouble: NDArray[np.float64]
    step: float


def first_bound(instance: Instance, upper: int) -> Bound:
    """Fit multipliers with no object kept exactly.

    Args:
        instance: The instance.
        upper: Length of a known tour, units.
    """
    n = len(instance.home)
    return _fit(tuple(range(n)), instance, new_table(instance, 0), np.zeros(n), upper, FIRST_STEPS, 1.0)


def grown(bound: Bound, upper: int, size: int, deadline: Deadline) -> Bound:
    """Keep more objects exactly, each time the one that the relaxed tour treats worst, and fit again.

    Args:
        bound: The bound so far.
        upper: Length of a known tour, units.
        size: How many objects to keep exactly in the end; fewer if the gap closes before or the
            table would grow too large.
        deadline: Stop growing when it is over.
    """
    n, m = bound.instance.to_bin.shape
    while bound.table.s < min(size, n) and bound.root < upper and not deadline.over():
        s = bound.table.s
        if 4 * (m * m + n) * (n - s) << (s + 1) > MOST_BYTES:
            break
        worst = s + int(np.argmax(bound.trouble[s:]))
        swap = np.arange(len(bound.order))
        swap[[s, worst]] = worst, s
        bound = _fit(
            tuple(bound.order[k] for k in swap),
            bound.instance.permuted(swap.tolist()),
            new_table(bound.instance, s + 1),
            bound.table.multipliers[swap].astype(np.float64),
            upper,
            max(LEAST_STEPS, min(MOST_STEPS, 2000 >> (s + 1))),
            max(bound.step, RESTART),
        )
    return bound


def _fit(
    order: tuple[int, ...],
    instance: Instance,
    table: Table,
    multipliers: NDArray[np.float64],
    upper: int,
    steps: int,
    step: float,
) -> Bound:
    trouble = np.zeros(len(order))
    root, step = improve(instance, table, multipliers, upper, steps, step, trouble)
    return Bound(order, instance, table, int(root), trouble, float(step))


@kernel
def improve(
    inst: Instance,
    table: Table,
    multipliers: NDArray[np.float64],
    upper: int,
    steps: int,
    step: float,
    trouble: NDArray[np.float64],
) -> tuple[int, float]:
    """Subgradient ascent; leaves the best table behind.

    Args:
        inst: The instance.
        table: Receives the table.
        multipliers: Where to start.
        upper: Length of a known tour.
        steps: How many tables to try.
        step: Step size to start with.
        trouble: Receives how far the tours were from picking each object once, lately.

    Returns:
        The best bound at the root, and the step size at the end.
    """
    n = inst.home.size
    actions = np.empty(2 * n + 2, np.int64)
    current = multipliers.copy()
    kept = np.empty(n, np.int32)
    for j in range(n):  # loops rather than slices: they compile much faster
        kept[j] = np.rint(multipliers[j])
    direction = np.zeros(n)
    best, failures = -1, 0
    for k in range(steps):
        for j in range(n):
            table.multipliers[j] = np.rint(current[j])
        value, surplus = _evaluate(inst, table, actions)
        if value > best:
            best, failures = value, 0
            for j in range(n):
                kept[j] = table.multipliers[j]
        else:
            failures += 1
            if failures == PATIENCE:
                step, failures = step * SHRINK, 0
        norm = 0.0
        for j in range(n):
            trouble[j] = MEMORY * trouble[j] + abs(surplus[j])
            norm += surplus[j] * surplus[j]
        if norm == 0.0 or best >= upper or k == steps - 1:
            break
        scale = step * (1.002 * upper - value) / norm
        for j in range(n):
            direction[j] = scale * surplus[j] + MOMENTUM * direction[j]
            current[j] += direction[j]
    changed = False
    for j in range(n):
        changed |= table.multipliers[j] != kept[j]
        table.multipliers[j] = kept[j]
    if changed:
        fill(inst, table)
    return best, step


@kernel
def _evaluate(inst: Instance, table: Table, actions: NDArray[np.int64]) -> tuple[int, NDArray[np.int64]]:
    """The bound at the root, and how much too often its tour picks each object."""
    fill(inst, table)
    total, count = walk(inst, table, actions)
    surplus = np.full(inst.home.size, -1, np.int64)
    for action in actions[:count]:
        if action >= 0:
            surplus[action] += 1
    for j in range(inst.home.size):
        total -= table.multipliers[j]
    return total, surplus
