"""The routing problem of equation 1: capacitated pickup and delivery with an open tour."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError
from planner.integer_distances import TOLERANCE, IntegerDistances, integer_distances
from planner.plan import Visit, VisitKind

MIN_LARGEST, MAX_LARGEST = 1e-250, 1e250  # m; lengths and units of tours in between are ordinary floats
ASYMMETRY = 1e-12  # share by which a distance may differ between both ways: rounding alone


@dataclass(frozen=True)
class Shipment:
    """An object to fetch: indices into the distance matrix."""

    pickup: int
    delivery: int


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """What is left to do from any state of the task (PAPER section 2).

    Objects are numbered: first the shipments, then what is onboard.

    Attributes:
        distances: Geodesic distances between locations, m, shape (k, k), symmetric, zero diagonal.
        start: Location index where the person is now.
        shipments: Objects that still lie about; several may share a pickup or a delivery.
        onboard: Delivery index of each object that is carried now.
        capacity: How many objects may be carried at once.
        names: Of the objects, in the order of their numbers; by default the numbers themselves.
        resolution: Precision of the distances, m: they are rounded to it, and tours are equal that differ by the
            rounding of their legs. None: distances are exact, and tours compared to 1e-9 of their length.

    Raises:
        ProblemError: Not square, negative, not finite, of a scale beyond computing, asymmetric, an index out of range,
            more onboard than the capacity, or names that are too few, too many or not unique.

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
        """The locations that every tour visits, ascending: indices into the distances."""
        places = {self.start, *self.onboard}
        return sorted(places.union(*((s.pickup, s.delivery) for s in self.shipments)))

    @cached_property
    def integers(self) -> IntegerDistances:
        """The distances in whole units."""
        return integer_distances(self.distances, self.used, self.resolution)

    def tolerance(self, length: float) -> float:
        """Tours of about this length, m, are equal if they differ by no more than this, m."""
        if self.resolution is None:
            return TOLERANCE * length
        return 2 * self.resolution * (len(self.shipments) + len(self.names))

    @cached_property
    def number(self) -> dict[str, int]:
        """Name -> number of each object."""
        return {name: k for k, name in enumerate(self.names)}

    def pick(self, shipment: int) -> Visit:
        """The visit that picks a shipment, by its number."""
        return Visit(VisitKind.PICK, self.names[shipment])

    def place(self, number: int) -> Visit:
        """The visit that places a shipment or an object onboard, by its number."""
        return Visit(VisitKind.PLACE, self.names[number])

    def location(self, visit: Visit) -> int:
        """Index into the distances of where a visit happens."""
        number, n = self.number[visit.object], len(self.shipments)
        if number >= n:
            return self.onboard[number - n]
        shipment = self.shipments[number]
        return shipment.pickup if visit.kind is VisitKind.PICK else shipment.delivery

    def stops(self, visits: Iterable[Visit]) -> list[int]:
        """The start and the location of each visit: indices into the distances."""
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
        """Refuse distances on the tour whose sums, or whose smallest parts, floats could not hold."""
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
