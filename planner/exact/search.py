"""Layered beam search: states by number of picks, pruned by a lower bound of the cost-to-go.

A node is a state (U, place, carried) with the length of the shortest known way to it; layer k holds states with
k objects picked. A state is coded as U 2^12 + place, where place b m + d means at bin b with an object for d,
b m + b at bin b with empty hands, and m m + i at object i with only that in hand. Arriving at a second object
is no state of its own: from there the way leads to one of two bins.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.instance import Instance
from planner.exact.relaxation import INFINITE, Table, row_without
from planner.kernels import kernel

PLACE_BITS = 12
NO_PARENT = -1


class Nodes(NamedTuple):
    """States of one layer with a hash index; the arrays have room to grow.

    Attributes:
        size: Number of states, (1,) int64.
        key: Code of each state, int64.
        cost: Length of the shortest known way, int32.
        total: Cost plus bound of the cost-to-go, int32.
        parent: 2 x index of the state before + (1 if that is in the same layer), or `NO_PARENT`, int64.
        slots: Hash table of indices, -1 where empty, a power of two long, int32.
    """

    size: NDArray[np.int64]
    key: NDArray[np.int64]
    cost: NDArray[np.int32]
    total: NDArray[np.int32]
    parent: NDArray[np.int64]
    slots: NDArray[np.int32]


@kernel
def new_nodes(room: int) -> Nodes:
    """An empty layer with room for a number of states, a power of two."""
    return Nodes(
        np.zeros(1, np.int64),
        np.empty(room, np.int64),
        np.empty(room, np.int32),
        np.empty(room, np.int32),
        np.empty(room, np.int64),
        np.full(2 * room, -1, np.int32),
    )


@kernel
def slot_of(nodes: Nodes, key: int) -> int:
    """Slot that holds a key, or the empty one where it belongs."""
    mask = nodes.slots.size - 1
    mixed = np.uint64(key) * np.uint64(0x9E3779B97F4A7C15)
    slot = int(mixed >> np.uint64(29)) & mask
    while nodes.slots[slot] >= 0 and nodes.key[nodes.slots[slot]] != key:
        slot = (slot + 1) & mask
    return slot


@kernel
def with_room(nodes: Nodes, more: int) -> Nodes:
    """The same layer with room for so many more states."""
    size = nodes.size[0]
    room = nodes.key.size
    if size + more <= room:
        return nodes
    while size + more > room:
        room *= 2
    wider = new_nodes(room)
    wider.size[0] = size
    for k in range(size):
        wider.key[k] = nodes.key[k]
        wider.cost[k] = nodes.cost[k]
        wider.total[k] = nodes.total[k]
        wider.parent[k] = nodes.parent[k]
        wider.slots[slot_of(wider, wider.key[k])] = k
    return wider


@kernel
def offer(nodes: Nodes, key: int, cost: int, total: int, parent: int) -> None:
    """Add a state, or shorten the way to it; there must be room."""
    slot = slot_of(nodes, key)
    k = nodes.slots[slot]
    if k < 0:
        k = nodes.size[0]
        nodes.size[0] = k + 1
        nodes.slots[slot] = k
        nodes.key[k] = key
    elif cost >= nodes.cost[k]:
        return
    nodes.cost[k] = cost
    nodes.total[k] = total
    nodes.parent[k] = parent


@kernel
def row_of(left: int, s: int) -> int:
    """Row of the bound's table for the set of objects left."""
    others = left >> s
    count = 0
    while others:
        others &= others - 1
        count += 1
    return (count << s) | (left & ((1 << s) - 1))


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
    left, row = left ^ (1 << j), row_without(row, j, table.s)
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
    total = cost + table.object[row_without(row, i, table.s), i]
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


