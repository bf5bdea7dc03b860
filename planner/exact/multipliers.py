"""Fit Lagrangian multipliers so that relaxed tours pick up each object about once."""

from dataclasses import dataclass
from typing import NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from planner.exact.instance import Instance
from planner.exact.moves import Moves, moves_of
from planner.exact.table import CostTable, new_table, rows_of
from planner.exact.table_kernels import fill, fill_rows, walk
from planner.exact.warm_start import Start
from planner.plan import Certificate, Proof
from planner.solvers import NEVER, Deadline

DECAY = 0.97  # factor by which earlier violations are reduced at each step
MOMENTUM = 0.8
FIRST_STEPS, FIRST_STEP_SIZES = 150, (1.0, 0.02)
MAX_STEPS, MIN_STEPS, STEP_SIZES = 30, 4, (0.2, 0.03)
STEP_ROWS = 60_000  # approximate number of rows that are filled to fit a large table
SLICE = 1 << 13  # minimum number of rows between two checks of the deadline; filling them takes about 3 ms
STEP, BEST = range(2)  # indices into `Ascent.progress`


class Ascent(NamedTuple):
    """The state of a subgradient ascent that fits multipliers."""

    current: NDArray[np.float64]  # current multipliers, shape (n,)
    direction: NDArray[np.float64]  # last change of the multipliers, shape (n,)
    violation: NDArray[np.float64]  # average violation, as in `Bound`, shape (n,)
    best: NDArray[np.int64]  # multipliers that gave the best bound so far, shape (n,)
    sizes: NDArray[np.float64]  # length of each step relative to the gap, shape (steps,)
    progress: NDArray[np.int64]  # number of steps, and best bound


@dataclass(frozen=True, eq=False)
class Bound:
    """A lower bound on the cost-to-go from every state of an instance."""

    instance: Instance
    table: CostTable
    root: int  # lower bound at the root, in units
    # Average deviation from one pick per object in relaxed tours, shape (n,). Recent tours have more weight.
    violation: NDArray[np.float64]

    @property
    def prices(self) -> int:
        return int(self.table.multipliers.sum())

    @property
    def certificate(self) -> Certificate:
        groups, prices = self.table.group, tuple(self.table.multipliers.tolist())
        members = tuple(tuple(np.flatnonzero(groups == g).tolist()) for g in range(len(self.table.size)))
        return Certificate(Proof.RELAXATION, self.instance.unit, self.root, members, prices)


def first_bound(instance: Instance, upper: int) -> Bound:
    """Fit multipliers with all objects in a single group. `upper` is the length of a known tour."""
    n = len(instance.home)
    table = new_table(instance, np.zeros(n, np.int64))
    bound = fit(instance, table, np.zeros(n), upper, FIRST_STEPS, FIRST_STEP_SIZES, NEVER)
    return cast(Bound, bound)  # without a deadline, `fit` never returns None


def warm_bound(instance: Instance, start: Start, max_rows: int) -> Bound:
    """Return the lower bound that results from the groups and multipliers of a warm start.

    To keep the table within `max_rows` rows, the last groups are merged with the first one.
    """
    n, group = len(instance.home), start.group.copy()
    while rows_of(group) > max_rows and group.max(initial=0) > 0:
        group[group == group.max()] = 0
    table = new_table(instance, group)
    table.multipliers[:] = start.multipliers
    fill(instance, table)
    total, _ = walk(moves_of(instance), table, len(table.bin) - 1, np.empty(2 * n + 2, np.int64))
    return Bound(instance, table, int(total) - int(table.multipliers.sum()), np.zeros(n))


