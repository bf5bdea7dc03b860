"""Kernels that expand a layer of the search: states by number of picks, pruned by a lower bound of the cost-to-go.

A node is a state (U, place, carried) with the length of the shortest known path to it; layer k holds states with
k objects picked. A state is coded as U 2^12 + place, where place b m + d means at bin b with an object for d,
b m + b at bin b with empty hands, and m m + i at object i with only that in hand. Arriving at a second object
is no state of its own: the next stop is one of two bins.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.deadline import Deadline
from planner.exact.instance import Instance
from planner.exact.nodes import NO_PARENT, Nodes, offer, with_room, with_room_among
from planner.exact.table import INFINITE, Table

PLACE_BITS = 12
SLICE = 1 << 12  # states that are expanded between looks at the clock: some 5 ms
CARRYING, EMPTY = range(2)  # stages of a layer: states that carry something, states that do not
STAGE, DONE, OF, SMALLEST, STATES, END = range(6)  # progress in a layer


class Expanded(NamedTuple):
    """The result of expanding a layer."""

    here: Nodes  # the layer, with states reached by leaving an object in its bin
    after: Nodes  # the next layer
    smallest: int  # smallest total left out of the next layer to save memory, `INFINITE` if none was
    states: int  # how many were expanded
    end: int  # index of the end of the shortest complete tour, -1 if there is none


@kernel
def row_of(table: Table, left: int) -> int:
    """Row of the bound's table for the set of objects left."""
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


class Arrival(NamedTuple):
    """The end of a leg: objects left as bits, their row of the table, length so far with multipliers, parent."""

    left: int
    row: int
    cost: int
    parent: int


@inlined
def offer_bin(
    inst: Instance, table: Table, nodes: Nodes, arrival: Arrival, b: int, d: int, limit: int
) -> None:
    """Offer the state at bin b carrying one for d (d = b: nothing), unless its total reaches the limit."""
    total = arrival.cost + table.bin[arrival.row, b, d]
    if total < limit:
        place = b * inst.bins.shape[0] + d
        offer(nodes, (arrival.left << PLACE_BITS) | place, arrival.cost, total, arrival.parent)


@inlined
def offer_second(
    inst: Instance, table: Table, nodes: Nodes, arrival: Arrival, j: int, d: int, limit: int
) -> None:
    """Pick j with one for d in hand, and offer the state at either bin; the arrival is at j, before the pick."""
    c = inst.home[j]
    left, row = arrival.left ^ (1 << j), arrival.row - table.stride[j]
    cost = arrival.cost + table.multipliers[j]
    first = Arrival(left, row, cost + inst.to_bin[j, d], arrival.parent)
    offer_bin(inst, table, nodes, first, d, c, limit)
    if c != d:
        second = Arrival(left, row, cost + inst.to_bin[j, c], arrival.parent)
        offer_bin(inst, table, nodes, second, c, d, limit)


@inlined
def offer_only(inst: Instance, table: Table, nodes: Nodes, arrival: Arrival, i: int, limit: int) -> None:
    """Pick i with empty hands, and offer the state there; the arrival is at i, before the pick."""
    cost = arrival.cost + table.multipliers[i]
    total = cost + table.object[arrival.row - table.stride[i], i]
    if total < limit:
        place = inst.bins.shape[0] ** 2 + i
        offer(nodes, ((arrival.left ^ (1 << i)) << PLACE_BITS) | place, cost, total, arrival.parent)


@kernel
def offer_roots(inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int) -> None:
    """Put the states that can follow the root into the first two layers."""
    n = inst.home.size
    left, row = (1 << n) - 1, table.bin.shape[0] - 1
    if inst.carried.size == 0:
        for i in range(n):
            arrival = Arrival(left, row, int(inst.root[i]), NO_PARENT)
            offer_only(inst, table, after, arrival, i, limit)
        return
    d, other = inst.carried[0], inst.carried[inst.carried.size - 1]
    offer_bin(inst, table, here, Arrival(left, row, int(inst.root_bin[d]), NO_PARENT), d, other, limit)
    if inst.carried.size == 2:
        offer_bin(
            inst, table, here, Arrival(left, row, int(inst.root_bin[other]), NO_PARENT), other, d, limit
        )
        return
    for j in range(n):
        offer_second(inst, table, after, Arrival(left, row, int(inst.root[j]), NO_PARENT), j, d, limit)


def expand(
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int, deadline: Deadline
) -> Expanded | None:
    """Offer all successors of a layer's states; None if the deadline was over before that was done."""
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
    table: Table,
    here: Nodes,
    after: Nodes,
    limit: int,
    width: int,
    progress: NDArray[np.int64],
) -> tuple[Nodes, Nodes]:
    """Expand one slice of a layer, first states that carry something, then those that do not.

    `progress`, (6,), has the stage, how many of its states are done, how many there are, and the last three fields of
    `Expanded`. Totals to offer are below `limit`; of the next layer, `width` states will be kept.
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
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int]:
    """Offer what follows states with one in hand, numbers `first` to `last`; there must be room in this layer.

    Returns the next layer, the smallest total left out of it, and how many states were expanded.
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
        arrival = Arrival(left, row, int(here.cost[k] + home_leg), 2 * k + 1)
        offer_bin(inst, table, here, arrival, d, d, limit)
        if after.size[0] + 2 * n > after.key.size:
            after, dropped = with_room_among(after, 2 * n, width)
            smallest = min(smallest, dropped)
        for j in range(n):
            if not left >> j & 1:
                continue
            leg = inst.between[i, j] if i >= 0 else inst.from_bin[b, j]
            arrival = Arrival(left, row, int(here.cost[k] + leg), 2 * k)
            offer_second(inst, table, after, arrival, j, d, limit)
    return after, smallest, expanded


@kernel
def expand_empty(
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int, int]:
    """The same for states with empty hands; returns the index of the end of the shortest complete tour, too."""
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
                arrival = Arrival(left, row, int(here.cost[k] + inst.from_bin[b, i]), 2 * k)
                offer_only(inst, table, after, arrival, i, limit)
    return after, smallest, expanded, end
