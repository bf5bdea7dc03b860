"""The routing problem of equation 1: capacitated pickup and delivery with an open tour."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE, IntegerDistances, integer_distances
from planner.plan import Certificate, Plan, Status, Visit, VisitKind

MIN_LARGEST, MAX_LARGEST = 1e-250, 1e250  # range of the largest distance, in which all sums are normal floats
ASYMMETRY = 1e-12  # maximum relative difference between the two directions of a distance, due to rounding


@dataclass(frozen=True)
class Shipment:
    """An object to fetch. The pickup and the delivery are indices into the distance matrix."""

    pickup: int
    delivery: int


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """The remaining part of a task, from any of its states (PAPER section 2).

    Objects are numbered: first the shipments, then the onboard objects.

    Attributes:
        distances: Geodesic distances between locations in metres, shape (k, k), symmetric with a zero diagonal.
        start: Index of the person's location.
        shipments: Loose objects. Several may share a pickup or a delivery.
        onboard: Index of the delivery location of each carried object.
        capacity: Maximum number of objects that can be carried.
        names: Unique names of the objects, in the order of their numbers. The default names are the numbers.
        resolution: Precision in metres to which distances are rounded, or None if they are exact. With a resolution,
            tours count as equal if they differ only by the rounding of their legs. Otherwise they count as equal if
            they differ by at most 1e-9 of their length.

    Raises:
        ProblemError: The distances are not square, negative, not finite, too large, too small or asymmetric, an index
            is out of range, more objects are onboard than the capacity allows, or names are not unique or not one per
            object.

    Example:
        >>> distances = np.array([[0.0, 3.0, 5.0], [3.0, 0.0, 4.0], [5.0, 4.0, 0.0]])
        >>> problem = RoutingProblem(distances, start=0, shipments=(Shipment(pickup=1, delivery=2),), names=("mug",))
        >>> problem.location(problem.pick(0))
        1
    """

    distances: NDArray[np.float64]
    start: int
    shipments: tuple[Shipment, ...]
    onboard: tuple[int, ...] = ()
    capacity: int = 2
    names: tuple[str, ...] = ()
    resolution: float | None = None

    def __post_init__(self) -> None:
        self._check_distances()
        self._check_indices()
        self._check_scale()
        count = len(self.shipments) + len(self.onboard)
        if not self.names:
            object.__setattr__(self, "names", tuple(map(str, range(count))))
        if len(self.names) != count or len(set(self.names)) != count:
            raise ProblemError(f"{count} objects need as many different names, got {list(self.names)}")
        self.distances.setflags(write=False)

    @cached_property
    def used(self) -> list[int]:
        """Indices of the locations that every tour visits, ascending."""
        places = {self.start, *self.onboard}
        return sorted(places.union(*((s.pickup, s.delivery) for s in self.shipments)))

    @cached_property
    def integers(self) -> IntegerDistances:
        """The distances, rounded to whole units."""
        return integer_distances(self.distances, self.used, self.resolution)

    def tolerance(self, length: float) -> float:
        """Return the maximum difference in metres at which tours of about this length count as equal."""
        if self.resolution is None:
            return TOLERANCE * length
        return 2 * self.resolution * (len(self.shipments) + len(self.names))

    @cached_property
    def number(self) -> dict[str, int]:
        """Number of each object, by name."""
        return {name: k for k, name in enumerate(self.names)}

    def pick(self, shipment: int) -> Visit:
        """Return the visit that picks up a shipment."""
        return Visit(VisitKind.PICK, self.names[shipment])

    def place(self, number: int) -> Visit:
        """Return the visit that places a shipment or an onboard object."""
        return Visit(VisitKind.PLACE, self.names[number])

    def location(self, visit: Visit) -> int:
        """Return the index of a visit's location."""
        number, n = self.number[visit.object], len(self.shipments)
        if number >= n:
            return self.onboard[number - n]
        shipment = self.shipments[number]
        return shipment.pickup if visit.kind is VisitKind.PICK else shipment.delivery

    def stops(self, visits: Iterable[Visit]) -> list[int]:
        """Return the location indices of the start and of each visit."""
        return [self.start, *map(self.location, visits)]

    def _check_distances(self) -> None:
        d = self.distances
        if d.ndim != 2 or d.shape[0] != d.shape[1] or d.shape[0] == 0:
            raise ProblemError(f"distances must be a square matrix, got shape {d.shape}")
        bad = np.argwhere(~np.isfinite(d) | (d < 0))
        if bad.size:
            i, j = bad[0]
            raise ProblemError(
                f"distances[{i}][{j}] is {d[i, j]}; every distance must be a finite number >= 0"
            )
        skew = np.argwhere(np.abs(d - d.T) > ASYMMETRY * d)
        if skew.size:
            i, j = skew[0]
            raise ProblemError(
                f"distances[{i}][{j}] = {d[i, j]} but distances[{j}][{i}] = {d[j, i]}; make it symmetric"
            )
        loops = np.flatnonzero(np.diagonal(d))
        if loops.size:
            raise ProblemError(
                f"distances[{loops[0]}][{loops[0]}] is {d[loops[0], loops[0]]}; the diagonal must be 0"
            )

    def _check_scale(self) -> None:
        distances = self.distances[np.ix_(self.used, self.used)]
        if not self.used or not distances.any():
            return
        largest = float(distances.max())
        if not MIN_LARGEST <= largest <= MAX_LARGEST:
            raise ProblemError(
                f"the largest distance is {largest} m; choose a unit in which it is {MIN_LARGEST} to {MAX_LARGEST}"
            )
        legs = len(self.shipments) + len(self.names) + 2
        if self.resolution is not None and not 0 < largest * legs / 2**52 <= self.resolution < math.inf:
            raise ProblemError(
                f"a resolution of {self.resolution} m is too fine for distances of {largest} m; leave it out"
            )

    def _check_indices(self) -> None:
        if self.capacity < 1:
            raise ProblemError(f"capacity must be at least 1, got {self.capacity}")
        if len(self.onboard) > self.capacity:
            raise ProblemError(f"{len(self.onboard)} objects are onboard but the capacity is {self.capacity}")
        indices = [("start", self.start), *(("onboard", j) for j in self.onboard)]
        for s in self.shipments:
            indices += [("pickup", s.pickup), ("delivery", s.delivery)]
        for what, index in indices:
            if not 0 <= index < len(self.distances):
                raise ProblemError(f"{what} {index} is out of range for {len(self.distances)} locations")


