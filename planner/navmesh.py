"""Where a person can stand: free space outside the obstacles inflated by the person's radius.

The exact free space is a set of polygons, one per island, in order of decreasing area; it answers every
question. The grid is its raster, for pictures and cross-checks.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import MultiPoint, MultiPolygon, Polygon

from planner.errors import NavMeshError, NotNavigableError

TOLERANCE = 1e-4  # depth in m that may be cut off an inflated obstacle; far below what matters to a walker
SNAP_CLEARANCE = 1e-6  # m; keeps a snapped point off the boundary in spite of rounding
ARC_SEGMENTS = 8  # per quarter circle: paths 0.01 % longer or shorter than around true circles


@dataclass(frozen=True, eq=False)
class NavMesh:
    """The navigable part of a floor.

    A point is navigable inside the bounds and outside the obstacles inflated by the agent's radius, boundary
    included, to a tolerance of 0.05 mm. Bounds are not inflated.

    Attributes:
        bounds: (x_min, y_min, x_max, y_max), m.
        agent_radius: By how much obstacles are inflated, m.
        resolution: Size of a grid cell, m.
        islands: Connected polygons of free space, largest first.
        solid: Inflated obstacles, shrunk by `TOLERANCE`: what a path may not touch.
        grid: Island of each cell's centre, -1 where it is not navigable, shape (rows, columns) int32; the
            centre of row r, column c is (x_min + (c + 0.5) resolution, y_min + (r + 0.5) resolution).
    """

    bounds: tuple[float, float, float, float]
    agent_radius: float
    resolution: float
    islands: tuple[Polygon, ...]
    solid: MultiPolygon
    grid: NDArray[np.int32]
    _loose: NDArray[np.object_] = field(repr=False)
    _snappable: NDArray[np.object_] = field(repr=False)

    @classmethod
    def build(
        cls,
        obstacles: Sequence[ArrayLike],
        bounds: Sequence[float],
        *,
        agent_radius: float = 0.25,
        resolution: float = 0.05,
    ) -> "NavMesh":
        """Inflate obstacles and find the islands of free space.

        Args:
            obstacles: Convex polygons, each (k, 2) vertices in m in any order (only their hull counts).
            bounds: (x_min, y_min, x_max, y_max), m.
            agent_radius: m.
            resolution: Size of a grid cell, m.

        Raises:
            NavMeshError: An obstacle, the bounds or a size is unusable.
            NotNavigableError: No free space is left.
        """
        box = _box(bounds)
        if not (math.isfinite(agent_radius) and agent_radius >= 0):
            raise NavMeshError(f"agent_radius must be >= 0 m, got {agent_radius}")
        if not (math.isfinite(resolution) and resolution > 0):
            raise NavMeshError(f"resolution must be > 0 m, got {resolution}")
        hulls = [_hull(k, points) for k, points in enumerate(obstacles)]
        inflated = shapely.unary_union(shapely.buffer(hulls, agent_radius, quad_segs=ARC_SEGMENTS))
        pieces = [p for p in shapely.get_parts(box.difference(inflated)) if isinstance(p, Polygon)]
        snappable = [(p, shapely.buffer(p, -SNAP_CLEARANCE, join_style="mitre")) for p in pieces]
        kept = sorted(((p, s) for p, s in snappable if s.area > 0), key=lambda pair: -pair[0].area)
        if not kept:
            raise NotNavigableError(
                f"{len(hulls)} obstacles inflated by {agent_radius} m leave nothing navigable in "
                f"{box.bounds}; give wider bounds or a smaller agent_radius"
            )
        islands = tuple(p for p, _ in kept)
        loose = np.array(
            [shapely.buffer(p, 0.5 * TOLERANCE, join_style="mitre") for p in islands], dtype=object
        )
        shapely.prepare(loose)
        solid = MultiPolygon(
            [
                p
                for p in shapely.get_parts(shapely.buffer(inflated, -TOLERANCE, join_style="mitre"))
                if isinstance(p, Polygon) and not p.is_empty
            ]
        )
        return cls(
            bounds=box.bounds,
            agent_radius=float(agent_radius),
            resolution=float(resolution),
            islands=islands,
            solid=solid,
            grid=_raster(loose, box.bounds, resolution),
            _loose=loose,
            _snappable=np.array([s for _, s in kept], dtype=object),
        )

    @property
    def area(self) -> float:
        """Area of the largest island, m²."""
        return float(self.islands[0].area)

    def island_of(self, point: ArrayLike) -> int | None:
        """Index into `islands` of the island that holds a point (2,), m; None if it is not navigable."""
        x, y = _point(point)
        hits = np.flatnonzero(shapely.intersects_xy(self._loose, x, y))
        return int(hits[0]) if hits.size else None

    def is_navigable(self, point: ArrayLike) -> bool:
        """Whether a person can stand at a point (2,), m, on any island."""
        return self.island_of(point) is not None

    def snap(self, point: ArrayLike, max_distance: float = 1.0, island: int = 0) -> NDArray[np.float64]:
        """The nearest point of an island, by default the largest.

        Args:
            point: (2,), m.
            max_distance: How far away it may lie, m.
            island: Index into `islands`.

        Returns:
            The point itself if it is on the island, else the nearest one that is, (2,), m.

        Raises:
            NotNavigableError: The island is farther away than `max_distance`.
        """
        x, y = _point(point)
        if shapely.intersects_xy(self._loose[island], x, y):
            return np.array([x, y])
        line = shapely.shortest_line(self._snappable[island], shapely.Point(x, y))
        nearest = np.asarray(line.coords[0], dtype=np.float64)
        gap = math.hypot(nearest[0] - x, nearest[1] - y)
        if gap > max_distance:
            raise NotNavigableError(
                f"({x:.3f}, {y:.3f}) is {gap:.3f} m from the nearest navigable point "
                f"({nearest[0]:.3f}, {nearest[1]:.3f}), more than max_distance = {max_distance} m"
            )
        return nearest

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """A point drawn uniformly from the largest island, (2,), m."""
        x_min, y_min, x_max, y_max = self.islands[0].bounds
        shapely.prepare(self.islands[0])
        while True:  # rejection: ends, as the island has an area
            point = rng.uniform((x_min, y_min), (x_max, y_max))
            if shapely.contains_xy(self.islands[0], point[0], point[1]):
                return point

    def outline(self) -> NDArray[np.float64]:
        """Edges of the navigable floor: x, y of one end and of the other, m, shape (e, 4).

        A point is navigable if a ray from it crosses an odd number of them.
        """
        rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(self._loose)]
        return np.ascontiguousarray(np.concatenate([np.hstack([r[:-1], r[1:]]) for r in rings]))

    def cell_centres(self) -> NDArray[np.float64]:
        """Centres of the grid's cells, (rows, columns, 2), m."""
        return _centres(self.bounds, self.resolution)


