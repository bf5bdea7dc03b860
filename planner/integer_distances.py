"""Distances in whole units, so that lengths of tours are summed and compared exactly."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

TOLERANCE = 1e-9  # share of its length by which an optimal tour may exceed the shortest one
FINE = 1 << 44  # units of the largest distance where no coarser unit is exact; 2^18 legs cannot overflow
TIE = 1e-10  # share of the largest distance; tours closer than this may differ by rounding alone
COARSE = 1 << 20  # units of the largest distance that leave tours of 40 objects within 32 bits
ROUND = 1e-15  # share of the largest distance by which decimal fractions in binary are off


@dataclass(frozen=True, eq=False)
class IntegerDistances:
    """Distances of a problem in whole units."""

    unit: float  # m per unit
    tie: int  # tours that differ by no more than this are equal, units
    rounding: float  # by how much a leg was rounded at most, units; 0 where the unit is exact
    used: Sequence[int]  # locations that tours visit
    # distances, rounded, symmetric; those of locations that no tour visits are 0, (k, k)
    legs: NDArray[np.int64]

    @cached_property
    def metric(self) -> NDArray[np.int64]:
        """The same, closed to a metric, (k, k).

        Rounding can break the triangle inequality by a unit, and solvers rely on it: closing restores it.
        """
        return shortest_connections(self.legs, self.used)

    @cached_property
    def is_metric(self) -> bool:
        """Whether the distances keep the triangle inequality, to rounding."""
        return bool((self.legs - self.metric).max(initial=0) <= 2 * len(self.legs))


def integer_distances(
    distances: NDArray[np.float64], used: Sequence[int], resolution: float | None
) -> IntegerDistances:
    """Round distances, m, (k, k), between the `used` locations to whole units.

    The unit is the resolution where there is one. Otherwise it is a power of ten of which all distances are whole
    multiples, or 2^-44 of the largest: so fine that rounding a whole tour changes it by less than `TOLERANCE`.
    """
    block = distances[np.ix_(used, used)]
    unit, tie = (resolution, 0) if resolution is not None else _unit(block)
    rounded = np.rint(block / unit)
    exact = resolution is None and tie == 0
    legs = np.zeros(distances.shape, np.int64)
    legs[np.ix_(used, used)] = np.minimum(rounded, rounded.T)
    return IntegerDistances(unit, tie, 0.0 if exact else 0.5, used, legs)


def _unit(block: NDArray[np.float64]) -> tuple[float, int]:
    """Unit, m, and tie, units, for distances, m, (u, u)."""
    largest = float(block.max(initial=0.0))
    if largest == 0.0:
        return 1.0, 0
    unit = float(f"1e{math.ceil(math.log10(largest / COARSE))}")
    multiples = block / unit
    if np.abs(multiples - np.rint(multiples)).max() <= ROUND * largest / unit:
        return unit, 0
    return largest / FINE, int(TIE * FINE)


def shortest_connections(distances: NDArray[Any], used: Sequence[int]) -> NDArray[Any]:
    """Shortest connections over the `used` locations among symmetric distances, (k, k) as they are."""
    shortest = distances.copy()
    for k in used:  # Floyd-Warshall; scipy's reads a distance of 0 as "no edge"
        np.minimum(shortest, shortest[:, k, None] + shortest[None, k, :], out=shortest)
    return shortest