def possible_next(problem: RoutingProblem, visits: Sequence[Visit] = ()) -> Iterator[Visit]:
    """Yield the next visits that capacity and precedence allow after the given visits."""
    done, n = set(visits), len(problem.shipments)
    load = len(problem.onboard)
    for visit in visits:
        load += 1 if visit.kind is VisitKind.PICK else -1
    for k in range(n, len(problem.names)):
        if problem.place(k) not in done:
            yield problem.place(k)
    for k in range(n):
        if problem.pick(k) not in done:
            if load < problem.capacity:
                yield problem.pick(k)
        elif problem.place(k) not in done:
            yield problem.place(k)


def tour_length(
    problem: RoutingProblem, visits: Iterable[Visit], distances: NDArray[Any] | None = None
) -> float:
    """Return the length of an open tour.

    `distances` of shape (k, k) replaces the problem's own matrix if given. For integers below 2^53, the result is
    exact.
    """
    stops = problem.stops(visits)
    return float((problem.distances if distances is None else distances)[stops[:-1], stops[1:]].sum())


def spanning_bound(problem: RoutingProblem) -> int:
    """Return the length in units of the minimum spanning tree of all visited locations, a lower bound on tours."""
    from scipy.sparse.csgraph import minimum_spanning_tree  # imported late, because it is slow to import

    used = problem.used
    if len(used) == 1:
        return 0
    # SciPy treats 0 as a missing edge, so add 1 to every edge and subtract it again from the tree.
    tree = minimum_spanning_tree(problem.integers.legs[np.ix_(used, used)] + 1)
    return int(tree.sum()) - (len(used) - 1)


def make_plan(
    problem: RoutingProblem,
    metric: NDArray[np.int64],
    visits: Sequence[Visit],
    bound: int,
    started: float,
    certificate: Certificate,
) -> Plan:
    """Make a plan from a tour that was found with integer distances.

    `metric` contains these distances, shape (k, k), and `bound` is a lower bound on the tours in them. `started` is the
    value of `time.perf_counter()` at the start of solving. The plan's lower bound also holds for the problem's own
    distances. The plan is OPTIMAL if the tour meets the bound in the integer distances and, within the problem's
    tolerance, in its own.
    """
    integers, cost = problem.integers, tour_length(problem, visits)
    lower = certificate.unit * (bound - integers.rounding * len(visits))  # legs may have been rounded up
    met = tour_length(problem, visits, metric) <= bound + integers.tie
    rounding = (problem.resolution or 0.0) * len(visits) / 2
    optimal = met and cost - lower <= problem.tolerance(cost) + rounding
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    lower = cost if optimal else max(0.0, min(cost, lower))
    return Plan(tuple(visits), cost, lower, status, time.perf_counter() - started, certificate)
