"""Kernels that make the person's trunk, which is a disc, slide along the outlines of the house."""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import CELL, MARGIN, Floor
from mjsim.support.kernels import kernel
from mjsim.world.body.rig import VX, VY, X, Y

# Maximum length of a step in metres. With longer steps, a disc of radius 0.20 m could jump over a wall.
_MAX_STEP = 0.05
_MAX_ROUNDS = 12
_TOUCHING = 1e-7  # overlap with an outline that is tolerated, in metres


@kernel
def is_clear(x: float, y: float, reach_x: float, reach_y: float, radius: float, floor: Floor) -> bool:
    """Return True if no outline is within the given distances along x and y."""
    if max(reach_x, reach_y) > radius + MARGIN:
        return False  # the grid cell does not list outlines that are this far away
    start, end = _near(x, y, floor)
    for entry in range(start, end):
        box = floor.boxes[floor.near[entry]]
        if box[0] - reach_x < x < box[1] + reach_x and box[2] - reach_y < y < box[3] + reach_y:
            return False
    return True


@kernel
def _near(x: float, y: float, floor: Floor) -> tuple[int, int]:
    i, j = math.floor((x - floor.origin_x) / CELL), math.floor((y - floor.origin_y) / CELL)
    if not (0 <= i < floor.rows and 0 <= j < floor.columns):
        return 0, 0
    cell = i * floor.columns + j
    return floor.near_first[cell], floor.near_first[cell + 1]


@kernel
def slide(body: NDArray[np.float64], h: float, radius: float, floor: Floor) -> None:
    """Move a body (BODY_SIZE,) at its velocity for `h` seconds, and let the trunk slide along outlines."""
    length = h * math.sqrt(body[VX] * body[VX] + body[VY] * body[VY])
    parts = 1 + int(length / _MAX_STEP)
    for _ in range(parts):
        x, y = body[X], body[Y]
        body[X] += body[VX] * (h / parts)
        body[Y] += body[VY] * (h / parts)
        start, end = _near(x, y, floor)
        if start < end and not _push_out(body, radius, floor, start, end):
            # The trunk is stuck between walls: stay at the previous position.
            body[X], body[Y], body[VX], body[VY] = x, y, 0.0, 0.0


@kernel
def _push_out(body: NDArray[np.float64], radius: float, floor: Floor, start: int, end: int) -> bool:
    for _ in range(_MAX_ROUNDS):
        free = True
        for entry in range(start, end):
            polygon = floor.near[entry]
            box = floor.boxes[polygon]
            if not (
                box[0] - radius < body[X] < box[1] + radius and box[2] - radius < body[Y] < box[3] + radius
            ):
                continue
            gap, nx, ny = gap_to(
                body[X], body[Y], floor.edges, floor.first[polygon], floor.first[polygon + 1]
            )
            if gap >= radius - _TOUCHING:
                continue
            free = False
            body[X] += nx * (radius - gap)
            body[Y] += ny * (radius - gap)
            into = nx * body[VX] + ny * body[VY]
            if into < 0.0:
                body[VX] -= into * nx
                body[VY] -= into * ny
        if free:
            return True
    return False


@kernel
def gap_to(
    x: float, y: float, edges: NDArray[np.float64], first: int, last: int
) -> tuple[float, float, float]:
    """Return the signed distance of a point from a convex polygon, and the unit vector away from the polygon.

    The distance is negative inside. The polygon has the rows `first` to `last` - 1 of `Floor.edges` (e, 5).
    """
    nearest, near_x, near_y = math.inf, 0.0, 0.0
    depth, out_x, out_y = -math.inf, 0.0, 0.0
    for edge in range(first, last):
        dx, dy = x - edges[edge, 0], y - edges[edge, 1]
        ex, ey = edges[edge, 2], edges[edge, 3]
        beside = dx * ey - dy * ex  # positive to the right of the edge, which is outside the polygon
        if beside > depth:
            depth, out_x, out_y = beside, ey, -ex
        along = min(edges[edge, 4], max(0.0, dx * ex + dy * ey))
        dx, dy = dx - along * ex, dy - along * ey
        distance = dx * dx + dy * dy
        if distance < nearest:
            nearest, near_x, near_y = distance, dx, dy
    nearest = math.sqrt(nearest)
    if depth <= 0.0 or nearest < 1e-12:
        return depth, out_x, out_y
    return nearest, near_x / nearest, near_y / nearest
