"""Kernels that measure and cut polylines on the floor.

A point is passed as two numbers, a polyline as an array (k, 2) with k >= 1, all in metres.
"""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

Path = NDArray[np.float64]

AT_THE_END = 1e-9  # distance below which two points count as equal, in metres


@kernel
def distance(x: float, y: float, to_x: float, to_y: float) -> float:
    return math.sqrt((to_x - x) * (to_x - x) + (to_y - y) * (to_y - y))


@kernel
def project(path: Path, x: float, y: float) -> tuple[float, float]:
    """Return the arc length at the point of `path` nearest to (x, y), and the distance to it, in metres."""
    nearest_arc, nearest_gap = 0.0, distance(x, y, path[0, 0], path[0, 1])
    arc = 0.0
    for k in range(len(path) - 1):
        dx, dy = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            t = ((x - path[k, 0]) * dx + (y - path[k, 1]) * dy) / (length * length)
            t = min(max(t, 0.0), 1.0)
            gap = distance(x, y, path[k, 0] + t * dx, path[k, 1] + t * dy)
            if gap < nearest_gap:
                nearest_arc, nearest_gap = arc + t * length, gap
            arc += length
    return nearest_arc, nearest_gap


@kernel
def path_length(path: Path) -> float:
    """Return the length of a polyline in metres."""
    arc = 0.0
    for k in range(len(path) - 1):
        arc += distance(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
    return arc


@kernel
def point_along(path: Path, arc: float) -> tuple[float, float]:
    """Return the point of `path` at an arc length in metres, clamped to the ends of the path."""
    passed = 0.0
    if arc <= 0.0:
        return path[0, 0], path[0, 1]
    for k in range(len(path) - 1):
        dx, dy = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if arc < passed + length:
            t = (arc - passed) / length
            return path[k, 0] + t * dx, path[k, 1] + t * dy
        passed += length
    return path[-1, 0], path[-1, 1]


@kernel
def rest_of(path: Path, x: float, y: float) -> Path:
    """Return the part of `path` that starts at its point nearest to (x, y), shape (k, 2)."""
    arc, _ = project(path, x, y)
    if path_length(path) - arc < AT_THE_END:
        return path[-1:].copy()
    passed, first = 0.0, 0
    while passed <= arc + AT_THE_END and first < len(path) - 1:
        passed += distance(path[first, 0], path[first, 1], path[first + 1, 0], path[first + 1, 1])
        first += 1
    rest = np.empty((len(path) - first + 1, 2))
    rest[0, 0], rest[0, 1] = point_along(path, arc)
    rest[1:] = path[first:]
    return rest


@kernel
def first_off_path(path: Path, positions: NDArray[np.float64], first: int, gap: float) -> int:
    """Return the first index >= `first` of a position (n, 2) more than `gap` metres from `path`, or -1."""
    for k in range(first, len(positions)):
        if project(path, positions[k, 0], positions[k, 1])[1] > gap:
            return k
    return -1
