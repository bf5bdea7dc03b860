"""Find exact any-angle shortest paths on a navmesh.

Paths cut into inflated obstacles by at most 0.1 mm (`navmesh.TOLERANCE`). Shortest paths on a grid would be
several per cent longer.
"""

from dataclasses import dataclass, field

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from planner.errors import UnreachableError
from planner.navmesh import TOLERANCE, NavMesh
from planner.visibility_graph import VisibilityGraph, VisibleVertices, direct_distances, visible_vertices

MAX_CACHED = 4096  # maximum number of points for which visible vertices are cached


@dataclass(frozen=True, eq=False)
class ShortestPath:
    """A shortest path and its length."""

    # Points of the path in metres, including both (possibly snapped) ends, shape (k, 2) with k >= 2
    points: NDArray[np.float64]
    geodesic_distance: float  # length of the path in metres


@dataclass(frozen=True, eq=False)
class _Query:
    points: NDArray[np.float64]
    island: NDArray[np.int64]
    views: list[VisibleVertices]


@dataclass(frozen=True, eq=False)
class Geodesics:
    """Shortest paths and distances between points of a navmesh, in metres.

    A point that is not navigable is replaced by the nearest point of the largest island (`NavMesh.snap`).
    Path lengths do not include the distance between the two. A navigable point on a smaller island is not
    replaced. All methods raise NotNavigableError if no navigable point is within `max_snap` of a point, and
    UnreachableError if two points are on different islands.

    Example:
        >>> wall = np.array([[2.0, 0.0], [2.2, 0.0], [2.2, 3.0], [2.0, 3.0]])
        >>> floor = Geodesics(NavMesh.build([wall], (0.0, 0.0, 4.0, 4.0)))
        >>> around = floor.distances(np.array([[1.0, 1.0], [3.0, 1.0]]))[0, 1]
        >>> bool(around > 2.0)
        True
    """

    navmesh: NavMesh
    max_snap: float = 1.0  # maximum distance from a point to the nearest navigable point, in metres
    _graph: VisibilityGraph = field(init=False, repr=False)
    _remembered: dict[tuple[float, float], VisibleVertices] = field(
        init=False, repr=False, default_factory=dict
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "_graph", VisibilityGraph.build(self.navmesh))

    def shortest_path(self, a: ArrayLike, b: ArrayLike) -> ShortestPath:
        """Return the shortest path between two points (x, y) in metres."""
        points, islands = self._locate([np.asarray(a, np.float64), np.asarray(b, np.float64)])
        straight = float(direct_distances(points[:1], points[1:], self._graph.walls)[0, 0])
        if np.isfinite(straight) and islands[0] == islands[1]:
            return ShortestPath(points, straight)
        query = self._query(points, islands)
        length, path = self._graph.shortest_path(points, *query.views)
        if not np.isfinite(length):
            raise _unreachable(points[0], points[1])
        return ShortestPath(path, length)

    def distances(self, points: ArrayLike) -> NDArray[np.float64]:
        """Return the geodesic distances between points (n, 2) in metres, as a symmetric matrix (n, n)."""
        query = self._query(*self._locate(points))
        result = self._between(query, query)
        result = np.minimum(result, result.T)
        np.fill_diagonal(result, 0.0)
        return result

    def distances_between(self, sources: ArrayLike, targets: ArrayLike) -> NDArray[np.float64]:
        """Return the geodesic distances from points (s, 2) to points (t, 2) in metres, shape (s, t)."""
        source, target = (self._query(*self._locate(points)) for points in (sources, targets))
        return self._between(source, target)

    def _locate(self, points: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        array = np.array(points, dtype=np.float64).reshape(-1, 2)
        islands = np.maximum(self.navmesh.islands_at(array), 0).astype(np.int64)
        # A point that is on an island only within the tolerance may be inside an obstacle, so it is snapped.
        island = np.array(self.navmesh.islands)[islands]
        inside = shapely.intersects_xy(island, array[:, 0], array[:, 1])
        for k in np.flatnonzero(~inside).tolist():
            array[k] = self.navmesh.snap(array[k], self.max_snap, int(islands[k]))
        return array, islands

    def _query(self, points: NDArray[np.float64], islands: NDArray[np.int64]) -> _Query:
        views = [self._view(x, y, i) for (x, y), i in zip(points.tolist(), islands.tolist(), strict=True)]
        return _Query(points, islands, views)

    def _view(self, x: float, y: float, island: int) -> VisibleVertices:
        view = self._remembered.get((x, y))
        if view is None:
            if len(self._remembered) >= MAX_CACHED:
                self._remembered.clear()
            graph = self._graph
            usable = graph.island == island
            view = VisibleVertices(
                *visible_vertices(np.array((x, y) * 3), graph.vertices, usable, graph.walls, TOLERANCE)
            )
            self._remembered[x, y] = view  # another thread may clear the cache, so do not read it again
        return view

    def _between(self, sources: _Query, targets: _Query) -> NDArray[np.float64]:
        graph = self._graph
        apart = sources.island[:, None] != targets.island[None, :]
        if apart.any():
            i, j = np.argwhere(apart)[0]
            raise _unreachable(sources.points[i], targets.points[j])
        bent = graph.distances(sources.views, targets.views)
        result = np.minimum(bent, direct_distances(sources.points, targets.points, graph.walls))
        lost = np.argwhere(~np.isfinite(result))
        if lost.size:
            raise _unreachable(sources.points[lost[0][0]], targets.points[lost[0][1]])
        return result


def _unreachable(a: NDArray[np.float64], b: NDArray[np.float64]) -> UnreachableError:
    return UnreachableError(
        f"no path from ({a[0]:.3f}, {a[1]:.3f}) to ({b[0]:.3f}, {b[1]:.3f}): they are on different islands "
        "of the navmesh; move one, or build the navmesh with a smaller agent_radius"
    )
