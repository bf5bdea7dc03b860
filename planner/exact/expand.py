"""Kernels that expand a layer of the search: states by number of picks, pruned by a lower bound of the cost-to-go.

A node is a state (U, place, carried) with the length of the shortest known path to it. Layer k contains states with
k picked objects. The code of a state is U 2^12 + place. Place b m + d means at bin b with an object for d,
b m + b at bin b with empty hands, and m m + i at object i with only that object in hand. Reaching a second object
is not a state, because the next stop is one of two bins.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.instance import Instance
from planner.exact.nodes import NO_PARENT, Nodes, offer, with_room, with_room_among
from planner.exact.table import INFINITE, CostTable
from planner.solvers import Deadline

PLACE_BITS = 12
SLICE = 1 << 12  # states expanded between two checks of the deadline, which takes about 5 ms
CARRYING, EMPTY = range(2)  # stages of a layer: states with an object in hand, states with empty hands
STAGE, DONE, OF, SMALLEST, STATES, END = range(6)  # indices of the progress in a layer


class Expanded(NamedTuple):
    """Result of the expansion of a layer."""

    here: Nodes  # the layer, including states reached by leaving an object in its bin
    after: Nodes  # the next layer
    smallest: int  # smallest total dropped from the next layer to save memory, or `INFINITE`
    states: int  # number of expanded states
    end: int  # index of the end of the shortest complete tour, or -1


@kernel
def row_of(table: CostTable, left: int) -> int:
    """Return the row of the bound's table for a set of objects left."""
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


class LegEnd(NamedTuple):
    """The end of a leg: remaining objects (bit mask), their table row, length so far with multipliers, and parent."""

    left: int
    row: int
    cost: int
    parent: int


@inlined
def offer_bin(
    inst: Instance, table: CostTable, nodes: Nodes, arrival: LegEnd, b: int, d: int, limit: int
) -> None:
    """Add the state at bin b with an object for bin d in hand (d = b: none) if its total is below the limit."""
    total = arrival.cost + table.bin[arrival.row, b, d]
    if total < limit:
        place = b * inst.bins.shape[0] + d
        offer(nodes, (arrival.left << PLACE_BITS) | place, arrival.cost, total, arrival.parent)


@inlined
def offer_second(
    inst: Instance, table: CostTable, nodes: Nodes, arrival: LegEnd, j: int, d: int, limit: int
) -> None:
    """Pick j with an object for bin d in hand, and add the states at both bins. `arrival` is at j, before the pick."""
    c = inst.home[j]
    left, row = arrival.left ^ (1 << j), arrival.row - table.stride[j]
    cost = arrival.cost + table.multipliers[j]
    first = LegEnd(left, row, cost + inst.to_bin[j, d], arrival.parent)
    offer_bin(inst, table, nodes, first, d, c, limit)
    if c != d:
        second = LegEnd(left, row, cost + inst.to_bin[j, c], arrival.parent)
        offer_bin(inst, table, nodes, second, c, d, limit)


@inlined
def offer_only(inst: Instance, table: CostTable, nodes: Nodes, arrival: LegEnd, i: int, limit: int) -> None:
    """Pick i with empty hands, and add the state there. `arrival` is at i, before the pick."""
    cost = arrival.cost + table.multipliers[i]
    total = cost + table.object[arrival.row - table.stride[i], i]
    if total < limit:
        place = inst.bins.shape[0] ** 2 + i
        offer(nodes, ((arrival.left ^ (1 << i)) << PLACE_BITS) | place, cost, total, arrival.parent)


@kernel
def offer_roots(inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int) -> None:
    """Add the successors of the root to the first two layers."""
    n = inst.home.size
    left, row = (1 << n) - 1, table.bin.shape[0] - 1
    if inst.carried.size == 0:
        for i in range(n):
            arrival = LegEnd(left, row, int(inst.root[i]), NO_PARENT)
            offer_only(inst, table, after, arrival, i, limit)
        return
    d, other = inst.carried[0], inst.carried[inst.carried.size - 1]
    offer_bin(inst, table, here, LegEnd(left, row, int(inst.root_bin[d]), NO_PARENT), d, other, limit)
    if inst.carried.size == 2:
        offer_bin(inst, table, here, LegEnd(left, row, int(inst.root_bin[other]), NO_PARENT), other, d, limit)
        return
    for j in range(n):
        offer_second(inst, table, after, LegEnd(left, row, int(inst.root[j]), NO_PARENT), j, d, limit)


