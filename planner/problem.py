"""The routing problem of equation 1: capacitated pickup and delivery with an open tour."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from planner.errors import ProblemError


@dataclass(frozen=True)
class Shipment:
    """An object to fetch: indices into the distance matrix."""

    pickup: int
    delivery: int


@dataclass(frozen=True, eq=False)
class RoutingProblem:
    """What is left to do from any state of the task (PAPER section 2, with the history folded in).

    Attributes:
        distances: Geodesic distances between locations, m, shape (k, k), symmetric, zero diagonal.
        start: Location index where the person is now.
        shipments: Objects that still lie about; several may share a pickup or a delivery.
        onboard: Delivery index of each object that is carried now.
        capacity: How many objects may be carried at once.

    Raises:
        ProblemError: Not square, negative, not finite, asymmetric, an index out of range, or more onboard
            than the capacity.
    """

    distances: NDArray[np.float64]
    start: int
    shipments: tuple[Shipment, ...]
    onboard: tuple[int, ...] = ()
    capacity: int = 2

    def __post_init__(self) -> None:
        d = self.distances
        if d.ndim != 2 or d.shape[0] != d.shape[1] or d.shape[0] == 0:
            raise ProblemError(f"distances must be a square matrix, got shape {d.shape}")
        bad = np.argwhere(~np.isfinite(d) | (d < 0))
        if bad.size:
            i, j = bad[0]
            raise ProblemError(
                f"distances[{i}][{j}] is {d[i, j]}; every distance must be a finite number >= 0"
            )
        skew = np.argwhere(np.abs(d - d.T) > 1e-6)
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
        if self.capacity < 1:
            raise ProblemError(f"capacity must be at least 1, got {self.capacity}")
        if len(self.onboard) > self.capacity:
            raise ProblemError(f"{len(self.onboard)} objects are onboard but the capacity is {self.capacity}")
        indices = [("start", self.start), *(("onboard", j) for j in self.onboard)]
        for s in self.shipments:
            indices += [("pickup", s.pickup), ("delivery", s.delivery)]
        for what, index in indices:
            if not 0 <= index < len(d):
                raise ProblemError(f"{what} {index} is out of range for {len(d)} locations")
        d.setflags(write=False)
