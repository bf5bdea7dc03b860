"""Compute the costs of all possible next visits from a full table or by an exhaustive search."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from planner.exact.expand import PLACE_BITS, expand, offer_roots
from planner.exact.instance import MAX_SEARCHED, Instance
from planner.exact.multipliers import Bound
from planner.exact.nodes import FIRST_ROOM, Nodes, new_nodes, slot_of
from planner.exact.table import INFINITE, CostTable
from planner.plan import Visit, VisitKind
from planner.solvers import Deadline

UNLIMITED = 1 << 40  # search width at which no states are dropped

Costs = dict[Visit, int]  # length of the remaining tour in units, by next visit


def costs_in(
    instance: Instance, table: CostTable, row: int, names: Sequence[str], carried: Sequence[str]
) -> Costs:
    """Return the cost of each possible next visit. If the table is relaxed, return lower bounds, plus the prices.

    `row` is the table row of the objects that remain at the start. `names` contains the names of the
    instance's objects, and `carried` the names of the carried objects.
    """
    held, home = instance.carried.tolist(), instance.home
    costs = {}
    for k, (b, name) in enumerate(zip(held, carried, strict=True)):
        other = held[1 - k] if len(held) == 2 else b
        costs[Visit(VisitKind.PLACE, name)] = int(instance.root_bin[b]) + int(table.bin[row, b, other])
    if len(held) < 2:
        j = np.flatnonzero(row // table.stride % (table.size[table.group] + 1))
        left, c = row - table.stride[j], home[j]
        if held:
            own_last = instance.to_bin[j, held[0]] + table.bin[left, held[0], c]
            rest = np.minimum(own_last, instance.to_bin[j, c] + table.bin[left, c, held[0]])
        else:
            rest = table.object[left, j].astype(np.int64)
        found = (instance.root[j] + table.multipliers[j] + rest).tolist()
        costs |= {Visit(VisitKind.PICK, names[k]): cost for k, cost in zip(j.tolist(), found, strict=True)}
    return costs


def costs_by_pass(
    bound: Bound, visits: Sequence[Visit], longest: int, max_states: int, deadline: Deadline
) -> tuple[Costs | None, int]:
    """Return the cost of each possible next visit in units, and the number of states.

    Costs above `longest` are not exact. The search visits every state on a tour of at most this length. A
    backward sweep then computes the shortest remaining tour from each state. `visits` lists the possible next
    visits, places first. The costs are None if there are too many objects, more than `max_states` states, or the
    deadline has passed.
    """
    instance, table = bound.instance, bound.table
    n = len(instance.home)
    if n > MAX_SEARCHED:
        return None, 0
    limit = longest + 1 + bound.prices
    layers: list[Nodes] = []
    here, after = new_nodes(FIRST_ROOM), new_nodes(FIRST_ROOM)
    offer_roots(instance, table, here, after, limit)
    states = 0
    for _ in range(n + 1):
        expanded = expand(instance, table, here, after, limit, UNLIMITED, deadline)
        if expanded is None:
            return None, states
        here, after = expanded.here, expanded.after
        layers.append(here)
        states += int(here.size[0])
        if states > max_states:
            return None, states
        here, after = after, new_nodes(FIRST_ROOM)
    rest = [np.zeros(0, np.int64)] * (n + 1)
    beyond, nothing = here, np.zeros(0, np.int64)
    for k in range(n, -1, -1):
        after, after_rest = (layers[k + 1], rest[k + 1]) if k < n else (beyond, nothing)
        rest[k] = sweep(instance, layers[k], after, after_rest)
    first = (layers[1], rest[1]) if n else (beyond, nothing)
    found = root_costs(instance, layers[0], rest[0], *first)
    # With a capacity of one, `found` may end with picks that are not in `visits`.
    return {visit: int(cost) for visit, cost in zip(visits, found, strict=False)}, states


@kernel
def look_up(nodes: Nodes, rest: NDArray[np.int64], left: int, place: int) -> int:
    k = nodes.slots[slot_of(nodes, (left << PLACE_BITS) | place)]
    return int(rest[k]) if k >= 0 else INFINITE


@kernel
def after_second(
    inst: Instance, after: Nodes, after_rest: NDArray[np.int64], left: int, j: int, d: int
) -> int:
    m = inst.bins.shape[0]
    c = inst.home[j]
    first = inst.to_bin[j, d] + look_up(after, after_rest, left, d * m + c)
    second = inst.to_bin[j, c] + look_up(after, after_rest, left, c * m + d)
    return int(min(first, second))


@kernel
def sweep(inst: Instance, here: Nodes, after: Nodes, after_rest: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the remaining tour length of each state in a layer, given the lengths for the next layer."""
    n, m = inst.to_bin.shape
    size = here.size[0]
    rest = np.full(size, INFINITE, np.int64)
    for k in range(size):  # states at a bin with empty hands
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        b, left = place // m, here.key[k] >> PLACE_BITS
        if place >= m * m or b != place % m:
            continue
        best = INFINITE if left else 0
        for i in range(n):
            if (left >> i) & 1:
                best = min(best, inst.from_bin[b, i] + look_up(after, after_rest, left ^ (1 << i), m * m + i))
        rest[k] = best
    for k in range(size):  # states with an object in hand
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
    """Return the tour length for each possible next visit. Visits that place carried objects come first."""
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
