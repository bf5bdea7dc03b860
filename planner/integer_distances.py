"""Convert distances to integers so that tour lengths can be summed and compared exactly."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

TOLERANCE = 1e-9  # maximum relative error in the length of a tour that counts as optimal
FINE = 1 << 44  # largest distance in the finest unit, so that a sum of 2^18 distances fits into int64
TIE = 1e-10  # length difference that may be due to rounding, relative to the largest distance
COARSE = 1 << 20  # largest distance in units for which tours of 60 objects fit into 32 bits
ROUND = 1e-15  # rounding error of decimal fractions in floats, relative to the largest distance


@dataclass(frozen=True, eq=False)
class IntegerDistances:
    """The distances of a problem, rounded to integer units."""

    unit: float  # length of one unit in metres
    tie: int  # maximum difference between tours that count as equal, in units
    rounding: float  # maximum rounding error of a leg in units; 0 if all distances are multiples of the unit
    used: Sequence[int]  # indices of the locations that every tour visits
    # Symmetric matrix of rounded distances, 0 for locations that no tour visits, shape (k, k)
    legs: NDArray[np.int64]

    @cached_property
    def metric(self) -> NDArray[np.int64]:
        """The lengths of shortest paths between locations, based on rounded distances, shape (k, k).

        Solvers rely on the triangle inequality, which rounding can violate by one unit.
        """
        return shortest_connections(self.legs, self.used)

    @cached_property
    def is_metric(self) -> bool:
        """True if the distances satisfy the triangle inequality, up to rounding."""
        return bool((self.legs - self.metric).max(initial=0) <= 2 * len(self.legs))


def integer_distances(
    distances: NDArray[np.float64], used: Sequence[int], resolution: float | None
) -> IntegerDistances:
    """Convert the distances between the `used` locations from metres to integer units.

    The unit is the resolution if one is given. Otherwise, it is a power of ten if all distances are multiples
    of it. If not, it is 2^-44 of the largest distance, so that rounding errors stay below `TOLERANCE`.
    """
    block = distances[np.ix_(used, used)]
    unit, tie = (resolution, 0) if resolution is not None else _unit(block)
    rounded = np.rint(block / unit)
    exact = resolution is None and tie == 0
    legs = np.zeros(distances.shape, np.int64)
    legs[np.ix_(used, used)] = np.minimum(rounded, rounded.T)
    return IntegerDistances(unit, tie, 0.0 if exact else 0.5, used, legs)


def _unit(block: NDArray[np.float64]) -> tuple[float, int]:
    largest = float(block.max(initial=0.0))
    if largest == 0.0:
        return 1.0, 0
    unit = float(f"1e{math.ceil(math.log10(largest / COARSE))}")
    multiples = block / unit
    if np.abs(multiples - np.rint(multiples)).max() <= ROUND * largest / unit:
        return unit, 0
    return largest / FINE, int(TIE * FINE)


def shortest_connections(distances: NDArray[Any], used: Sequence[int]) -> NDArray[Any]:
    """Return the lengths of shortest paths via the `used` locations, given symmetric distances (k, k)."""
    shortest = distances.copy()
    for k in used:  # Floyd-Warshall algorithm; SciPy's version treats 0 as a missing edge
        np.minimum(shortest, shortest[:, k, None] + shortest[None, k, :], out=shortest)
    return shortest
