"""Kernels that expand one layer of the search.

Layer k contains the states in which k objects have been picked up. A state is encoded as U * 2^12 + place,
where U is the bit mask of the remaining objects. The place is the column of the state in a cost table: `2 m b + d`
at bin b with an object for bin d in hand, `2 m b + b` at bin b with empty hands, and `2 m m + i` at object i with
only this object in hand. The start is the place `2 m m + n`. There are no states at a second object, because the
person always goes on to one of two bins.
"""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.instance import Instance
from planner.exact.nodes import (
    FIRST_ROOM,
    NO_PARENT,
    Nodes,
    keep_best,
    new_nodes,
    offer,
    with_room,
    with_room_among,
)
from planner.exact.table import INFINITE, CostTable
from planner.solvers import Deadline

PLACE_BITS = 12
SLICE = 1 << 12  # number of states expanded between two checks of the deadline, which takes about 5 ms


class Search(NamedTuple):
    """A search that keeps the best `width` states of each layer, among those with a total below `limit`."""

    instance: Instance
    table: CostTable  # lower bounds on the cost-to-go
    limit: int
    width: int


class Expanded(NamedTuple):
    """The result of expanding a layer."""

    here: Nodes  # the expanded layer, including states reached by placing an object in its bin
    smallest: int  # smallest total of all dropped states, or `INFINITE`
    states: int  # number of expanded states
    end: int  # index of the state that ends the shortest complete tour, or -1


class Arcs(NamedTuple):
    """The legs that lead from a state to the next state."""

    key: NDArray[np.int64]  # code of the state at the end of each leg
    leg: NDArray[np.int64]  # length of each leg, which includes the way from a second object to a bin
    picked: NDArray[np.int64]  # object that is picked up, or -1 if the leg only leads to a bin


@kernel
def row_of(table: CostTable, left: int) -> int:
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


@inlined
def place_of(key: int) -> int:
    return key & ((1 << PLACE_BITS) - 1)


@inlined
def is_empty_handed(inst: Instance, key: int) -> bool:
    m = inst.bins.shape[0]
    place = place_of(key)
    return place < 2 * m * m and place // (2 * m) == place % (2 * m)


@kernel
def new_arcs(inst: Instance) -> Arcs:
    size = 2 * inst.home.size + 2
    return Arcs(np.empty(size, np.int64), np.empty(size, np.int64), np.empty(size, np.int64))


@inlined
def add_arc(arcs: Arcs, count: int, left: int, place: int, leg: int, picked: int) -> int:
    arcs.key[count], arcs.leg[count], arcs.picked[count] = left << PLACE_BITS | place, leg, picked
    return count + 1


@inlined
def arcs_from(inst: Instance, key: int, arcs: Arcs) -> int:
    """Write the legs that lead from a state to `arcs`, and return their number."""
    n, m = inst.to_bin.shape
    left, place = key >> PLACE_BITS, place_of(key)
    i, b, count = place - 2 * m * m, place // (2 * m), 0
    first, second = -1, -1  # bins of the objects in hand
    to_object, to_bin = inst.root, inst.root_bin
    if i == n:
        if inst.carried.size > 0:
            first, second = inst.carried[0], inst.carried[1] if inst.carried.size > 1 else -1
    elif i >= 0:
        to_object, to_bin, first = inst.between[i], inst.to_bin[i], inst.home[i]
    else:
        to_object, to_bin = inst.from_bin[b], inst.bins[b]
        first = place % (2 * m)
        first = first if first != b else -1
    if first >= 0:
        count = add_arc(
            arcs, count, left, 2 * m * first + (second if second >= 0 else first), to_bin[first], -1
        )
    if second >= 0:
        return add_arc(arcs, count, left, 2 * m * second + first, to_bin[second], -1)
    for j in range(n):
        if not left >> j & 1:
            continue
        rest, c, leg = left ^ (1 << j), inst.home[j], to_object[j]
        if first < 0:
            count = add_arc(arcs, count, rest, 2 * m * m + j, leg, j)
            continue
        count = add_arc(arcs, count, rest, 2 * m * first + c, leg + inst.to_bin[j, first], j)
        if c != first:
            count = add_arc(arcs, count, rest, 2 * m * c + first, leg + inst.to_bin[j, c], j)
    return count


@inlined
def offer_next(
    search: Search, here: Nodes, after: Nodes, state: tuple[int, int, int, int], arcs: Arcs
) -> None:
    """Add the states that follow a state to its own layer or to the next layer.

    `state` contains the state's key and cost, and its code as a parent in both layers.
    """
    inst, table, (key, cost, parent_here, parent_after) = search.instance, search.table, state
    m = inst.bins.shape[0]
    width, row = 2 * m * m + inst.home.size, row_of(table, key >> PLACE_BITS)
    for a in range(arcs_from(inst, key, arcs)):
        j, onward, there = arcs.picked[a], cost + arcs.leg[a], row
        if j >= 0:
            there, onward = row - table.stride[j], onward + table.multipliers[j]
        total = onward + table.entries[there * width + place_of(arcs.key[a])]
        if total < search.limit and j < 0:
            offer(here, arcs.key[a], onward, total, parent_here)
        elif total < search.limit:
            offer(after, arcs.key[a], onward, total, parent_after)


@kernel
def first_layers(search: Search) -> tuple[Nodes, Nodes]:
    """Return the first two layers, with the states that directly follow the start of a tour."""
    n, m = search.instance.to_bin.shape
    here, after = new_nodes(FIRST_ROOM), new_nodes(FIRST_ROOM)
    key = ((1 << n) - 1) << PLACE_BITS | (2 * m * m + n)
    offer_next(search, here, after, (key, 0, NO_PARENT, NO_PARENT), new_arcs(search.instance))
    return here, after


@kernel
def expand(
    search: Search, here: Nodes, after: Nodes, first: int, last: int, empty: bool, end: int
) -> tuple[Nodes, int, int, int]:
    """Expand a range of states with empty or full hands.

    Return the next layer, the smallest dropped total, the number of expanded states, and the updated `end`.
    """
    smallest, expanded, arcs = INFINITE, 0, new_arcs(search.instance)
    most = search.instance.home.size if empty else 2 * search.instance.home.size
    for k in range(first, last):
        key, cost = here.key[k], here.cost[k]
        if here.total[k] >= search.limit or is_empty_handed(search.instance, key) != empty:
            continue
        expanded += 1
        if key >> PLACE_BITS == 0 and empty and (end < 0 or cost < here.cost[end]):
            end = k
        if after.size[0] + most > after.key.size:
            after, dropped = with_room_among(after, most, search.width)
            smallest = min(smallest, dropped)
        offer_next(search, here, after, (key, cost, 2 * k + 1, 2 * k), arcs)
    return after, smallest, expanded, end


def layers(search: Search, deadline: Deadline) -> Iterator[Expanded]:
    """Expand all layers in turn, beginning with that of the start. There are fewer layers if the deadline passes."""
    here, after = first_layers(search)
    for _ in range(len(search.instance.home) + 1):
        here, smallest = keep_best(here, search.width)
        here, states, end = with_room(here, here.size[0]), 0, -1
        for empty in (False, True):  # states with an object in hand come before those with empty hands
            size = int(here.size[0])
            for first in range(0, size, SLICE):
                if deadline.over():
                    return
                last = min(first + SLICE, size)
                after, dropped, count, end = expand(search, here, after, first, last, empty, end)
                smallest, states = min(smallest, dropped), states + count
        yield Expanded(here, smallest, states, end)
        here, after = after, new_nodes(FIRST_ROOM)
