"""Kernels that expand one layer of the search.

Layer k contains the states in which k objects have been picked up. A state is encoded as U * 2^12 + place, where U is
the bit mask of the remaining objects. `planner.exact.moves` numbers the places. These kernels read the distances of the
instance instead of its moves, with which a layer takes half as much time more.
"""

from typing import NamedTuple

from mjsim.support.kernels import inlined, kernel
from planner.exact.instance import Instance
from planner.exact.nodes import NO_PARENT, Nodes, offer, with_room, with_room_among
from planner.exact.table import INFINITE, CostTable
from planner.solvers import Deadline

PLACE_BITS = 12
SLICE = 1 << 12  # number of states expanded between two checks of the deadline, which takes about 5 ms


class Expanded(NamedTuple):
    """The result of expanding a layer."""

    here: Nodes  # the expanded layer, including states reached by placing an object in its bin
    after: Nodes  # the next layer
    smallest: int  # smallest total of all states dropped to save memory, or `INFINITE`
    states: int  # number of expanded states
    end: int  # index of the state that ends the shortest complete tour, or -1


@kernel
def row_of(table: CostTable, left: int) -> int:
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


class LegEnd(NamedTuple):
    """The state at the end of a leg, before an object is picked up or placed."""

    left: int
    row: int
    cost: int
    parent: int


@inlined
def offer_bin(
    inst: Instance, table: CostTable, nodes: Nodes, arrival: LegEnd, b: int, d: int, limit: int
) -> None:
    """Add a state at bin b to a layer if the total of the state is below the limit."""
    total = arrival.cost + table.bin[arrival.row, b, d]
    if total < limit:
        place = b * inst.bins.shape[0] + d
        offer(nodes, (arrival.left << PLACE_BITS) | place, arrival.cost, total, arrival.parent)


@inlined
def offer_second(
    inst: Instance, table: CostTable, nodes: Nodes, arrival: LegEnd, j: int, d: int, limit: int
) -> None:
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
    cost = arrival.cost + table.multipliers[i]
    total = cost + table.object[arrival.row - table.stride[i], i]
    if total < limit:
        place = inst.bins.shape[0] ** 2 + i
        offer(nodes, ((arrival.left ^ (1 << i)) << PLACE_BITS) | place, cost, total, arrival.parent)


@kernel
def offer_roots(inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int) -> None:
    """Add the states that directly follow the start of a tour to the first two layers."""
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
    """Expand all states of a layer. Return None if the deadline passes first.

    States with an object in hand come before those with empty hands, because they lead to the latter.
    """
    smallest, states, end = INFINITE, 0, -1
    here = with_room(here, int(here.size[0]))
    for expand_some in (expand_carrying, expand_empty):
        size = int(here.size[0])
        for first in range(0, size, SLICE):
            if first and deadline.over():
                return None
            last = min(size, first + SLICE)
            after, dropped, count, found = expand_some(inst, table, here, after, limit, width, first, last)
            smallest, states = min(smallest, dropped), states + count
            if found >= 0 and (end < 0 or here.cost[found] < here.cost[end]):
                end = int(found)
    return Expanded(here, after, smallest, states, end)


@kernel
def expand_carrying(
    inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int, int]:
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
            leg = inst.between[i, j] if i >= 0 else inst.to_bin[j, b]
            arrival = LegEnd(left, row, int(here.cost[k] + leg), 2 * k)
            offer_second(inst, table, after, arrival, j, d, limit)
    return after, smallest, expanded, -1


@kernel
def expand_empty(
    inst: Instance, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, first: int, last: int
) -> tuple[Nodes, int, int, int]:
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
                arrival = LegEnd(left, row, int(here.cost[k] + inst.to_bin[i, b]), 2 * k)
                offer_only(inst, table, after, arrival, i, limit)
    return after, smallest, expanded, end
