"""Annealing, then a search that widens from pass to pass until the tour is proven or the budget is spent."""

from collections.abc import Iterator

import numpy as np

from planner.certificate import Certificate, Proof
from planner.exact.annealing import anneal, anneal_from, tour_actions, warm_order
from planner.exact.beam import beam_pass
from planner.exact.deadline import NEVER, Deadline
from planner.exact.full_table import Solution
from planner.exact.groups import BIN_ROWS
from planner.exact.instance import Instance
from planner.exact.multipliers import Bound, counted_by_bin, first_bound, grown, warm_bound
from planner.exact.warm_start import Start

ANNEALING_MOVES = 10_000
# A first plan from a warm start: some 20 ms.
WARM_MOVES, WARM_ROWS, WARM_WIDTH = 3_000, 1 << 14, 800
WARM_TEMPERATURES = (0.1, 0.02)  # mean legs


def widening(
    instance: Instance,
    seed: int,
    work: int,
    deadline: Deadline,
    passes: tuple[tuple[int, int], ...],
    start: Start | None,
) -> Iterator[Solution]:
    """Yield a first tour and bound, then what each pass of the search makes of them.

    Args:
        instance: What is left to do.
        seed: Of the annealing.
        work: States that may be expanded.
        deadline: No pass begins after it; there is always a first tour.
        passes: Rows of the bound's table and states kept of each layer, at most, from pass to pass.
        start: A warm start, or None.
    """
    bound, upper, lower, actions = _first_tour(instance, seed, work, start)
    yield Solution(actions, min(lower, upper), _certificate(bound))
    done, rate, by_bin = 0, max(1, len(instance.home) // 2), False
    for rows, wanted in passes:
        # A pass that is given up proves nothing, and one hardly wider than the last proves little more.
        width = min(wanted, work // rate)
        if lower >= upper - instance.tie or width < min(wanted, done + 1) or deadline.over():
            break
        if rows >= BIN_ROWS and not by_bin:  # once: later, the bound has outgrown so few rows
            bound, by_bin = counted_by_bin(bound, upper, BIN_ROWS, deadline), True
        bound = grown(bound, upper, rows, deadline)
        result = beam_pass(bound, upper, width, work, deadline)
        work -= result.expanded
        done, rate = width, max(1, -(-result.expanded // width))  # a wider pass expands fewer per width
        lower = max(lower, bound.root, result.lower)
        if result.actions is not None:
            upper, actions = result.upper, result.actions
        yield Solution(actions, min(lower, upper), _certificate(bound))


def _first_tour(
    instance: Instance, seed: int, work: int, start: Start | None
) -> tuple[Bound, int, int, list[int]]:
    """A bound, the length of a first tour, a lower bound of all tours, and the actions of the first."""
    if start is None:
        length, order = anneal(instance, seed, ANNEALING_MOVES)
        bound = first_bound(instance, int(length))
    else:
        length, order = anneal_from(
            instance, seed, WARM_MOVES, warm_order(instance, start), *WARM_TEMPERATURES
        )
        bound = warm_bound(instance, start, WARM_ROWS)
    upper, lower = int(length), bound.root
    actions: list[int] = tour_actions(instance, order).tolist()
    if start is not None:
        narrow = beam_pass(bound, upper, WARM_WIDTH, work, NEVER)
        lower = max(lower, narrow.lower)
        if narrow.actions is not None:
            upper, actions = narrow.upper, narrow.actions
    return bound, upper, lower, actions


def _certificate(bound: Bound) -> Certificate:
    table = bound.table
    groups = tuple(tuple(np.flatnonzero(table.group == g).tolist()) for g in range(len(table.size)))
    return Certificate(
        Proof.RELAXATION, bound.instance.unit, bound.root, groups, tuple(table.multipliers.tolist())
    )
