"""The relaxation of a certificate filled anew in plain numpy, without the solvers' code."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.problem import RoutingProblem

FINE = 1e-5  # m per unit of this check, ten times finer than that of certificates
MAX_LENGTH = 1 << 29  # units; longer than any tour, and its double fits 32 bits

Whole = NDArray[Any]  # of int32, or of int64 where tours are kilometres long


@dataclass(frozen=True, eq=False)
class Relaxed:
    """Shortest relaxed rest of a task from every state, prices of picks included.

    A state knows how many of each group of objects are left (a row), so that any of a group may be picked, though
    none twice in a row. Every real tour is a relaxed one that pays each price once. What belongs where one is, is
    left there: in a metric that is never wrong.

    Attributes:
        d: Distances, rounded down and closed to a metric, so that no tour is shorter in the given ones, (k, k).
        at: Place of each object, (n,).
        bins: Places of the bins, (m,).
        home: Bin of each object, (n,).
        price: Of picking each object, (n,).
        group: Group of each object, (n,).
        stride: By how many rows picking an object goes down, (n,).
        carrying: At bin b with one object for bin c in hand, c = b: with empty hands, (rows, m, m).
        holding: At object i with only that in hand, (rows, n).
        root: Length of the shortest relaxed tour less all prices, units.
    """

    d: Whole
    at: Whole
    bins: Whole
    home: Whole
    price: Whole
    group: Whole
    stride: Whole
    carrying: Whole
    holding: Whole
    root: int


def closed(distances: NDArray[Any]) -> NDArray[Any]:
    """Shortest connections, (k, k) as the distances; no tour of the given distances is shorter than in these."""
    shortest: NDArray[Any] = np.minimum(distances, distances.T)
    for k in range(len(shortest)):
        shortest = np.minimum(shortest, shortest[:, k, None] + shortest[None, k, :])
    return shortest


def relax(problem: RoutingProblem, group: NDArray[np.int64], prices: NDArray[np.int64]) -> Relaxed:
    """Fill the table of a relaxation.

    Args:
        problem: The problem, for capacity two.
        group: Group of each shipment, numbered from 0, (n,).
        prices: Of picking each shipment, units of 1e-5 m, (n,).
    """
    fine = closed(np.floor(closed(problem.distances) / FINE))
    n = len(problem.shipments)
    reach = (2 * n + 3) * fine.max(initial=0) + np.abs(prices).sum()
    kind = np.int32 if reach < MAX_LENGTH else np.int64
    bins = np.array(sorted({s.delivery for s in problem.shipments} | set(problem.onboard)), np.int64)
    at = np.array([s.pickup for s in problem.shipments], np.int64)
    home = np.searchsorted(bins, np.array([s.delivery for s in problem.shipments], np.int64))
    size = np.bincount(group)
    stride = np.concatenate([[1], np.cumprod(size + 1)])[:-1][group] if n else group
    rows = int(np.prod(size + 1))
    far = kind(min(2 * reach, MAX_LENGTH) if kind is np.int32 else 2 * reach)
    carrying = np.full((rows, len(bins), len(bins)), far)
    table = Relaxed(
        fine.astype(kind), at, bins, home, prices.astype(kind), group, stride,
        carrying, np.full((rows, n), far), 0,
    )  # fmt: skip
    start = _fill(table, problem.start, far)
    total = _first_leg(problem, table, start)
    return Relaxed(**{**vars(table), "root": total - int(prices.sum())})


def _fill(table: Relaxed, start: int, far: Any) -> tuple[Whole, Any]:
    """All rows, by how many objects are left; then carrying and empty-handed at the start with all left."""
    d, at, bins, home = table.d, table.at, table.bins, table.home
    n, m = len(at), len(bins)
    size, index = np.bincount(table.group), np.arange(len(table.carrying))
    left = [index // s % (k + 1) for s, k in zip(_first(table), size, strict=True)]
    total = np.sum(left, axis=0) if left else np.zeros(1, int)
    places = np.concatenate([bins, [start]])
    leave, to_place, to_bin = d[np.ix_(places, bins)], d[np.ix_(at, places)], d[np.ix_(at, bins)]
    between = d[np.ix_(at, at)]
    np.fill_diagonal(between, far)  # no object follows itself
    after, empty = leave[None].copy(), np.zeros((1, m + 1), d.dtype)
    table.carrying[0], table.holding[0] = leave[:m], to_bin[np.arange(n), home]
    for count in range(1, n + 1):
        rows = np.flatnonzero(total == count)
        empty = np.full((len(rows), m + 1), far)
        after, stay = np.full((len(rows), m + 1, m), far), np.full((len(rows), n), far)
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
    return after[-1, m], empty[-1, m]


def _first(table: Relaxed) -> list[int]:
    """Stride of each group."""
    return [int(table.stride[table.group == g][0]) for g in range(int(table.group.max(initial=-1)) + 1)]


def _first_leg(problem: RoutingProblem, table: Relaxed, start: tuple[Whole, Any]) -> int:
    bins, carried = table.bins.tolist(), problem.onboard
    if len(carried) == 2:
        lengths = [
            table.d[problem.start, one] + table.carrying[-1, bins.index(one), bins.index(other)]
            for one, other in (carried, carried[::-1])
        ]
        return int(min(lengths))
    return int(start[0][bins.index(carried[0])] if carried else start[1])
