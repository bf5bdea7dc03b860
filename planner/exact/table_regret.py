"""Cost of the rest of a task after each possible next visit: all from one full table, or one exhaustive pass."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel
from planner.exact.deadline import Deadline
from planner.exact.instance import Instance
from planner.exact.multipliers import Bound
from planner.exact.nodes import Nodes, new_nodes, slot_of
from planner.exact.relaxation import after_pick, row_without
from planner.exact.search import PLACE_BITS, expand, offer_roots
from planner.exact.table import INFINITE, Table
from planner.plan import Visit, VisitKind

FIRST_ROOM = 1 << 12
UNLIMITED = 1 << 40  # states of a layer

Costs = dict[Visit, int]  # length of the rest of the task, units, by next visit


def costs_in(
    instance: Instance, table: Table, row: int, names: Sequence[str], carried: Sequence[str]
) -> Costs:
    """Costs of all next visits as a table has them; with a relaxed one these are lower bounds, prices included.

    Args:
        instance: The instance, with its root.
        table: The filled table.
        row: Row of the objects left at the root.
        names: Of the objects of the instance.
        carried: Names of what is carried at the root.
    """
    held = instance.carried.tolist()
    costs = {}
    for k, (b, name) in enumerate(zip(held, carried, strict=True)):
        other = held[1 - k] if len(held) == 2 else b
        costs[Visit(VisitKind.PLACE, name)] = int(instance.root_bin[b]) + int(table.bin[row, b, other])
    for j, name in enumerate(names if len(held) < 2 else ()):
        left = row_without(table, row, j)
        if left < 0:
            continue
        if held:
            rest = after_pick(instance, table, left, j, held[0])
        else:
            rest = int(table.object[left, j]) + int(table.multipliers[j])
        costs[Visit(VisitKind.PICK, name)] = int(instance.root[j]) + rest
    return costs


def costs_by_pass(
    bound: Bound, visits: Sequence[Visit], longest: int, max_states: int, deadline: Deadline
) -> Costs | None:
    """Costs of all next visits, exact where at most `longest`, else some number greater than it.

    Every state on a tour of at most that length is visited, layer by layer; a sweep back finds the shortest rest of
    the task from each.

    Args:
        bound: Bound of the cost-to-go.
        visits: Those possible next: places of what is carried, then picks if a hand is free.
        longest: Greatest length of interest, units.
        max_states: Give up beyond so many states.
        deadline: Give up when it is over.

    Returns:
        Costs, or None if the pass was given up.
    """
    instance, table = bound.instance, bound.table
    n = len(instance.home)
    limit = longest + 1 + bound.prices
    layers: list[Nodes] = []
    here, after = new_nodes(FIRST_ROOM), new_nodes(FIRST_ROOM)
    offer_roots(instance, table, here, after, limit)
    states = 0
    for _ in range(n + 1):
        expanded = expand(instance, table, here, after, limit, UNLIMITED, deadline)
        if expanded is None:
            return None
        here, after = expanded.here, expanded.after
        layers.append(here)
        states += int(here.size[0])
        if states > max_states:
            return None
        here, after = after, new_nodes(FIRST_ROOM)
    rest = [np.zeros(0, np.int64)] * (n + 1)
    beyond, nothing = here, np.zeros(0, np.int64)
    for k in range(n, -1, -1):
        after, after_rest = (layers[k + 1], rest[k + 1]) if k < n else (beyond, nothing)
        rest[k] = sweep(instance, layers[k], after, after_rest)
    first = (layers[1], rest[1]) if n else (beyond, nothing)
    found = root_costs(instance, layers[0], rest[0], *first)
    return {visit: int(cost) for visit, cost in zip(visits, found, strict=True)}


@kernel
def look_up(nodes: Nodes, rest: NDArray[np.int64], left: int, place: int) -> int:
    """Length of the rest of the task from a state; `INFINITE` if it is not among the nodes.

    `rest` is that length, units, for each of the nodes, shape (states,).
    """
    k = nodes.slots[slot_of(nodes, (left << PLACE_BITS) | place)]
    return int(rest[k]) if k >= 0 else INFINITE


@kernel
def after_second(
    inst: Instance, after: Nodes, after_rest: NDArray[np.int64], left: int, j: int, d: int
) -> int:
    """Length of the rest from object j, just picked, with one for d in hand too, units.

    `left` no longer has j; `after_rest` is the length of the rest from each state of `after`, shape (states,).
    """
    m = inst.bins.shape[0]
    c = inst.home[j]
    first = inst.to_bin[j, d] + look_up(after, after_rest, left, d * m + c)
    second = inst.to_bin[j, c] + look_up(after, after_rest, left, c * m + d)
    return int(min(first, second))


@kernel
def sweep(inst: Instance, here: Nodes, after: Nodes, after_rest: NDArray[np.int64]) -> NDArray[np.int64]:
    """Length of the rest of the task from each state of a layer, given those of the next layer.

    Both are in units, shape (states of the layer,).
    """
    n, m = inst.to_bin.shape
    size = here.size[0]
    rest = np.full(size, INFINITE, np.int64)
    for k in range(size):  # at a bin with empty hands
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        b, left = place // m, here.key[k] >> PLACE_BITS
        if place >= m * m or b != place % m:
            continue
        best = INFINITE if left else 0
        for i in range(n):
            if (left >> i) & 1:
                best = min(best, inst.from_bin[b, i] + look_up(after, after_rest, left ^ (1 << i), m * m + i))
        rest[k] = best
    for k in range(size):  # with one in hand: drop it, or pick another
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        i, b, d = place - m * m, place // m, place % m
        left = here.key[k] >> PLACE_BITS
        if i < 0 and b == d:
            continue
        if i >= 0:
            d, legs, home_leg = inst.home[i], inst.between[i], inst.to_bin[i, inst.home[i]]
        else:
            legs, home_leg = inst.from_bin[b], inst.bins[b, d]
        best = home_leg + look_up(here, rest, left, d * m + d)
        for j in range(n):
            if (left >> j) & 1:
                best = min(best, legs[j] + after_second(inst, after, after_rest, left ^ (1 << j), j, d))
        rest[k] = min(best, INFINITE)
    return rest


@kernel
def root_costs(
    inst: Instance, here: Nodes, rest: NDArray[np.int64], after: Nodes, after_rest: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Length of the task by next action: places of what is carried, then picks if a hand is free.

    The result has the shape (actions,); `rest` and `after_rest` are those of the states of `here` and `after`, shape
    (states,). All are in units.
    """
    n, m = inst.to_bin.shape
    count = inst.carried.size
    everything = (1 << n) - 1
    costs = np.empty(count + (n if count < 2 else 0), np.int64)
    for k in range(count):
        b = inst.carried[k]
        other = inst.carried[count - 1 - k] if count == 2 else b
        costs[k] = inst.root_bin[b] + look_up(here, rest, everything, b * m + other)
    if count < 2:
        for j in range(n):
            left = everything ^ (1 << j)
            if count == 1:
                then = after_second(inst, after, after_rest, left, j, inst.carried[0])
            else:
                then = look_up(after, after_rest, left, m * m + j)
            costs[count + j] = inst.root[j] + then
    return costs