@kernel
def smallest_but(values: NDArray[np.int32], size: int, count: int) -> int:
    """Least number that at least `count` of the first `size` values do not exceed.

    By bisection: reading an array 20 times takes no longer than partitioning a copy, and compiles in no time.
    """
    low, high = np.int32(INFINITE), np.int32(-INFINITE)
    for k in range(size):
        low, high = min(low, values[k]), max(high, values[k])
    while low < high:
        middle = np.int32((low + high) >> 1)
        below = 0
        for k in range(size):
            below += values[k] <= middle
        if below >= count:
            high = middle
        else:
            low = np.int32(middle + 1)
    return int(low)


@kernel
def keep_best(nodes: Nodes, width: int) -> tuple[Nodes, int]:
    """Only the most promising states, and the smallest total dropped (`INFINITE` if none was)."""
    size = nodes.size[0]
    if size <= width:
        return nodes, INFINITE
    bar = smallest_but(nodes.total, size, width)
    ties = width
    for k in range(size):
        if nodes.total[k] < bar:
            ties -= 1
    room = 1
    while room < 2 * width:
        room *= 2
    kept, smallest = new_nodes(room), INFINITE
    for k in range(size):
        if nodes.total[k] == bar and ties > 0:
            ties -= 1
        elif nodes.total[k] >= bar:
            smallest = min(smallest, nodes.total[k])
            continue
        offer(kept, nodes.key[k], nodes.cost[k], nodes.total[k], nodes.parent[k])
    return kept, smallest


@kernel
def with_room_among(nodes: Nodes, more: int, width: int) -> tuple[Nodes, int]:
    """Make room by dropping states that are not among the best 2 `width` when there are twice as many.

    They would not be among the best `width` later either.
    """
    smallest = INFINITE
    if nodes.size[0] + more > nodes.key.size and nodes.size[0] > 4 * width:
        nodes, smallest = keep_best(nodes, 2 * width)
    return with_room(nodes, more), smallest


@kernel
def expand(
    inst: Instance, table: Table, here: Nodes, after: Nodes, limit: int, width: int
) -> tuple[Nodes, Nodes, int, int, int]:
    """Offer all successors of a layer's states.

    Returns:
        This layer with states reached by dropping, the next layer, the smallest total dropped from it to save
        memory, how many states were expanded, and the index of the end of the shortest complete tour (-1 if
        there is none).
    """
    n, m = inst.to_bin.shape
    size, smallest, expanded, end = here.size[0], INFINITE, 0, -1
    here = with_room(here, size)
    for k in range(size):
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        i = place - m * m
        b, d = place // m, place % m
        if here.total[k] >= limit or (i < 0 and b == d):
            continue
        expanded += 1
        if i >= 0:
            d, legs, home_leg = inst.home[i], inst.between[i], inst.to_bin[i, inst.home[i]]
        else:
            legs, home_leg = inst.from_bin[b], inst.bins[b, d]
        left = here.key[k] >> PLACE_BITS
        row = row_of(left, table.s)
        offer_bin(inst, table, here, left, row, d, d, here.cost[k] + home_leg, limit, 2 * k + 1)
        after, dropped = with_room_among(after, 2 * n, width)
        smallest = min(smallest, dropped)
        for j in range(n):
            if (left >> j) & 1:
                offer_second(inst, table, after, left, row, j, d, here.cost[k] + legs[j], limit, 2 * k)
    for k in range(here.size[0]):
        place = here.key[k] & ((1 << PLACE_BITS) - 1)
        b = place // m
        if here.total[k] >= limit or place >= m * m or b != place % m:
            continue
        expanded += 1
        left = here.key[k] >> PLACE_BITS
        if left == 0 and (end < 0 or here.cost[k] < here.cost[end]):
            end = k
        row = row_of(left, table.s)
        after, dropped = with_room_among(after, n, width)
        smallest = min(smallest, dropped)
        for i in range(n):
            if (left >> i) & 1:
                offer_only(inst, table, after, left, row, i, here.cost[k] + inst.from_bin[b, i], limit, 2 * k)
    return here, after, smallest, expanded, end
