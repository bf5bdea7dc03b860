"""Find tours by annealing, then by beam searches of increasing width, until a tour is proven optimal."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.exact.annealing import anneal, completed, tour_actions
from planner.exact.expand import PLACE_BITS, expand, root_layer
from planner.exact.instance import MAX_SEARCHED, Instance
from planner.exact.moves import moves_of
from planner.exact.multipliers import Bound, counted_by_bin, first_bound, grown, warm_bound
from planner.exact.nodes import NO_PARENT, keep_best
from planner.exact.table import BIN_ROWS, INFINITE, Solution
from planner.exact.warm_start import Start
from planner.solvers import NEVER, Deadline

# Moves of the annealing of a first tour, and its temperatures relative to the mean leg
MOVES, TEMPERATURES = 10_000, (0.5, 0.01)
# Limits for finding a first plan from a warm start, in about 20 ms
WARM_MOVES, WARM_ROWS, WARM_WIDTH = 3_000, 1 << 14, 800
WARM_TEMPERATURES = (0.1, 0.02)


def improving_tours(
    instance: Instance,
    seed: int,
    work: int,
    deadline: Deadline,
    passes: tuple[tuple[int, int], ...],
    start: Start | None,
    warm_rows: int = WARM_ROWS,
) -> Iterator[Solution]:
    """Yield a first tour with a lower bound, then the best tour and bound after each pass of the search.

    `work` is the maximum number of states to expand. `warm_rows` is the maximum number of rows in the table of
    a warm start. No pass begins after the deadline.
    """
    bound, upper, lower, actions, expanded = _first_tour(instance, seed, work, start, warm_rows)
    yield Solution(actions, min(lower, upper), bound.certificate, expanded)
    done, rate, by_bin = 0, max(1, len(instance.home) // 2), False
    for rows, wanted in passes if len(instance.home) <= MAX_SEARCHED else ():
        # An unfinished pass proves nothing, so choose a width that the remaining work allows.
        width = min(wanted, work // rate)
        if lower >= upper - instance.tie or width < min(wanted, done + 1) or deadline.over():
            break
        if rows >= BIN_ROWS and not by_bin:  # group by bin once, before the first table of this size
            bound, by_bin = counted_by_bin(bound, upper, BIN_ROWS, deadline), True
        bound = grown(bound, upper, rows, deadline)
        result = beam_pass(bound, upper, width, work, deadline)
        work -= result.expanded
        expanded += result.expanded
        # A wider pass expands fewer states per unit of width.
        done, rate = width, max(1, -(-result.expanded // width))
        lower = max(lower, bound.root, result.lower)
        if result.actions is not None:
            upper, actions = result.upper, result.actions
        yield Solution(actions, min(lower, upper), bound.certificate, expanded)


def _first_tour(
    instance: Instance, seed: int, work: int, start: Start | None, warm_rows: int
) -> tuple[Bound, int, int, list[int], int]:
    if start is None:
        length, order = anneal(instance, seed, MOVES, np.arange(len(instance.home)), *TEMPERATURES)
        bound = first_bound(instance, length)
    else:
        order = completed(instance, start.order)
        length, order = anneal(instance, seed, WARM_MOVES, order, *WARM_TEMPERATURES)
        bound = warm_bound(instance, start, warm_rows)
    upper, lower, expanded = length, bound.root, 0
    actions = tour_actions(moves_of(instance), order)
    if start is not None and work > 0 and len(instance.home) <= MAX_SEARCHED:
        narrow = beam_pass(bound, upper, WARM_WIDTH, work, NEVER)
        lower, expanded = max(lower, narrow.lower), narrow.expanded
        if narrow.actions is not None:
            upper, actions = narrow.upper, narrow.actions
    return bound, upper, lower, actions, expanded


class Pass(NamedTuple):
    """The result of one pass of the search."""

    upper: int  # length of the best known tour
    actions: list[int] | None  # actions of the best known tour if this pass found it, or None
    lower: int  # lower bound on tour lengths
    expanded: int  # number of expanded states


def beam_pass(bound: Bound, upper: int, width: int, max_states: int, deadline: Deadline) -> Pass:
    """Search all layers once for a tour shorter than `upper`, keeping the best `width` states of each layer.

    A new tour must be shorter by more than the tie tolerance. If more than `max_states` states were expanded
    or the deadline has passed, the pass ends early and returns the lower bound of the root.
    """
    moves, prices = moves_of(bound.instance), bound.prices
    limit = upper - bound.instance.tie + prices
    history: list[tuple[NDArray[np.int64], NDArray[np.int64]]] = []
    here, left_out, expanded, actions = root_layer(bound), INFINITE, 0, None
    for layer in range(len(bound.instance.home) + 1):
        if expanded > max_states or deadline.over():
            return Pass(upper, None, bound.root, expanded)
        here, worse = keep_best(here, width)
        found = expand(moves, bound.table, here, limit, width, deadline)
        if found is None:
            return Pass(upper, None, bound.root, expanded)
        here, after, early, states, end = found
        left_out = min(left_out, worse, early)
        expanded += states
        size = here.size[0]
        history.append((here.key[:size].copy(), here.parent[:size].copy()))
        if end >= 0:
            upper = int(here.cost[end]) - prices
            actions = _actions(bound, history, layer, end)
        here = after
    lower = max(bound.root, min(upper, min(limit, left_out) - prices))
    return Pass(upper, actions, lower, expanded)


def _actions(
    bound: Bound, history: list[tuple[NDArray[np.int64], NDArray[np.int64]]], layer: int, end: int
) -> list[int]:
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
