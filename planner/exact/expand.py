"""A kernel that expands one layer of the search.

Layer k contains the states in which k objects have been picked up. A state is encoded as U * 2^12 + place, where U is
the bit mask of the remaining objects. `planner.exact.moves` numbers the places.
"""

from typing import NamedTuple

from mjsim.support.kernels import kernel
from planner.exact.moves import NOTHING, Moves
from planner.exact.multipliers import Bound
from planner.exact.nodes import FIRST_ROOM, NO_PARENT, Nodes, new_nodes, offer, with_room, with_room_among
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


def root_layer(bound: Bound) -> Nodes:
    """Return the first layer, which contains only the start of the tour."""
    n, m = bound.instance.to_bin.shape
    nodes = new_nodes(FIRST_ROOM)
    nodes.size[0], nodes.key[0] = 1, (((1 << n) - 1) << PLACE_BITS) | (m * m + n)
    nodes.cost[0], nodes.total[0], nodes.parent[0] = 0, bound.root + bound.prices, NO_PARENT
    return nodes


@kernel
def row_of(table: CostTable, left: int) -> int:
    row = 0
    for j in range(table.stride.size):
        if left >> j & 1:
            row += table.stride[j]
    return row


def expand(
    moves: Moves, table: CostTable, here: Nodes, limit: int, width: int, deadline: Deadline
) -> Expanded | None:
    """Expand all states of a layer whose totals are below the limit. Return None if the deadline passes first.

    States with an object in hand come before those with empty hands, because they lead to the latter.
    """
    smallest, states, end = INFINITE, 0, -1
    here, after = with_room(here, int(here.size[0])), new_nodes(FIRST_ROOM)
    for carrying in (True, False):
        first = 0
        while first < here.size[0]:
            if first and deadline.over():
                return None
            last = min(int(here.size[0]), first + SLICE)
            after, dropped, count, found = expand_some(
                moves, table, here, after, limit, width, first, last, carrying
            )
            smallest, states, first = min(smallest, dropped), states + count, last
            if found >= 0 and (end < 0 or here.cost[found] < here.cost[end]):
                end = int(found)
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
    carrying: bool,
) -> tuple[Nodes, int, int, int]:
    """Expand the states from `first` to `last` - 1 with an object in hand, or those with empty hands."""
    n = moves.end.shape[1] - 1
    smallest, expanded, end = INFINITE, 0, -1
    for k in range(first, last):
        place, left = here.key[k] & ((1 << PLACE_BITS) - 1), here.key[k] >> PLACE_BITS
        if here.total[k] >= limit or (moves.end[place, NOTHING, 0] >= 0) != carrying:
            continue
        expanded += 1
        if left == 0 and not carrying and (end < 0 or here.cost[k] < here.cost[end]):
            end = k
        if after.size[0] + 2 * n > after.key.size:
            after, dropped = with_room_among(after, 2 * n, width)
            smallest = min(smallest, dropped)
        row = row_of(table, left)
        for j in range(NOTHING if carrying else 0, n):
            if j >= 0 and not left >> j & 1:
                continue
            below, price, then = row, 0, left
            if j >= 0:
                below, price, then = row - table.stride[j], table.multipliers[j], left ^ (1 << j)
            for way in range(2):
                there = moves.end[place, j, way]
                if there < 0:
                    continue
                cost = here.cost[k] + moves.length[place, j, way] + price
                total = cost + table.entries[below * table.width + moves.column[there]]
                if total < limit and j >= 0:
                    offer(after, (then << PLACE_BITS) | there, cost, total, 2 * k)
                elif total < limit:
                    offer(here, (then << PLACE_BITS) | there, cost, total, 2 * k + 1)
    return after, smallest, expanded, end
