"""Navigation meshes, which describe the free floor around obstacles that are inflated by a person's radius."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import MultiPolygon, Polygon

from planner.errors import NavMeshError, NotNavigableError

TOLERANCE = 1e-4  # maximum depth to which a path may cut into an inflated obstacle, in metres
SNAP_CLEARANCE = 1e-6  # distance of snapped points from the boundary in metres, to allow for rounding errors
ARC_SEGMENTS = 8  # number of segments per quarter circle, which makes path lengths accurate to 0.01 %
BLOCKED = -1  # index of points outside all islands


@dataclass(frozen=True, eq=False)
class NavMesh:
    """The navigable part of a floor.

    A point is navigable if it is inside the bounds and not inside an obstacle inflated by the agent's radius. Points on
    the boundary are navigable, with a tolerance of 0.05 mm. The radius does not apply to the bounds.

    Attributes:
        bounds: (x_min, y_min, x_max, y_max) in metres.
        agent_radius: Distance by which obstacles are inflated, in metres.
        resolution: Side length of a grid cell in metres.
        islands: Connected polygons of free space, largest first.
        solid: Inflated obstacles shrunk by `TOLERANCE`. Paths may not touch them.
    """

    bounds: tuple[float, float, float, float]
    agent_radius: float
    resolution: float
    islands: tuple[Polygon, ...]
    solid: MultiPolygon
    _inner: NDArray[np.object_] = field(repr=False)  # islands shrunk by `SNAP_CLEARANCE`
    _outer: NDArray[np.object_] = field(repr=False)  # islands grown by half of `TOLERANCE`

    @classmethod
    def build(
        cls,
        obstacles: Sequence[ArrayLike],
        bounds: Sequence[float],
        *,
        agent_radius: float = 0.25,
        resolution: float = 0.05,
    ) -> "NavMesh":
        """Build a navmesh from obstacles and bounds.

        Args:
            obstacles: Convex polygons, each with its vertices in any order, in metres, shape (k, 2).
            bounds: (x_min, y_min, x_max, y_max) in metres.
            agent_radius: Distance by which obstacles are inflated, in metres.
            resolution: Side length of a grid cell in metres.

        Raises:
            NavMeshError: An obstacle, the bounds or a size is invalid.
            NotNavigableError: No free space is left.
        """
        box = _box(bounds)
        if not (math.isfinite(agent_radius) and agent_radius >= 0):
            raise NavMeshError(f"agent_radius must be >= 0 m, got {agent_radius}")
        if not (math.isfinite(resolution) and resolution > 0):
            raise NavMeshError(f"resolution must be > 0 m, got {resolution}")
        hulls = _hulls(obstacles)
        inflated = shapely.unary_union(shapely.buffer(hulls, agent_radius, quad_segs=ARC_SEGMENTS))
        islands, inner = _islands(box.difference(inflated))
        if not len(islands):
            raise NotNavigableError(
                f"{len(hulls)} obstacles inflated by {agent_radius} m leave nothing navigable in "
                f"{box.bounds}; give wider bounds or a smaller agent_radius"
            )
        outer = shapely.buffer(islands, 0.5 * TOLERANCE, join_style="mitre")
        shapely.prepare(islands)
        shapely.prepare(outer)
        solid = MultiPolygon(_polygons(shapely.buffer(inflated, -TOLERANCE, join_style="mitre")))
        return cls(box.bounds, float(agent_radius), float(resolution), tuple(islands), solid, inner, outer)

    @property
    def area(self) -> float:
        """Area of the largest island in square metres."""
        return float(self.islands[0].area)

    @property
    def cell_centres(self) -> NDArray[np.float64]:
        """The centres of the grid cells in metres, shape (rows, columns, 2).

        The centre in row r and column c is x_min + (c + 0.5) * resolution, y_min + (r + 0.5) * resolution.
        """
        x, y = (
            low
            + (np.arange(max(1, math.ceil((high - low) / self.resolution - 1e-9))) + 0.5) * self.resolution
            for low, high in zip(self.bounds[:2], self.bounds[2:], strict=True)
        )
        return np.stack(np.meshgrid(x, y), axis=-1)

    @cached_property
    def topdown_map(self) -> NDArray[np.int32]:
        """The island index at the centre of each grid cell: 0 for the largest island, -1 outside all islands.

        The array is read-only and has the shape (rows, columns). Row 0 has the smallest y, so draw the map with the
        origin at the lower left. `cell_centres` contains all centres.
        """
        islands = self.islands_at(self.cell_centres)
        islands.setflags(write=False)
        return islands

    def islands_at(self, points: NDArray[np.float64]) -> NDArray[np.int32]:
        """Return the island index at points (..., 2) in metres, and -1 for points outside all islands."""
        found = np.full(points.shape[:-1], BLOCKED, dtype=np.int32)
        for index in reversed(range(len(self._outer))):
            found[shapely.intersects_xy(self._outer[index], points[..., 0], points[..., 1])] = index
        return found

    def island_of(self, point: ArrayLike) -> int | None:
        """Return the index of the island that contains a point (x, y) in metres, or None if not navigable."""
        island = int(self.islands_at(np.array(_point(point))))
        return None if island == BLOCKED else island

    def is_navigable(self, point: ArrayLike) -> bool:
        """Return True if a point (x, y) in metres is navigable. The point may be on any island."""
        return self.island_of(point) is not None

    def snap(self, point: ArrayLike, max_distance: float = 1.0, island: int = 0) -> NDArray[np.float64]:
        """Return the point of an island that is nearest to a point (x, y) in metres. Island 0 is the largest.

        A point that is already on the island is returned unchanged. The tolerance of `is_navigable` does not
        apply. Raises NotNavigableError if the island is more than `max_distance` metres away.
        """
        x, y = _point(point)
        if shapely.intersects_xy(self.islands[island], x, y):
            return np.array([x, y])
        line = shapely.shortest_line(self._inner[island], shapely.Point(x, y))
        nearest = np.asarray(line.coords[0], dtype=np.float64)
        gap = math.hypot(nearest[0] - x, nearest[1] - y)
        if gap > max_distance:
            raise NotNavigableError(
                f"({x:.3f}, {y:.3f}) is {gap:.3f} m from the nearest navigable point "
                f"({nearest[0]:.3f}, {nearest[1]:.3f}), more than max_distance = {max_distance} m"
            )
        return nearest

    def sample(self, rng: np.random.Generator, count: int | None = None) -> NDArray[np.float64]:
        """Draw one or `count` random points, uniformly distributed over the largest island, in metres.

        With `count`, the shape is (count, 2), and the points are the same as those of `count` separate calls.
        """
        island = self.islands[0]
        x_min, y_min, x_max, y_max = island.bounds
        if count is None:  # a point that is drawn without arrays takes a quarter of the time
            while True:
                x, y = rng.uniform(x_min, x_max), rng.uniform(y_min, y_max)
                if shapely.contains_xy(island, x, y):
                    return np.array([x, y])
        drawn, missing = [np.empty((0, 2))], count
        while missing:  # rejection sampling
            points = rng.uniform((x_min, y_min), (x_max, y_max), (missing, 2))
            drawn.append(points[shapely.contains_xy(island, points)])
            missing -= len(drawn[-1])
        return np.concatenate(drawn)

    @cached_property
    def outline(self) -> NDArray[np.float64]:
        """The edges of the navigable floor, as x and y of both ends in metres, shape (e, 4).

        A point is navigable if a ray from it crosses an odd number of edges.
        """
        return edges(self._outer)


def _islands(free: shapely.Geometry) -> tuple[NDArray[np.object_], NDArray[np.object_]]:
    islands = np.array(sorted(_polygons(free), key=lambda p: -p.area), dtype=object)
    inner = shapely.buffer(islands, -SNAP_CLEARANCE, join_style="mitre")
    kept = shapely.area(inner) > 0
    return islands[kept], inner[kept]


def edges(polygons: NDArray[np.object_]) -> NDArray[np.float64]:
    """Return the edges of polygons, as x and y of both ends, shape (e, 4)."""
    rings = [shapely.get_coordinates(ring) for ring in shapely.get_rings(polygons)]
    return np.concatenate([np.empty((0, 4)), *(np.hstack([ring[:-1], ring[1:]]) for ring in rings)])


def _polygons(geometry: shapely.Geometry) -> list[Polygon]:
    return [p for p in shapely.get_parts(geometry) if isinstance(p, Polygon) and not p.is_empty]


def _point(point: ArrayLike) -> tuple[float, float]:
    array = np.asarray(point, dtype=np.float64)
    if array.shape == (2,):
        x, y = array.tolist()
        if math.isfinite(x) and math.isfinite(y):
            return x, y
    raise NotNavigableError(f"a position must be two finite numbers, got {point!r}")


def _box(bounds: Sequence[float]) -> Polygon:
    b = np.asarray(bounds, dtype=np.float64)
    if b.shape != (4,) or not np.isfinite(b).all() or b[0] >= b[2] or b[1] >= b[3]:
        raise NavMeshError(
            f"bounds must be finite (x_min, y_min, x_max, y_max) in this order, got {bounds!r}"
        )
    return shapely.box(*b)


def _hulls(obstacles: Sequence[ArrayLike]) -> NDArray[np.object_]:
    arrays = [np.asarray(points, dtype=np.float64) for points in obstacles]
    for index, array in enumerate(arrays):
        if array.ndim != 2 or array.shape[1] != 2 or len(array) == 0 or not np.isfinite(array).all():
            raise NavMeshError(
                f"obstacle {index} must be finite vertices of shape (k, 2), got shape {array.shape}"
            )
    owners = np.repeat(np.arange(len(arrays)), [len(array) for array in arrays])
    points = shapely.points(np.concatenate([np.empty((0, 2)), *arrays]))
    return np.asarray(shapely.convex_hull(shapely.multipoints(points, indices=owners)), dtype=object)