def grown(bound: Bound, upper: int, max_rows: int, deadline: Deadline) -> Bound:
    """Split groups and refit until the gap is closed, the row limit is reached, or the deadline passes.

    Each split moves the object with the largest violation into a group of its own.
    """
    warm = not bound.violation.any()  # after a warm start, fit the existing groups first
    group = bound.table.group if warm else _one_apart(bound)
    while group is not None and rows_of(group) <= max_rows and bound.root < upper - bound.instance.tie:
        steps = max(MIN_STEPS, min(MAX_STEPS, STEP_ROWS // rows_of(group)))
        fitted = _refitted(bound, group, upper, steps, deadline)
        if fitted is None:
            break
        bound, group = fitted, _one_apart(fitted)
    return bound


def _one_apart(bound: Bound) -> NDArray[np.int64] | None:
    group = bound.table.group.copy()
    size = np.bincount(group)[group] if len(group) else group
    if size.max(initial=1) == 1:
        return None
    group[np.argmax(np.where(size > 1, bound.violation, -1.0))] = group.max() + 1
    return group


def counted_by_bin(bound: Bound, upper: int, max_rows: int, deadline: Deadline) -> Bound:
    """Group the objects by bin if this gives a better bound.

    If bins are far apart, the tour length depends mainly on the number of visits to each bin. A small table
    can count these visits only if the objects are grouped by bin.
    """
    group = np.unique(bound.instance.home, return_inverse=True)[1]
    if bound.root >= upper - bound.instance.tie or rows_of(group) > max_rows:
        return bound
    fitted = _refitted(bound, group, upper, MAX_STEPS, deadline)
    return bound if fitted is None or fitted.root <= bound.root else fitted


def _refitted(
    bound: Bound, group: NDArray[np.int64], upper: int, steps: int, deadline: Deadline
) -> Bound | None:
    table = new_table(bound.instance, group)
    start = bound.table.multipliers.astype(np.float64)
    return fit(bound.instance, table, start, upper, steps, STEP_SIZES, deadline)


def fit(
    instance: Instance,
    table: CostTable,
    multipliers: NDArray[np.float64],
    upper: int,
    steps: int,
    step_sizes: tuple[float, float],
    deadline: Deadline,
) -> Bound | None:
    """Fit multipliers by subgradient ascent with momentum (Held, Wolfe and Crowder 1974).

    The ascent starts from `multipliers`, and `table` receives the best table. `step_sizes` are the sizes of
    the first and the last step, relative to the gap between the bound and `upper`, the length of a known
    tour. Return None if the deadline passes first.
    """
    n, first_size, last_size = len(instance.home), *step_sizes
    ascent = Ascent(
        multipliers.copy(),
        np.zeros(n),
        np.zeros(n),
        table.multipliers.copy(),
        np.array([first_size * (last_size / first_size) ** (k / steps) for k in range(steps)]),
        np.array([0, -1]),
    )
    moves = moves_of(instance)
    while not climb(instance, moves, table, ascent, upper, SLICE):
        if deadline.over():
            return None
    return Bound(instance, table, int(ascent.progress[BEST]), ascent.violation)


@kernel
def climb(inst: Instance, moves: Moves, table: CostTable, ascent: Ascent, upper: int, rows: int) -> bool:
    """Continue a subgradient ascent until `rows` table rows are filled. Return True if the ascent is finished.

    At the end, the table contains the best multipliers and the corresponding entries. The ascent is a single
    kernel because a return to Python after each table would require waiting for the interpreter lock.
    """
    n, steps, progress = inst.home.size, ascent.sizes.size, ascent.progress
    actions = np.empty(2 * n + 2, np.int64)
    while rows > 0 and progress[STEP] < steps:
        for j in range(n):
            price = np.rint(ascent.current[j])
            table.multipliers[j] = int(min(max(price, -table.dearest), table.dearest))
        fill_rows(inst, table, 0, table.bin.shape[0])
        rows -= table.bin.shape[0]
        total, count = walk(moves, table, table.bin.shape[0] - 1, actions)
        value = total - table.multipliers.sum()
        if value > progress[BEST]:
            progress[BEST] = value
            ascent.best[:] = table.multipliers
        size = ascent.sizes[progress[STEP]]
        progress[STEP] += 1
        ended = progress[BEST] >= upper - inst.tie or progress[STEP] == steps
        if ended or not step(actions[:count], 1.002 * upper - value, size, ascent):
            progress[STEP] = steps
    if progress[STEP] < steps:
        return False
    if (table.multipliers != ascent.best).any():
        table.multipliers[:] = ascent.best
        fill_rows(inst, table, 0, table.bin.shape[0])
    return True


@kernel
def step(actions: NDArray[np.int64], gap: float, size: float, ascent: Ascent) -> bool:
    """Adjust the prices of objects that are not picked up exactly once. Return False if there are none."""
    n = ascent.current.size
    surplus = np.full(n, -1.0)
    for action in actions:
        if action >= 0:
            surplus[action] += 1.0
    norm = 0.0
    for j in range(n):  # loops compile much faster than slices
        norm += surplus[j] * surplus[j]
        ascent.violation[j] = DECAY * ascent.violation[j] + abs(surplus[j])
    if norm == 0.0:
        return False
    for j in range(n):
        ascent.direction[j] = size * gap / norm * surplus[j] + MOMENTUM * ascent.direction[j]
        ascent.current[j] += ascent.direction[j]
    return True
