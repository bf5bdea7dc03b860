"""A NumPy implementation of the relaxed problem, which verifies certificates independently of the solver."""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.problem import RoutingProblem

MAX_PRICES = 100  # maximum sum of prices relative to the longest tour, which limits rounding errors

Lengths = NDArray[np.float64]
Whole = NDArray[np.int64]
Field = NDArray[Any]


def closed(problem: RoutingProblem) -> Lengths:
    """Return the lengths of shortest paths via locations of the tour, in metres, shape (k, k)."""
    shortest: Lengths = np.minimum(problem.distances, problem.distances.T)
    for k in problem.used:
        shortest = np.minimum(shortest, shortest[:, k, None] + shortest[None, k, :])
    return shortest


class StateArrays(NamedTuple):
    """States of a task. Each array contains one entry per state."""

    left: Field  # bit mask of the remaining objects
    place: Field  # current place: b at bin b, m + i at object i (just picked up), m + n at the start
    held: Field  # bin of the object in hand, or m for empty hands
    cost: Field  # length of the tour so far plus the prices of its picks, in metres


class Relaxation:
    """A table of the cost-to-go of the relaxed problem, for a capacity of one or two.

    Each table row stands for one combination of the numbers of remaining objects in each group. Any object of
    a group may be picked up, even repeatedly, but not twice in a row. Each pick has a price. Every real tour
    is also a relaxed tour that pays each price once. An object is placed as soon as its bin is reached.

    Attributes:
        exact: True if the given distances satisfy the triangle inequality. Otherwise, the table uses the
            lengths of shortest paths instead.
        root: Lower bound on tour lengths in metres.

    Raises:
        ProblemError: The prices are so large that rounding errors could exceed 1e-9 of a tour.
    """

    def __init__(self, problem: RoutingProblem, group: Whole, prices: Lengths) -> None:
        distances, shipments, n = closed(problem), problem.shipments, len(problem.shipments)
        reach = (2 * n + 3) * distances[np.ix_(problem.used, problem.used)].max()
        if not np.abs(prices).sum() <= MAX_PRICES * reach:
            raise ProblemError(
                f"prices of up to {np.abs(prices).max()} m are too large for tours of {reach} m"
            )
        self.exact = bool(np.array_equal(distances, problem.distances))
        bins = sorted({s.delivery for s in shipments} | set(problem.onboard))
        places = [*bins, *(s.pickup for s in shipments), problem.start]
        self._d, self._bins, self._hands = distances[np.ix_(places, places)], len(bins), problem.capacity
        self._home = np.array([bins.index(s.delivery) for s in shipments], np.int64)
        self._carried = [bins.index(j) for j in problem.onboard]
        self._prices = prices
        size = np.bincount(group, minlength=1)
        strides = np.concatenate([[1], np.cumprod(size + 1)])
        self._stride = strides[group]  # amount by which the row index decreases when an object is picked up
        rows = np.arange(strides[-1])
        self._rest = self._filled(group, [rows // s % (k + 1) for s, k in zip(strides, size, strict=False)])
        here, after = self._begin()
        first = [float((states.cost + self._rest_of(states)).min(initial=np.inf)) for states in (here, after)]
        self.root = min(first) - float(prices.sum()) if places[:-1] else 0.0

    def _filled(self, group: Whole, left: list[Whole]) -> Lengths:
        """Return the filled table.

        Column b * m + c stands for bin b with an object for bin c in hand, or with empty hands if c = b.
        Column m * m + i stands for object i.
        """
        n, m, home, total = len(self._home), self._bins, self._home, np.sum(left, axis=0)
        leave, to_bin, between = self._d[:m, :m], self._d[m:-1, :m], self._d[m:-1, m:-1].copy()
        np.fill_diagonal(between, np.inf)  # no object is picked up twice in a row
        if self._hands == 1:
            between[:] = np.inf
        own = to_bin[np.arange(n), home]
        table = np.full((len(total), m * m + n), np.inf)
        carrying, holding = table[:, : m * m].reshape(-1, m, m), table[:, m * m :]
        carrying[0], holding[0] = leave, own
        for count in range(1, n + 1):
            rows = np.flatnonzero(total == count)
            empty, stay = np.full((len(rows), m), np.inf), np.full((len(rows), n), np.inf)
            after = np.full((len(rows), m, m), np.inf)
            for j, c in enumerate(home):
                there = np.flatnonzero(left[group[j]][rows])
                source = rows[there] - self._stride[j]
                second = np.minimum(to_bin[j] + carrying[source, :, c], own[j] + carrying[source, c])
                second += self._prices[j]
                only = self._prices[j] + holding[source, j, None]
                empty[there] = np.minimum(empty[there], to_bin[j] + only)
                after[there] = np.minimum(after[there], to_bin[j][:, None] + second[:, None])
                stay[there] = np.minimum(stay[there], between[j] + second[:, home])
            after = np.minimum(after, leave + empty[:, None])
            after[:, range(m), range(m)] = empty
            carrying[rows] = after
            holding[rows] = np.minimum(stay, own + empty[:, home])
        return table

    def shorter(self, limit: float, max_states: int) -> tuple[bool, int] | None:
        """Look for a tour below `limit` metres. Return True if found, and the number of visited states.

        All states whose cost plus lower bound is below the limit are visited. The result is None if there are
        more than `max_states` such states.
        """
        limit += float(self._prices.sum())
        here, after = self._begin()
        states = 0
        for _ in range(len(self._home) + 1):
            here = self._best([here, self._placed(self._best([here], limit))], limit)
            states += len(here.left)
            if states > max_states:
                return None
            if ((here.left == 0) & (here.held == self._bins)).any():
                return True, states
            here = self._best([after, *(self._best([s], limit) for s in self._picked(here))], limit)
            after = NONE
        return False, states

    def _begin(self) -> tuple[StateArrays, StateArrays]:
        n, m, held = len(self._home), self._bins, self._carried
        everything = (1 << n) - 1
        if len(held) == 2:
            pairs = [(b, c if c != b else m) for b, c in (held, held[::-1])]
            legs = [self._d[-1, b] for b, _ in pairs]
            at, other = np.array(pairs, np.int64).T
            return StateArrays(np.full(2, everything), at, other, np.array(legs)), NONE
        all_left, place, bin_held = np.array([[everything], [m + n], held or [m]], np.int64)
        start = StateArrays(all_left, place, bin_held, np.zeros(1))
        return self._placed(start), _joined([NONE, *self._picked(start)])

    def _placed(self, states: StateArrays) -> StateArrays:
        left, place, held, cost = (field[states.held < self._bins] for field in states)
        return StateArrays(left, held, np.full_like(held, self._bins), cost + self._d[place, held])

    def _picked(self, states: StateArrays) -> Iterator[StateArrays]:
        m = self._bins
        for j, c in enumerate(self._home.tolist()):
            left, place, held, cost = (field[(states.left >> j & 1).astype(bool)] for field in states)
            left, cost = left ^ 1 << j, cost + self._d[place, m + j] + self._prices[j]
            empty, full = held == m, (held < m) & (self._hands == 2)
            only = left[empty]
            yield StateArrays(only, np.full_like(only, m + j), np.full_like(only, c), cost[empty])
            left, first, cost = left[full], held[full], cost[full]
            kept = np.where(first == c, m, c)
            yield StateArrays(left, first, kept, cost + self._d[m + j, first])
            yield StateArrays(
                left, np.full_like(first, c), np.where(first == c, m, first), cost + self._d[m + j, c]
            )

    def _rest_of(self, states: StateArrays) -> Lengths:
        m, row = self._bins, np.zeros(len(states.left), np.int64)
        for j, stride in enumerate(self._stride.tolist()):
            row += stride * (states.left >> j & 1)
        kept = np.where(states.held == m, states.place, states.held)
        column = np.where(states.place < m, states.place * m + kept, m * m + states.place - m)
        rest: Lengths = self._rest[row, column]
        return rest

    def _best(self, parts: list[StateArrays], limit: float) -> StateArrays:
        states = _joined(parts)
        kept = states.cost + self._rest_of(states) < limit
        states = StateArrays(*(field[kept] for field in states))
        order = np.lexsort((states.cost, states.held, states.place, states.left))
        states = StateArrays(*(field[order] for field in states))
        first = np.ones(len(order), bool)
        first[1:] = np.any([field[1:] != field[:-1] for field in states[:3]], axis=0)
        return StateArrays(*(field[first] for field in states))


NONE = StateArrays(np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))


def _joined(parts: list[StateArrays]) -> StateArrays:
    return StateArrays(*(np.concatenate(fields) for fields in zip(*parts, strict=True)))
