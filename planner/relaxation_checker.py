"""The relaxation of a certificate filled anew in plain numpy, without the solvers' code."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.problem import RoutingProblem

LARGE = 100  # prices beyond so many times the longest tour would drown its length in rounding

Lengths = NDArray[np.float64]
Whole = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Relaxed:
    """Shortest relaxed rest of a task from every state, prices of picks included.

    A state knows how many of each group of objects are left (a row), so that any of a group may be picked, though
    none twice in a row. Every real tour is a relaxed one that pays each price once. What belongs where one is, is
    left there: in a metric that is never wrong.

    Attributes:
        d: Distances closed to a metric, so that no tour is shorter in the given ones, m, (k, k).
        at: Place of each object, (n,).
        bins: Places of the bins, (m,).
        home: Bin of each object, (n,).
        price: Of picking each object, m, (n,).
        group: Group of each object, (n,).
        stride: By how many rows picking an object goes down, (n,).
        carrying: At bin b with one object for bin c in hand, c = b: with empty hands, m, (rows, m, m).
        holding: At object i with only that in hand, m, (rows, n).
        root: Length of the shortest relaxed tour less all prices, m.
    """

    d: Lengths
    at: Whole
    bins: Whole
    home: Whole
    price: Lengths
    group: Whole
    stride: Whole
    carrying: Lengths
    holding: Lengths
    root: float


def closed(problem: RoutingProblem) -> Lengths:
    """Shortest connections through locations of the tour, m, (k, k); no tour is shorter in the given distances."""
    shortest: Lengths = np.minimum(problem.distances, problem.distances.T)
    for k in problem.used:
        shortest = np.minimum(shortest, shortest[:, k, None] + shortest[None, k, :])
    return shortest


def relax(problem: RoutingProblem, group: Whole, prices: Lengths) -> Relaxed:
    """Fill the table of a relaxation, in floats: the rounding of their sums is far below 1e-9 of a tour.

    Args:
        problem: The problem, for capacity two.
        group: Group of each shipment, numbered from 0, (n,).
        prices: Of picking each shipment, m, (n,).

    Raises:
        ProblemError: The prices are so large that their rounding would matter.
    """
    n, d = len(problem.shipments), closed(problem)
    reach = (2 * n + 3) * d[np.ix_(problem.used, problem.used)].max()
    if not np.abs(prices).sum() <= LARGE * reach:
        raise ProblemError(f"prices of up to {np.abs(prices).max()} m are too large for tours of {reach} m")
    bins = np.array(sorted({s.delivery for s in problem.shipments} | set(problem.onboard)), np.int64)
    at = np.array([s.pickup for s in problem.shipments], np.int64)
    home = np.searchsorted(bins, np.array([s.delivery for s in problem.shipments], np.int64))
    size = np.bincount(group)
    stride = np.concatenate([[1], np.cumprod(size + 1)])[:-1][group] if n else group
    rows = int(np.prod(size + 1))
    carrying, holding = np.full((rows, len(bins), len(bins)), np.inf), np.full((rows, n), np.inf)
    table = Relaxed(d, at, bins, home, prices, group, stride, carrying, holding, 0.0)
    total = _first_leg(problem, table, _fill(table, problem.start))
    return replace(table, root=total - float(prices.sum()))


def _fill(table: Relaxed, start: int) -> tuple[Lengths, float]:
    """All rows, by how many objects are left; then carrying and empty-handed at the start with all left."""
    d, at, bins, home = table.d, table.at, table.bins, table.home
    n, m = len(at), len(bins)
    size, index = np.bincount(table.group), np.arange(len(table.carrying))
    left = [index // s % (k + 1) for s, k in zip(_first(table), size, strict=True)]
    total = np.sum(left, axis=0) if left else np.zeros(1, int)
    places = np.concatenate([bins, [start]])
    leave, to_place, to_bin = d[np.ix_(places, bins)], d[np.ix_(at, places)], d[np.ix_(at, bins)]
    between = d[np.ix_(at, at)]
    np.fill_diagonal(between, np.inf)  # no object follows itself
    after, empty = leave[None].copy(), np.zeros((1, m + 1))
    table.carrying[0], table.holding[0] = leave[:m], to_bin[np.arange(n), home]
    for count in range(1, n + 1):
        rows = np.flatnonzero(total == count)
        empty = np.full((len(rows), m + 1), np.inf)
        after, stay = np.full((len(rows), m + 1, m), np.inf), np.full((len(rows), n), np.inf)
        for j, c in enumerate(home):
            there = np.flatnonzero(left[table.group[j]][rows])
            source = rows[there] - table.stride[j]
            own, other = table.carrying[source, :, c], table.carrying[source, c]
            second = table.price[j] + np.minimum(to_bin[j] + own, to_bin[j, c] + other)
            only = table.price[j] + table.holding[source, j, None]
            empty[there] = np.minimum(empty[there], to_place[j] + only)
            after[there] = np.minimum(after[there], to_place[j][:, None] + second[:, None])
            stay[there] = np.minimum(stay[there], between[j] + second[:, home])
        after = np.minimum(after, leave + empty[:, None, :m])
        after[:, range(m), range(m)] = empty[:, :m]
        table.carrying[rows] = after[:, :m]
        table.holding[rows] = np.minimum(stay, to_bin[np.arange(n), home] + empty[:, home])
    return after[-1, m], float(empty[-1, m])


def _first(table: Relaxed) -> list[int]:
    """Stride of each group."""
    return [int(table.stride[table.group == g][0]) for g in range(int(table.group.max(initial=-1)) + 1)]


def _first_leg(problem: RoutingProblem, table: Relaxed, start: tuple[Lengths, float]) -> float:
    bins, carried = table.bins.tolist(), problem.onboard
    if len(carried) == 2:
        lengths = [
            table.d[problem.start, one] + table.carrying[-1, bins.index(one), bins.index(other)]
            for one, other in (carried, carried[::-1])
        ]
        return float(min(lengths))
    return float(start[0][bins.index(carried[0])]) if carried else start[1]