def _point(point: ArrayLike) -> tuple[float, float]:
    array = np.asarray(point, dtype=np.float64)
    if array.shape != (2,) or not np.isfinite(array).all():
        raise NotNavigableError(f"a position must be two finite numbers, got {point!r}")
    return float(array[0]), float(array[1])


def _box(bounds: Sequence[float]) -> Polygon:
    b = np.asarray(bounds, dtype=np.float64)
    if b.shape != (4,) or not np.isfinite(b).all() or b[0] >= b[2] or b[1] >= b[3]:
        raise NavMeshError(
            f"bounds must be finite (x_min, y_min, x_max, y_max) in this order, got {bounds!r}"
        )
    return shapely.box(*b)


def _hull(index: int, points: ArrayLike) -> shapely.Geometry:
    array = np.asarray(points, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 2 or len(array) == 0 or not np.isfinite(array).all():
        raise NavMeshError(
            f"obstacle {index} must be finite vertices of shape (k, 2), got shape {array.shape}"
        )
    return MultiPoint(array).convex_hull


def _centres(bounds: tuple[float, float, float, float], resolution: float) -> NDArray[np.float64]:
    x_min, y_min, x_max, y_max = bounds
    columns, rows = (max(1, math.ceil(side / resolution - 1e-9)) for side in (x_max - x_min, y_max - y_min))
    x = x_min + (np.arange(columns) + 0.5) * resolution
    y = y_min + (np.arange(rows) + 0.5) * resolution
    return np.stack(np.meshgrid(x, y), axis=-1)


def _raster(
    islands: NDArray[np.object_], bounds: tuple[float, float, float, float], resolution: float
) -> NDArray[np.int32]:
    centres = _centres(bounds, resolution)
    grid = np.full(centres.shape[:2], -1, dtype=np.int32)
    for index in reversed(range(len(islands))):
        inside = shapely.intersects_xy(islands[index], centres[..., 0], centres[..., 1])
        grid[inside] = index
    grid.setflags(write=False)
    return grid
