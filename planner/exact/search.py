"""Layered beam search: states by number of picks, pruned by a lower bound of the cost-to-go.

A node is a state (U, place, carried) with the length of the shortest known way to it; layer k holds states with
k objects picked. A state is coded as U 2^12 + place, where place b m + d means at bin b with an object for d,
b m + b at bin b with empty hands, and m m + i at object i with only that in hand. Arriving at a second object
is no state of its own: from there the way leads to one of two bins.
"""

from typing import NamedTuple

from mjsim.kernels import kernel
from planner.exact.deadline import Deadline
from planner.exact.instance import Instance
from planner.exact.nodes import NO_PARENT, Nodes, offer, with_room, with_room_among
from planner.exact.table import INFINITE, Table

PLACE_BITS = 12
SLICE = 1 << 12  # states that are expanded between looks at the clock: some 5 ms


class Expanded(NamedTuple):
    """What comes of expanding a layer.

    Attributes:
        here: The layer, with states reached by dropping.
        after: The next layer.
        smallest: Smallest total dropped from the next layer to save memory, `INFINITE` if none was.
        states: How many were expanded.
        end: Index of the end of the shortest complete tour, -1 if there is none.
    """

    here: Nodes
    after: Nodes
    smallest: int
    states: int
    end: int


@kernel
def row_of(table: Table, left: int) -> int:
    """Row of the bound's table for the set of objects left."""
    row = 0
    for j in range(table.stride.size):
        if (left >> j) & 1:
            row += table.stride[j]
    return row


@kernel
def offer_bin(
    inst: Instance,
    table: Table,
    nodes: Nodes,
    left: int,
    row: int,
    b: int,
    d: int,
    cost: int,
    limit: int,
    parent: int,
) -> None:
    """Offer the state at bin b carrying one for d (d = b: nothing), unless its total reaches the limit."""
    total = cost + table.bin[row, b, d]
    if total < limit:
        m = inst.bins.shape[0]
        offer(nodes, (left << PLACE_BITS) | (b * m + d), cost, total, parent)


@kernel
def offer_second(
    inst: Instance,
    table: Table,
    nodes: Nodes,
    left: int,
    row: int,
    j: int,
    d: int,
    cost: int,
    limit: int,
    parent: int,
) -> None:
    """Pick j, reached at a cost with one for d in hand, and offer both ways on; `left` and `row` have j."""
    c = inst.home[j]
    left, row = left ^ (1 << j), row - table.stride[j]
    cost += table.multipliers[j]
    offer_bin(inst, table, nodes, left, row, d, c, cost + inst.to_bin[j, d], limit, parent)
    if c != d:
        offer_bin(inst, table, nodes, left, row, c, d, cost + inst.to_bin[j, c], limit, parent)


@kernel
def offer_only(
    inst: Instance,
    table: Table,
    nodes: Nodes,
    left: int,
    row: int,
    i: int,
    cost: int,
    limit: int,
    parent: int,
) -> None:
    """Pick i, reached at a cost with empty hands, and offer the state there; `left` and `row` have i."""
    m = inst.bins.shape[0]
    cost += table.multipliers[i]
    total = cost + table.object[row - table.stride[i], i]
    if total < limit:
        offer(nodes, ((left ^ (1 << i)) << PLACE_BITS) | (m * m + i), cost, total, parent)


@kernel
def offer_roots(inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int) -> None:
    """Put the states that can follow the root into the first two layers."""
    n = inst.home.size
    everything, row = (1 << n) - 1, table.bin.shape[0] - 1
    if inst.carried.size == 0:
        for i in range(n):
            offer_only(inst, table, after, everything, row, i, inst.root[i], limit, NO_PARENT)
        return
    d = inst.carried[0]
    other = inst.carried[inst.carried.size - 1]
    offer_bin(inst, table, here, everything, row, d, other, inst.root_bin[d], limit, NO_PARENT)
    if inst.carried.size == 2:
        offer_bin(inst, table, here, everything, row, other, d, inst.root_bin[other], limit, NO_PARENT)
        return
    for j in range(n):
        offer_second(inst, table, after, everything, row, j, d, inst.root[j], limit, NO_PARENT)


def expand(
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int, deadline: Deadline
) -> Expanded | None:
    """Offer all successors of a layer's states; None if the deadline was over before that was done."""
    size, smallest, expanded, end = int(here.size[0]), INFINITE, 0, -1
    here = with_room(here, size)
    for first in range(0, size, SLICE):
        if deadline.over():
            return None
        last = min(size, first + SLICE)
        after, dropped, count = expand_carrying(inst, table, here, after, limit, width, first, last)
        smallest, expanded = min(smallest, dropped), expanded + count
    size = int(here.size[0])
    for first in range(0, size, SLICE):
        if deadline.over():
            return None
        last = min(size, first + SLICE)
        after, dropped, count, end = expand_empty(inst, table, here, after, limit, width, first, last, end)
        smallest, expanded = min(smallest, dropped), expanded + count
    return Expanded(here, after, smallest, expanded, end)


@kernel
def expand_carrying(
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int]:
    """Offer what follows states with one in hand, numbers `first` to `last`; there must be room in this layer.

    Returns:
        The next layer, the smallest total dropped from it to save memory, how many states were expanded.
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
        offer_bin(inst, table, here, left, row, d, d, here.cost[k] + home_leg, limit, 2 * k + 1)
        if after.size[0] + 2 * n > after.key.size:
            after, dropped = with_room_among(after, 2 * n, width)
            smallest = min(smallest, dropped)
        for j in range(n):
            if (left >> j) & 1:
                leg = inst.between[i, j] if i >= 0 else inst.from_bin[b, j]
                offer_second(inst, table, after, left, row, j, d, here.cost[k] + leg, limit, 2 * k)
    return after, smallest, expanded


@kernel
def expand_empty(
    inst: Instance,
    table: Table,
    here: Nodes,
    after: Nodes,
    limit: int,
    width: int,
    first: int,
    last: int,
    end: int,
) -> tuple[Nodes, int, int, int]:
    """Offer what follows states with empty hands, numbers `first` to `last`.

    Returns:
        As for those with one in hand, and the index of the end of the shortest complete tour so far.
    """
    n, m = inst.to_bin.shape
    smallest, expanded = INFINITE, 0
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
            if (left >> i) & 1:
                offer_only(inst, table, after, left, row, i, here.cost[k] + inst.from_bin[b, i], limit, 2 * k)
    return after, smallest, expanded, end
