"""One pass of the layered search: all layers, some states of each."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.exact.deadline import Deadline
from planner.exact.multipliers import Bound
from planner.exact.nodes import NO_PARENT, keep_best, new_nodes
from planner.exact.search import PLACE_BITS, expand, offer_roots
from planner.exact.table import INFINITE

FIRST_ROOM = 1 << 12


@dataclass(frozen=True)
class Pass:
    """The result of one pass.

    Attributes:
        upper: Length of the best tour known, units.
        actions: Actions of that tour, or None if the pass found none shorter.
        lower: No tour is shorter than this, units.
        expanded: How many states were expanded.
    """

    upper: int
    actions: list[int] | None
    lower: int
    expanded: int


def beam_pass(bound: Bound, upper: int, width: int, most: int, deadline: Deadline) -> Pass:
    """Search all layers, keeping so many states of each.

    Args:
        bound: Bound of the cost-to-go.
        upper: Length of the best tour known; only those shorter by more than a tie are looked for.
        width: States to keep of each layer.
        most: Give up when so many states were expanded.
        deadline: Give up when it is over.

    Returns:
        The result; its lower bound is that of the root if the pass was given up.
    """
    n, prices = len(bound.instance.home), bound.prices
    limit = upper - bound.instance.tie + prices
    history: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    here, after = new_nodes(FIRST_ROOM), new_nodes(FIRST_ROOM)
    offer_roots(bound.instance, bound.table, here, after, limit)
    dropped, expanded, actions = INFINITE, 0, None
    for layer in range(n + 1):
        if expanded > most or deadline.over():
            return Pass(upper, None, bound.root, expanded)
        here, worse = keep_best(here, width)
        found = expand(bound.instance, bound.table, here, after, limit, width, deadline)
        if found is None:
            return Pass(upper, None, bound.root, expanded)
        here, after, early, states, end = found
        dropped = min(dropped, worse, early)
        expanded += states
        size = here.size[0]
        history.append((here.key[:size].copy(), here.parent[:size].copy()))
        if end >= 0:
            upper = int(here.cost[end]) - prices
            actions = _actions(bound, history, layer, end)
        here, after = after, new_nodes(FIRST_ROOM)
    lower = max(bound.root, min(upper, min(limit, dropped) - prices))
    return Pass(upper, actions, lower, expanded)


def _actions(
    bound: Bound, history: list[tuple[NDArray[np.int64], NDArray[np.int64]]], layer: int, end: int
) -> list[int]:
    """The actions of a tour, found by following the parents back from its end."""
    keys = []
    k = end
    while True:
        key, parent = history[layer][0][k], int(history[layer][1][k])
        keys.append(int(key))
        if parent == NO_PARENT:
            break
        layer -= 0 if parent & 1 else 1
        k = parent >> 1
    m = len(bound.instance.bins)
    left = (1 << len(bound.instance.home)) - 1
    actions = []
    for key in reversed(keys):
        place = key & ((1 << PLACE_BITS) - 1)
        picked = left ^ (key >> PLACE_BITS)
        left ^= picked
        if picked:
            actions.append(picked.bit_length() - 1)
        if place < m * m:
            actions.append(-1 - place // m)
    return actions
