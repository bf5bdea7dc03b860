"""Kernels that expand one layer of the search.

Layer k contains the states in which k objects have been picked up. A state is encoded as U * 2^12 + place, where U is
the bit mask of the remaining objects. `planner.exact.moves` numbers the places.
"""

from typing import NamedTuple

from mjsim.support.kernels import inlined, kernel
from planner.exact.moves import NOTHING, Moves
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


class State(NamedTuple):
    """A state that is expanded."""

    place: int
    left: int  # bit mask of the remaining objects
    cost: int
    as_parent: int  # parent of its next states in the next layer, which is even, or `NO_PARENT`


@kernel
def row_of(table: CostTable, left: int) -> int:
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


@inlined
def offer_next(moves: Moves, table: CostTable, here: Nodes, after: Nodes, state: State, limit: int) -> None:
    """Add the states after each move to their layers if their totals are below the limit."""
    row = row_of(table, state.left)
    for j in range(NOTHING, table.stride.size):
        price, left, start = 0, state.left, row
        if j >= 0:
            if not left >> j & 1:
                continue
            price, left, start = table.multipliers[j], left ^ (1 << j), row - table.stride[j]
        for way in range(2):
            end = moves.end[state.place, j, way]
            if end >= 0:
                cost = state.cost + price + moves.length[state.place, j, way]
                total = cost + table.entries[start * table.width + moves.column[end]]
                if total < limit and j >= 0:
                    offer(after, (left << PLACE_BITS) | end, cost, total, state.as_parent)
                elif total < limit:
                    offer(here, (left << PLACE_BITS) | end, cost, total, state.as_parent | 1)


@kernel
def offer_first(moves: Moves, table: CostTable, here: Nodes, after: Nodes, limit: int) -> None:
    """Add the states that directly follow the start of a tour to the first two layers."""
    root = State(moves.end.shape[0] - 1, (1 << table.stride.size) - 1, 0, NO_PARENT)
    offer_next(moves, table, here, after, root, limit)


def expand(
    moves: Moves, table: CostTable, here: Nodes, after: Nodes, limit: int, width: int, deadline: Deadline
) -> Expanded | None:
    """Expand all states of a layer. Return None if the deadline passes first.

    States with an object in hand come before those with empty hands, because they lead to the latter.
    """
    smallest, states, end = INFINITE, 0, -1
    here = with_room(here, int(here.size[0]))
    for with_object in (True, False):
        size = int(here.size[0])
        for first in range(0, size, SLICE):
            if first and deadline.over():
                return None
            last = min(size, first + SLICE)
            after, dropped, count, end = expand_some(
                moves, table, here, after, limit, width, first, last, with_object, end
            )
            smallest, states = min(smallest, dropped), states + count
    return Expanded(here, after, smallest, states, end)


@kernel
def expand_some(
    moves: Moves,
    table: CostTable,
    here: Nodes,
    after: Nodes,
    limit: int,
    width: int,
    first: int,
    last: int,
    with_object: bool,
    end: int,
) -> tuple[Nodes, int, int, int]:
    """Expand the states of a layer from `first` to `last` - 1 that have an object in hand, or those that have none.

    Return the next layer, the smallest total of the dropped states, the number of states, and the best end so far.
    """
    n = table.stride.size
    smallest, expanded = INFINITE, 0
    for k in range(first, last):
        place, left = here.key[k] & ((1 << PLACE_BITS) - 1), here.key[k] >> PLACE_BITS
        if here.total[k] >= limit or (moves.end[place, NOTHING, 0] >= 0) != with_object:
            continue
        expanded += 1
        if left == 0 and not with_object and (end < 0 or here.cost[k] < here.cost[end]):
            end = k
        if after.size[0] + 2 * n > after.key.size:
            after, dropped = with_room_among(after, 2 * n, width)
            smallest = min(smallest, dropped)
        offer_next(moves, table, here, after, State(place, left, here.cost[k], 2 * k), limit)
    return after, smallest, expanded, end
