"""Compute the costs of all possible next visits from a full table or by an exhaustive search."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import inlined, kernel
from planner.exact.expand import (
    PLACE_BITS,
    Arcs,
    Search,
    arcs_from,
    is_empty_handed,
    layers,
    new_arcs,
    row_of,
)
from planner.exact.instance import MAX_SEARCHED, Instance
from planner.exact.multipliers import Bound
from planner.exact.nodes import Nodes, new_nodes, slot_of
from planner.exact.table import INFINITE, CostTable
from planner.plan import Visit, VisitKind
from planner.solvers import Deadline

UNLIMITED = 1 << 40  # search width at which no states are dropped

Costs = dict[Visit, int]  # length of the remaining tour in units, by next visit


def costs_in(
    instance: Instance, table: CostTable, left: int, names: Sequence[str], carried: Sequence[str]
) -> Costs:
    """Return the cost of each possible next visit. If the table is relaxed, return lower bounds, plus the prices.

    `left` is the bit mask of the objects that remain at the start. `names` contains the names of the instance's
    objects, and `carried` the names of the carried objects.
    """
    arcs, width = start_arcs(instance, left), 2 * len(instance.bins) ** 2 + len(instance.home)
    rows = row_of(table, left) - np.append(table.stride, 0)[arcs.picked]
    rest = table.entries[rows * width + (arcs.key & ((1 << PLACE_BITS) - 1))].astype(np.int64)
    return _by_visit(instance, arcs, rest + np.append(table.multipliers, 0)[arcs.picked], names, carried)


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
    backward sweep then computes the shortest remaining tour from each state. The arguments `names` and `carried` are
    those of `costs_in`. The costs are None if there are too many objects, more than `max_states` states, or the
    deadline has passed.
    """
    instance, n = bound.instance, len(bound.instance.home)
    if n > MAX_SEARCHED:
        return None, 0
    found: list[Nodes] = []
    states = 0
    search = Search(instance, bound.table, longest + 1 + bound.prices, UNLIMITED)
    for layer in layers(search, deadline):
        found.append(layer.here)
        states += int(layer.here.size[0])
        if states > max_states:
            return None, states
    if len(found) <= n:
        return None, states
    after, after_rest = new_nodes(1), np.zeros(0, np.int64)
    for here in found[::-1]:
        second = after, after_rest
        after_rest = sweep(instance, here, *second)
        after = here
    arcs = start_arcs(instance, (1 << n) - 1)
    rest = rests(arcs, after, after_rest, *second)
    return _by_visit(instance, arcs, rest, names, carried), states


def _by_visit(
    instance: Instance, arcs: Arcs, rest: NDArray[np.int64], names: Sequence[str], carried: Sequence[str]
) -> Costs:
    """Return the least cost of the first legs of each visit, given the cost after each leg."""
    costs: Costs = {}
    held, m = list(zip(instance.carried.tolist(), carried, strict=True)), len(instance.bins)
    totals = np.minimum(arcs.leg + rest, INFINITE).tolist()
    for key, j, cost in zip(arcs.key.tolist(), arcs.picked.tolist(), totals, strict=True):
        b = (key & ((1 << PLACE_BITS) - 1)) // (2 * m)
        visits = [Visit(VisitKind.PLACE, name) for home, name in held if home == b]
        for visit in [Visit(VisitKind.PICK, names[j])] if j >= 0 else visits:
            costs[visit] = min(cost, costs.get(visit, cost))
    return costs


@kernel
def start_arcs(inst: Instance, left: int) -> Arcs:
    """Return the first legs of tours, given the bit mask of the objects that remain at the start."""
    n, m = inst.to_bin.shape
    arcs = new_arcs(inst)
    count = arcs_from(inst, left << PLACE_BITS | (2 * m * m + n), arcs)
    return Arcs(arcs.key[:count], arcs.leg[:count], arcs.picked[:count])


@inlined
def rest_after(
    arcs: Arcs, a: int, here: Nodes, rest: NDArray[np.int64], after: Nodes, after_rest: NDArray[np.int64]
) -> int:
    """Return the remaining tour length after a leg from a layer, given the lengths for this and the next layer."""
    if arcs.picked[a] < 0:
        k = here.slots[slot_of(here, arcs.key[a])]
        return int(rest[k]) if k >= 0 else INFINITE
    k = after.slots[slot_of(after, arcs.key[a])]
    return int(after_rest[k]) if k >= 0 else INFINITE


@kernel
def rests(
    arcs: Arcs, here: Nodes, rest: NDArray[np.int64], after: Nodes, after_rest: NDArray[np.int64]
) -> NDArray[np.int64]:
    found = np.empty(arcs.key.size, np.int64)
    for a in range(found.size):
        found[a] = rest_after(arcs, a, here, rest, after, after_rest)
    return found


@kernel
def sweep(inst: Instance, here: Nodes, after: Nodes, after_rest: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the remaining tour length of each state in a layer, given the lengths for the next layer."""
    arcs, size = new_arcs(inst), here.size[0]
    rest = np.full(size, INFINITE, np.int64)
    for empty in (True, False):  # states with an object in hand are followed by those with empty hands
        for k in range(size):
            key = here.key[k]
            if is_empty_handed(inst, key) != empty:
                continue
            best = 0 if empty and key >> PLACE_BITS == 0 else INFINITE
            for a in range(arcs_from(inst, key, arcs)):
                best = min(best, arcs.leg[a] + rest_after(arcs, a, here, rest, after, after_rest))
            rest[k] = best
    return rest
