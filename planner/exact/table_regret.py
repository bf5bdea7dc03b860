"""Compute the costs of all possible next visits from a full table or by an exhaustive search."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from planner.exact.expand import PLACE_BITS, expand, root_layer
from planner.exact.instance import MAX_SEARCHED
from planner.exact.moves import NOTHING, Moves, moves_of
from planner.exact.multipliers import Bound
from planner.exact.nodes import Nodes, slot_of
from planner.exact.table import INFINITE, CostTable
from planner.plan import Visit, VisitKind
from planner.solvers import Deadline

UNLIMITED = 1 << 40  # search width at which no states are dropped

Costs = dict[Visit, int]  # length of the remaining tour in units, by next visit


def costs_in(moves: Moves, table: CostTable, row: int, names: Sequence[str], carried: Sequence[str]) -> Costs:
    """Return the cost of each possible next visit. If the table is relaxed, return lower bounds, plus the prices.

    `row` is the table row of the objects that remain at the start. `names` contains the names of the
    instance's objects, and `carried` the names of the carried objects.
    """
    loose = np.flatnonzero(row // table.stride % (table.size[table.group] + 1)).tolist()

    def rest(picked: int, place: int) -> int:
        if picked == NOTHING:
            return int(table.entries[row * table.width + moves.column[place]])
        left = row - int(table.stride[picked])
        return int(table.multipliers[picked]) + int(table.entries[left * table.width + moves.column[place]])

    return _first_costs(moves, {k: names[k] for k in loose}, carried, rest)


def _first_costs(
    moves: Moves, loose: Mapping[int, str], carried: Sequence[str], rest: Callable[[int, int], int]
) -> Costs:
    """Return the cost of each next visit. `rest` returns the cost after picking up an object and going to a place."""
    ends, lengths = moves.end[-1].tolist(), moves.length[-1].tolist()
    ways = {
        k: [length + rest(k, end) for end, length in zip(ends[k], lengths[k], strict=True) if end >= 0]
        for k in (NOTHING, *loose)
    }
    drops = {Visit(VisitKind.PLACE, name): cost for name, cost in zip(carried, ways[NOTHING], strict=True)}
    return drops | {Visit(VisitKind.PICK, name): min(ways[k]) for k, name in loose.items() if ways[k]}


def costs_by_pass(
    bound: Bound,
    names: Sequence[str],
    carried: Sequence[str],
    longest: int,
    max_states: int,
    deadline: Deadline,
) -> tuple[Costs | None, int]:
    """Return the cost of each possible next visit in units, and the number of states.

    Costs above `longest` are not exact. The search visits every state on a tour of at most this length. A
    backward sweep then computes the shortest remaining tour from each state. `names` and `carried` contain the names
    of the loose and the carried objects. The costs are None if there are too many objects, more than `max_states`
    states, or the deadline has passed.
    """
    moves, table, n = moves_of(bound.instance), bound.table, len(names)
    if n > MAX_SEARCHED:
        return None, 0
    limit = longest + 1 + bound.prices
    layers: list[Nodes] = []
    here, states = root_layer(bound), 0
    for _ in range(n + 1):
        expanded = expand(moves, table, here, limit, UNLIMITED, deadline)
        if expanded is None:
            return None, states
        layers.append(expanded.here)
        states += int(expanded.here.size[0])
        if states > max_states:
            return None, states
        here = expanded.after
    lengths = [np.zeros(0, np.int64)] * (n + 2)
    layers.append(here)
    for k in range(n, -1, -1):
        lengths[k] = sweep(moves, layers[k], layers[k + 1], lengths[k + 1])

    def rest(picked: int, place: int) -> int:
        k, picks = (0, 0) if picked == NOTHING else (1, 1 << picked)
        return int(look_up(layers[k], lengths[k], ((1 << n) - 1) ^ picks, place))

    return _first_costs(moves, dict(enumerate(names)), carried, rest), states


@kernel
def look_up(nodes: Nodes, rest: NDArray[np.int64], left: int, place: int) -> int:
    k = nodes.slots[slot_of(nodes, (left << PLACE_BITS) | place)]
    return int(rest[k]) if k >= 0 else INFINITE


@kernel
def sweep(moves: Moves, here: Nodes, after: Nodes, after_rest: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the remaining tour length of each state in a layer, given the lengths for the next layer."""
    rest = np.full(here.size[0], INFINITE, np.int64)
    for with_object in (False, True):  # placing an object leads to a state with empty hands in the same layer
        for k in range(here.size[0]):
            place, left = here.key[k] & ((1 << PLACE_BITS) - 1), here.key[k] >> PLACE_BITS
            home = moves.end[place, NOTHING, 0]
            if (home >= 0) != with_object:
                continue
            best = INFINITE if left else 0
            if with_object:
                best = min(INFINITE, moves.length[place, NOTHING, 0] + look_up(here, rest, left, home))
            for j in range(moves.end.shape[1] - 1):
                if not left >> j & 1:
                    continue
                for way in range(2):
                    end = moves.end[place, j, way]
                    if end >= 0:
                        then = look_up(after, after_rest, left ^ (1 << j), end)
                        best = min(best, moves.length[place, j, way] + then)
            rest[k] = best
    return rest