def expand(
    inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, deadline: Deadline
) -> Expanded | None:
    """Add all successors of a layer's states. Return None if the deadline passes before that."""
    progress = np.array([0, 0, 0, INFINITE, 0, -1])
    while True:
        here, after = expand_some(inst, table, here, after, limit, width, progress)
        if progress[STAGE] > EMPTY:
            return Expanded(here, after, *progress[SMALLEST:].tolist())
        if deadline.over():
            return None


@kernel
def expand_some(
    inst: Instance,
    table: CostTable,
    here: Nodes,
    after: Nodes,
    limit: int,
    width: int,
    progress: NDArray[np.int64],
) -> tuple[Nodes, Nodes]:
    """Expand a slice of a layer: first states with an object in hand, then states with empty hands.

    `progress`, (6,), contains the stage, the numbers of expanded states and of all states of the stage, and the last
    three fields of `Expanded`. Totals of added states are below `limit`. `width` states of the next layer will be kept.
    """
    if progress[STAGE] == CARRYING and progress[DONE] == 0:
        progress[OF] = here.size[0]
        here = with_room(here, here.size[0])
    slice_left = SLICE
    while slice_left > 0 and progress[STAGE] <= EMPTY:
        first, last = progress[DONE], min(progress[OF], progress[DONE] + slice_left)
        if progress[STAGE] == CARRYING:
            after, smallest, count = expand_carrying(inst, table, here, after, limit, width, first, last)
        else:
            after, smallest, count, end = expand_empty(inst, table, here, after, limit, width, first, last)
            if end >= 0 and (progress[END] < 0 or here.cost[end] < here.cost[progress[END]]):
                progress[END] = end
        progress[SMALLEST] = min(progress[SMALLEST], smallest)
        progress[STATES] += count
        slice_left -= last - first
        progress[DONE] = last
        if last == progress[OF]:
            progress[STAGE] += 1
            progress[DONE], progress[OF] = 0, here.size[0]
    return here, after


@kernel
def expand_carrying(
    inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int]:
    """Add the successors of states `first` to `last` with an object in hand. This layer must have enough space.

    Return the next layer, the smallest total dropped from it, and the number of expanded states.
    """
    n, m = inst.to_bin.shape
    smallest, expanded = INFINITE, 0
    for k in range(first, last):
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        i = place - m * m
        b, d = place // m, place % m
        if here.total[k] >= limit or (i < 0 and b == d):
            continue
        expanded += 1
        if i >= 0:
            d, home_leg = inst.home[i], inst.to_bin[i, inst.home[i]]
        else:
            home_leg = inst.bins[b, d]
        left = here.key[k] >> PLACE_BITS
        row = row_of(table, left)
        arrival = LegEnd(left, row, int(here.cost[k] + home_leg), 2 * k + 1)
        offer_bin(inst, table, here, arrival, d, d, limit)
        if after.size[0] + 2 * n > after.key.size:
            after, dropped = with_room_among(after, 2 * n, width)
            smallest = min(smallest, dropped)
        for j in range(n):
            if not left >> j & 1:
                continue
            leg = inst.between[i, j] if i >= 0 else inst.from_bin[b, j]
            arrival = LegEnd(left, row, int(here.cost[k] + leg), 2 * k)
            offer_second(inst, table, after, arrival, j, d, limit)
    return after, smallest, expanded


@kernel
def expand_empty(
    inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int, int]:
    """Add the successors of states `first` to `last` with empty hands.

    Return the values of `expand_carrying`, then the index of the end of the shortest complete tour, or -1.
    """
    n, m = inst.to_bin.shape
    smallest, expanded, end = INFINITE, 0, -1
    for k in range(first, last):
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        b = place // m
        if here.total[k] >= limit or place >= m * m or b != place % m:
            continue
        expanded += 1
        left = here.key[k] >> PLACE_BITS
        if left == 0 and (end < 0 or here.cost[k] < here.cost[end]):
            end = k
        row = row_of(table, left)
        if after.size[0] + n > after.key.size:
            after, dropped = with_room_among(after, n, width)
            smallest = min(smallest, dropped)
        for i in range(n):
            if left >> i & 1:
                arrival = LegEnd(left, row, int(here.cost[k] + inst.from_bin[b, i]), 2 * k)
                offer_only(inst, table, after, arrival, i, limit)
    return after, smallest, expanded, end
