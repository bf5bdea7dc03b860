"""Pickup and delivery problems with a limited capacity and an open tour (PAPER, equation 1)."""

import math
import time
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE, IntegerDistances, integer_distances
from planner.plan import Certificate, Plan, Status, Visit, VisitKind

MIN_LARGEST, MAX_LARGEST = 1e-250, 1e250  # limits of the largest distance that prevent overflow and underflow
SAME = 1e-6  # difference up to which two distances or tour lengths count as equal, in metres
ASYMMETRY = 1e-12  # relative difference between d[i, j] and d[j, i] that is accepted as a rounding error


@dataclass(frozen=True)
class Shipment:
    """An object to pick up and deliver. Both locations are indices into the distance matrix."""

    pickup: int
    delivery: int


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """A routing problem for the rest of a task, which may already be in progress (PAPER section 2).

    Object numbers start with the shipments and continue with the objects already on board.

    Attributes:
        distances: Geodesic distances between locations in metres, shape (k, k), symmetric with a zero diagonal.
        start: Index of the location where the tour starts.
        shipments: Objects still to be picked up. Several objects may share a pickup or a delivery location.
        onboard: Index of the delivery location of each object that is already carried.
        capacity: Maximum number of objects that can be carried.
        names: Unique names of the objects, in the order of their numbers, which are also the default names.
        resolution: Rounding precision of the distances in metres, or None if the distances are exact. With a
            resolution, two tours count as equal if rounding of their legs can explain the difference.
            Otherwise, they count as equal if they differ by at most 1e-9 of their length.

    Raises:
        ProblemError: The distance matrix is not square or not symmetric, a distance is negative, not finite,
            too large or too small, an index is out of range, more objects are on board than the capacity
            allows, or the number of unique names differs from the number of objects.

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
        """Sorted indices of all locations that a tour must visit, including the start."""
        places = {self.start, *self.onboard}
        return sorted(places.union(*((s.pickup, s.delivery) for s in self.shipments)))

    @cached_property
    def integers(self) -> IntegerDistances:
        """The distances, rounded to integer multiples of a unit."""
        return integer_distances(self.distances, self.used, self.resolution)

    def tolerance(self, length: float) -> float:
        """Return the largest difference in metres at which two tours of about this length count as equal."""
        if self.resolution is None:
            return TOLERANCE * length
        return 2 * self.resolution * (len(self.shipments) + len(self.names))

    @cached_property
    def number(self) -> dict[str, int]:
        """A mapping from object names to object numbers."""
        return {name: k for k, name in enumerate(self.names)}

    def pick(self, shipment: int) -> Visit:
        """Return the visit that picks up a shipment."""
        return Visit(VisitKind.PICK, self.names[shipment])

    def place(self, number: int) -> Visit:
        """Return the visit that delivers the object with this number."""
        return Visit(VisitKind.PLACE, self.names[number])

    def location(self, visit: Visit) -> int:
        """Return the index of the location where a visit takes place."""
        number, n = self.number[visit.object], len(self.shipments)
        if number >= n:
            return self.onboard[number - n]
        shipment = self.shipments[number]
        return shipment.pickup if visit.kind is VisitKind.PICK else shipment.delivery

    @property
    def visits(self) -> list[Visit]:
        """All visits of the task: first the picks, then the places, each ordered by object number."""
        picks = map(self.pick, range(len(self.shipments)))
        return [*picks, *map(self.place, range(len(self.names)))]

    def stops(self, visits: Iterable[Visit]) -> list[int]:
        """Return the indices of the start location and of all visited locations, in order."""
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
    """Yield the visits that may follow the given visits, subject to capacity and precedence."""
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

    If `distances` is given, this matrix of shape (k, k) is used instead of the problem's own matrix. The
    result is exact for integer lengths below 2^53.
    """
    stops = problem.stops(visits)
    return float((problem.distances if distances is None else distances)[stops[:-1], stops[1:]].sum())


def after(problem: RoutingProblem, visit: Visit) -> RoutingProblem:
    """Return the problem that remains after a visit. Raises ProblemError if the visit is not possible."""
    if visit not in possible_next(problem):
        raise ProblemError(f"{visit} is not possible now; choose one of possible_next")
    shipments, onboard = list(problem.shipments), list(problem.onboard)
    names, number = list(problem.names), problem.number[visit.object]
    name = names.pop(number)
    if visit.kind is VisitKind.PICK:
        onboard.append(shipments.pop(number).delivery)
        names.append(name)
    else:
        onboard.pop(number - len(shipments))
    start = problem.location(visit)
    return replace(
        problem, start=start, shipments=tuple(shipments), onboard=tuple(onboard), names=tuple(names)
    )


def is_for(plan: Plan, problem: RoutingProblem) -> bool:
    """Return True if `plan` is a plan for `problem`."""
    if set(plan.visits) != set(problem.visits):
        return False
    return abs(tour_length(problem, plan.visits) - plan.cost) <= SAME


def same_problem(one: RoutingProblem, other: RoutingProblem) -> bool:
    """Return True if two problems have the same objects, the same places and the same start."""
    if set(one.visits) != set(other.visits) or one.capacity != other.capacity:
        return False
    here, there = (problem.stops(one.visits) for problem in (one, other))
    first, second = one.distances[np.ix_(here, here)], other.distances[np.ix_(there, there)]
    return np.allclose(first, second, rtol=0.0, atol=SAME)


def spanning_bound(problem: RoutingProblem) -> int:
    """Return a lower bound on the tour length in units, which is the length of the minimum spanning tree."""
    from scipy.sparse.csgraph import minimum_spanning_tree  # imported here because SciPy is slow to import

    used = problem.used
    if len(used) == 1:
        return 0
    # SciPy treats 0 as a missing edge, so add 1 to every edge and subtract it again from the tree.
    tree = minimum_spanning_tree(problem.integers.legs[np.ix_(used, used)] + 1)
    return int(tree.sum()) - (len(used) - 1)


def make_plan(
    problem: RoutingProblem,
    visits: Sequence[Visit],
    length: float,
    bound: int,
    started: float,
    certificate: Certificate,
) -> Plan:
    """Create a plan from a tour that was found with integer distances.

    `length` is the length of the tour in units, and `bound` is a lower bound on such lengths. `started` is the value of
    `time.perf_counter()` when the solver started. The plan's lower bound also holds for the original distances. The
    plan is OPTIMAL if the tour is as short as the bound, both in integer distances and, within the problem's tolerance,
    in original distances.
    """
    integers, cost = problem.integers, tour_length(problem, visits)
    lower = certificate.unit * (bound - integers.rounding * len(visits))  # a leg may have been rounded up
    met = length <= bound + integers.tie
    rounding = (problem.resolution or 0.0) * len(visits) / 2
    optimal = met and cost - lower <= problem.tolerance(cost) + rounding
    status = Status.OPTIMAL if optimal else Status.FEASIBLE
    lower = cost if optimal else max(0.0, min(cost, lower))
    return Plan(tuple(visits), cost, lower, status, time.perf_counter() - started, certificate)
