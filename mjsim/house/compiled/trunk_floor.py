"""Outlines of a house that stop the trunk of a person, in a grid for quick look-up."""

from typing import NamedTuple

import mujoco
import numpy as np
import shapely
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import footprint

_TRUNK_BAND = (0.04, 1.72)  # heights of the trunk, m
CELL = 0.25  # m
MARGIN = 0.12  # m beyond the trunk that a cell of the grid covers


class Floor(NamedTuple):
    """Outlines of the obstacles of the trunk, with a grid to look up the near ones; for kernels."""

    # edges of all convex polygons, counter-clockwise: start x, y, direction x, y, and length, m, (e, 5)
    edges: NDArray[np.float64]
    first: NDArray[np.int64]  # polygon p has the edges `first[p]` to `first[p + 1]`, (p + 1,)
    boxes: NDArray[np.float64]  # each polygon's smallest and largest x, and smallest and largest y, m, (p, 4)
    near: NDArray[np.int64]  # polygons that may touch the trunk, cell by cell
    near_first: NDArray[np.int64]  # cell i, j has `near` from `near_first[i * columns + j]`, (cells + 1,)
    origin_x: float  # corner of cell 0, 0, m
    origin_y: float
    rows: int  # cells along x
    columns: int  # cells along y

    @classmethod
    def of(cls, model: mujoco.MjModel, radius: float) -> "Floor":
        """Outlines of the static geoms at the heights of a trunk of this radius, m."""
        low, high = _TRUNK_BAND
        return cls.of_polygons(footprint(model, low=low, high=high).obstacles, radius)

    @classmethod
    def of_polygons(cls, polygons: tuple[NDArray[np.float64], ...], radius: float) -> "Floor":
        """Convex counter-clockwise polygons (k, 2), m, for a trunk of this radius, m."""
        reach = radius + MARGIN
        boxes = np.array([[*p.min(axis=0), *p.max(axis=0)] for p in polygons]).reshape(-1, 4)
        low = boxes[:, :2].min(axis=0, initial=np.inf) - reach if len(polygons) else np.zeros(2)
        high = boxes[:, 2:].max(axis=0, initial=-np.inf) + reach if len(polygons) else np.ones(2)
        rows, columns = (int(n) for n in np.ceil((high - low) / CELL))
        i, j = (index.ravel() for index in np.mgrid[:rows, :columns])
        x, y = low[0] + CELL * i, low[1] + CELL * j
        cells = shapely.box(x, y, x + CELL, y + CELL)
        tree = shapely.STRtree([shapely.Polygon(polygon) for polygon in polygons])
        cell, near = tree.query(cells, predicate="dwithin", distance=reach)
        order = np.lexsort((near, cell))
        edges = [_edges(polygon) for polygon in polygons]
        counts = np.bincount(cell, minlength=rows * columns)
        return cls(
            edges=np.concatenate([np.zeros((0, 5)), *edges]),
            first=np.cumsum([0, *(len(sides) for sides in edges)], dtype=np.int64),
            boxes=np.ascontiguousarray(boxes[:, [0, 2, 1, 3]]),
            near=np.ascontiguousarray(near[order].astype(np.int64)),
            near_first=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
            origin_x=float(low[0]),
            origin_y=float(low[1]),
            rows=rows,
            columns=columns,
        )


def _edges(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    """Start, direction and length of the sides of a polygon (k, 2), shape (k, 5); none of length 0."""
    sides = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    keep = lengths > 0.0
    return np.column_stack((polygon[keep], sides[keep] / lengths[keep, None], lengths[keep]))
