"""A NumPy implementation of the bound from connectivity cuts, which verifies certificates independently of the solver.

With m bins and n shipments, the states of the person are numbered as follows, where bins are the delivery locations in
ascending order, without those at distance 0 of an earlier one:

    b m + b                 at bin b with empty hands
    b m + d                 at bin b with an object for another bin d in hand
    m m + i (m + 1) + m     at object i with only this object in hand
    m m + j (m + 1) + d     at object j with this object and an object for bin d in hand
    m m + n (m + 1)         at the start; the next number is the end of the tour

An object is placed as soon as its bin is reached, which never lengthens a tour along shortest paths.
"""

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.plan import Certificate
from planner.problem import RoutingProblem

MAX_SUM = 1 << 62  # maximum sum of lengths and multipliers, so that no sum overflows
# A distance counts as a multiple of the unit if the difference is at most this share of the largest distance.
EXACT = 1e-15

Whole = NDArray[np.int64]
# First node, last node, length in units, maximum number of uses in a tour, and object that is picked up or -1
Arc = tuple[int, int, int, int, int]


def cuts_bound(problem: RoutingProblem, certificate: Certificate) -> float:
    """Return the lower bound on tour lengths in metres that results from a certificate's multipliers and cuts.

    Every tour pays the price of each object once, and no cut makes it shorter. Lengths of shortest walks, used as
    potentials, make most reduced lengths nonnegative. Each other arc lowers the bound as often as a tour may use it.

    Raises:
        ProblemError: The certificate does not fit the problem, or the bound is below the certificate's root.
    """
    n, legs = len(problem.shipments), 2 * len(problem.shipments) + len(problem.onboard)
    whole, rounding = _whole(problem, certificate)
    places, home = _bins(problem, whole)
    nodes = len(places) ** 2 + n * (len(places) + 1) + 2
    arcs = np.array(list(_arcs(problem, whole, places, home)), np.int64)
    tail, head, length, most, picks = arcs.T
    prices = np.array(certificate.multipliers, np.int64)
    _check_cuts(certificate, int(whole.max()), nodes)
    reduced = length * certificate.parts - np.append(prices, 0)[picks]
    for k, multiplier, inside in certificate.cuts:
        within = np.zeros(nodes, bool)
        within[list(inside)] = True
        reduced -= multiplier * (within[head] & ~within[tail])
        reduced += multiplier * (within[head] & (picks == k))
    distance = _shortest_walks(tail, head, reduced, nodes)
    reached = distance[tail] < MAX_SUM // 2
    short = np.where(reached, np.minimum(reduced + distance[tail] - distance[head], 0), 0)
    total = int(distance[nodes - 1]) + int(prices.sum()) + int((most * short).sum())
    bound = -(-total // certificate.parts)
    if certificate.root > bound:
        raise ProblemError(
            f"the certificate's root claims {certificate.root} units, but its cuts yield only {bound}"
        )
    return certificate.unit * (bound - rounding * legs)


def _check_cuts(certificate: Certificate, longest: int, nodes: int) -> None:
    """Check that sums of lengths do not overflow, and that cuts contain only known nodes, and never the start."""
    price = max(map(abs, certificate.multipliers))
    largest = longest * certificate.parts + price + sum(m for _, m, _ in certificate.cuts)
    if largest * nodes >= MAX_SUM:
        raise ProblemError("the multipliers of the certificate are too large")
    if not all(0 <= node < nodes - 2 for _, _, inside in certificate.cuts for node in inside):
        raise ProblemError("a cut of the certificate contains the start or an unknown node")


def _shortest_walks(tail: Whole, head: Whole, length: Whole, nodes: int) -> Whole:
    """Return the lengths of shortest walks from the start to all nodes, with at most as many arcs as nodes."""
    distance = np.full(nodes, MAX_SUM)
    distance[nodes - 2] = 0
    for _ in range(nodes):
        shorter = distance.copy()
        np.minimum.at(shorter, head, distance[tail] + length)
        if (shorter == distance).all():
            break
        distance = shorter
    return distance


def _whole(problem: RoutingProblem, certificate: Certificate) -> tuple[Whole, float]:
    """Return the lengths of shortest paths in units, shape (k, k), and the rounding error of a leg in units."""
    n, unit, used = len(problem.shipments), certificate.unit, problem.used
    distances = (
        problem.distances[np.ix_(used, used)] / unit if 0 < unit < math.inf else np.full((1, 1), np.inf)
    )
    nodes = (len(used) + n + 2) ** 2
    fits = len(certificate.multipliers) == n > 0 and problem.capacity <= 2 and certificate.parts > 0
    fits &= all(0 <= k < n and m >= 0 for k, m, _ in certificate.cuts)
    if not fits or not distances.max() * nodes < MAX_SUM:
        raise ProblemError("the certificate's multipliers, cuts or unit do not fit the problem")
    rounded = np.rint(np.minimum(distances, distances.T)).astype(np.int64)
    exact = np.abs(distances - rounded).max() <= EXACT * distances.max()
    for k in range(len(used)):
        rounded = np.minimum(rounded, rounded[:, k, None] + rounded[None, k, :])
    whole = np.zeros(problem.distances.shape, np.int64)
    whole[np.ix_(used, used)] = rounded
    return whole, 0.0 if exact else 0.5


def _bins(problem: RoutingProblem, whole: Whole) -> tuple[list[int], dict[int, int]]:
    """Return the locations of the bins, and the bin of each delivery location."""
    places: list[int] = []
    home = {}
    for location in sorted({s.delivery for s in problem.shipments} | set(problem.onboard)):
        same = [b for b, place in enumerate(places) if whole[place, location] == 0]
        if not same:
            places.append(location)
        home[location] = same[0] if same else len(places) - 1
    return places, home


def _arcs(problem: RoutingProblem, whole: Whole, places: list[int], home: dict[int, int]) -> Iterator[Arc]:
    n, m, d = len(problem.shipments), len(places), whole.tolist()
    at = [s.pickup for s in problem.shipments]
    to = [home[s.delivery] for s in problem.shipments]
    held = [home[j] for j in problem.onboard]
    start, end = m * m + n * (m + 1), m * m + n * (m + 1) + 1

    def onward(node: int, here: int, carried: list[int]) -> Iterator[Arc]:
        """Yield the arcs from a state, given its location and the bins of the objects in hand."""
        for b in set(carried):
            left = [c for c in carried if c != b]
            often = n if node < m * m else 1
            yield node, b * m + (left[0] if left else b), d[here][places[b]], often, -1
        if len(carried) < problem.capacity:
            for k in range(n):
                if node != m * m + k * (m + 1) + m:
                    after = m * m + k * (m + 1) + (carried[0] if carried else m)
                    yield node, after, d[here][at[k]], 1, k

    yield from onward(start, problem.start, held)
    for b, c in np.ndindex(m, m):
        yield from onward(b * m + c, places[b], [] if b == c else [c])
    for b in range(m):
        yield b * m + b, end, 0, 1, -1
    for k in range(n):
        yield from onward(m * m + k * (m + 1) + m, at[k], [to[k]])
        for b in range(m) if problem.capacity == 2 else ():
            yield from onward(m * m + k * (m + 1) + b, at[k], [b, to[k]])
