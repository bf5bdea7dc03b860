"""How far a point at carrying height is from walls and furniture: a signed distance field over the floor."""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from mjsim.house.compiled.footprint import footprint
from mjsim.support.kernels import kernel

BORDER = 0.4  # m of grid around the rooms


class ClearanceField(NamedTuple):
    """Signed distance to the static geoms of a band of heights, on a grid; also for kernels."""

    distance: NDArray[np.float64]  # distance of each cell's centre, m, positive outside, (nx, ny)
    gradient: NDArray[np.float64]  # direction of increasing distance, (nx, ny, 2)
    origin_x: float  # centre of cell (0, 0), m
    origin_y: float
    resolution: float  # cell size, m

    @classmethod
    def from_model(
        cls,
        model: mujoco.MjModel,
        *,
        low: float,
        high: float,
        resolution: float = 0.04,
        border: float = BORDER,
    ) -> "ClearanceField":
        """Rasterise the static colliding geoms between two heights, m, up to `border` m around the rooms."""
        plan = footprint(model, low=low, high=high)
        xmin, ymin, xmax, ymax = plan.bounds
        origin = np.array([xmin - border, ymin - border])
        shape = np.ceil((np.array([xmax, ymax]) + border - origin) / resolution).astype(int) + 1
        solid = np.zeros(tuple(shape), dtype=bool)
        for polygon in plan.obstacles:
            _fill(solid, (polygon - origin) / resolution)
        outside = distance_transform_edt(~solid) if solid.any() else np.full(solid.shape, math.inf)
        distance = np.minimum((outside - distance_transform_edt(solid)) * resolution, 9.0)
        gradient = np.stack(np.gradient(distance, resolution), axis=-1)
        size = np.linalg.norm(gradient, axis=-1, keepdims=True)
        unit = np.divide(gradient, size, out=np.zeros_like(gradient), where=size > 1e-9)
        return cls(distance, unit, float(origin[0]), float(origin[1]), resolution)


@kernel
def clearance_at(x: float, y: float, field: ClearanceField) -> tuple[float, float, float]:
    """Distance at a point, m, interpolated, and the direction (x, y) away from the nearest geom."""
    distance, gradient = field.distance, field.gradient
    u = (x - field.origin_x) / field.resolution
    v = (y - field.origin_y) / field.resolution
    i = min(max(int(u), 0), distance.shape[0] - 2)
    j = min(max(int(v), 0), distance.shape[1] - 2)
    a, b = min(max(u - i, 0.0), 1.0), min(max(v - j, 0.0), 1.0)
    low = (1 - a) * distance[i, j] + a * distance[i + 1, j]
    high = (1 - a) * distance[i, j + 1] + a * distance[i + 1, j + 1]
    near_i, near_j = i + int(a > 0.5), j + int(b > 0.5)
    return (1 - b) * low + b * high, gradient[near_i, near_j, 0], gradient[near_i, near_j, 1]


def _fill(grid: NDArray[np.bool_], polygon: NDArray[np.float64]) -> None:
    """Mark the cells whose centre lies within half a cell of a convex polygon, given in cells, (k, 2)."""
    low = np.maximum(np.floor(polygon.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(polygon.max(axis=0)).astype(int) + 1, grid.shape)
    if np.any(low >= high):
        return
    cells = np.stack(
        np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), -1
    )
    inside = np.ones(cells.shape[:2], dtype=bool)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        edge = end - start
        length = float(np.hypot(*edge))
        if length > 1e-9:  # counter-clockwise: the inside lies to the left of every edge
            offset = cells - start
            left_by = (edge[0] * offset[..., 1] - edge[1] * offset[..., 0]) / length
            inside &= left_by >= -0.5
    grid[low[0] : high[0], low[1] : high[1]] |= inside
