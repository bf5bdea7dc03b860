"""Build visibility graphs and find the shortest paths in them.

A shortest path around polygons bends only at reflex vertices of the free space, where it is a tangent to an
obstacle. The graph therefore contains only tangents (de Berg et al., Computational Geometry, chapter 15).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra
from shapely.geometry.polygon import orient

from mjsim.support.kernels import kernel
from planner.navmesh import TOLERANCE, NavMesh, edges

REPEATED = 1e-9  # distance below which two corners of a path are merged, in metres


class VisibleVertices(NamedTuple):
    """The vertices that are visible from a point."""

    seen: NDArray[np.int32]  # indices of the vertices, in ascending order, shape (k,)
    lengths: NDArray[np.float64]  # distance from the point to each of them in metres, shape (k,)


@dataclass(frozen=True, eq=False)
class VisibilityGraph:
    """The visibility graph of a navmesh."""

    # x and y of each reflex vertex, and of its two neighbours on the ring, in metres, shape (v, 6)
    vertices: NDArray[np.float64]
    island: NDArray[np.int64]  # island of each vertex, shape (v,)
    walls: NDArray[np.float64]  # edges of the obstacles, as x and y of both ends in metres, shape (e, 4)
    edges: csr_array  # distances between vertices that are visible from each other in metres, shape (v, v)

    @classmethod
    def build(cls, navmesh: NavMesh) -> "VisibilityGraph":
        found = [_reflex_vertices(island) for island in navmesh.islands]
        vertices = np.concatenate([np.empty((0, 6)), *found])
        island = np.repeat(np.arange(len(found)), [len(f) for f in found])
        walls = edges(shapely.get_parts(navmesh.solid))
        views = []
        for i, vertex in enumerate(vertices):
            later = island == island[i]
            later[: i + 1] = False
            views.append(VisibleVertices(*visible_vertices(vertex, vertices, later, walls, TOLERANCE)))
        seen = _with_rows(csr_array((0, len(vertices))), views)
        return cls(vertices, island.astype(np.int64), walls, edges=csr_array(seen + seen.T))

    def distances(
        self, sources: Sequence[VisibleVertices], targets: Sequence[VisibleVertices]
    ) -> NDArray[np.float64]:
        """Return the lengths of shortest paths via vertices in metres, infinite without a path, shape (s, t)."""
        over, _ = self._paths(sources)
        found = [(over[:, seen] + lengths).min(axis=1, initial=np.inf) for seen, lengths in targets]
        return np.array(found).reshape(len(targets), len(sources)).T

    def shortest_path(
        self, ends: NDArray[np.float64], start: VisibleVertices, goal: VisibleVertices
    ) -> tuple[float, NDArray[np.float64]]:
        """Return the length and the points of the shortest path via vertices between two points, in metres.

        `ends` has shape (2, 2), and both views are given. The length is infinite if there is no path.
        """
        (over,), (before,) = self._paths([start])
        totals = over[goal.seen] + goal.lengths
        if not totals.min(initial=np.inf) < np.inf:
            return np.inf, ends
        last = int(np.argmin(totals))
        corners, vertex = [], int(goal.seen[last])
        while vertex < len(self.vertices):  # the start is numbered after the vertices
            corners.append(self.vertices[vertex, :2])
            vertex = int(before[vertex])
        points = [ends[0]]
        for corner in corners[::-1]:
            if np.hypot(*(corner - points[-1])) > REPEATED:
                points.append(corner)
        return float(totals[last]), np.array([*points, ends[1]])

    def _paths(self, views: Sequence[VisibleVertices]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """Return the length of the shortest path from each point to each vertex, and the vertices before the last one.

        The points are nodes without entering edges, numbered after the vertices.
        """
        graph = _with_rows(self.edges, views)
        starts = np.arange(len(self.vertices), graph.shape[0])
        over, before = dijkstra(graph, indices=starts, return_predecessors=True)
        return over, before


def _with_rows(edges: csr_array, views: Sequence[VisibleVertices]) -> csr_array:
    """Append a node with the edges to the visible vertices of each point."""
    starts = edges.indptr[-1] + np.cumsum([len(view.seen) for view in views], dtype=np.int32)
    parts = (
        [edges.data, *(view.lengths for view in views)],
        [edges.indices, *(view.seen for view in views)],
        [edges.indptr, starts],
    )
    size = len(edges.indptr) - 1 + len(views)
    return csr_array(tuple(map(np.concatenate, parts)), shape=(size, size))


def _reflex_vertices(island: shapely.Polygon) -> NDArray[np.float64]:
    found = [np.empty((0, 6))]
    for closed_ring in shapely.get_rings(orient(island)):
        ring = shapely.get_coordinates(closed_ring)[:-1]
        before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
        a, b = ring - before, after - ring
        turn = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / (np.hypot(*a.T) * np.hypot(*b.T))
        found.append(np.hstack([ring, before, after])[turn < -1e-9])
    return np.concatenate(found)


@kernel
def is_visible(ax: float, ay: float, bx: float, by: float, walls: NDArray[np.float64]) -> bool:
    """Return True if the line from a to b does not touch a wall."""
    for k in range(walls.shape[0]):  # noqa: SIM110 - numba compiles no generators
        if touch(ax, ay, bx, by, walls[k]):
            return False
    return True


@kernel
def touch(ax: float, ay: float, bx: float, by: float, wall: NDArray[np.float64]) -> bool:
    """Return True if the line segment from a to b touches a wall, end points included."""
    cx, cy, dx, dy = wall[0], wall[1], wall[2], wall[3]
    if max(cx, dx) < min(ax, bx) or min(cx, dx) > max(ax, bx):
        return False
    if max(cy, dy) < min(ay, by) or min(cy, dy) > max(ay, by):
        return False
    side_c = (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)
    side_d = (bx - ax) * (dy - ay) - (by - ay) * (dx - ax)
    if (side_c > 0.0 and side_d > 0.0) or (side_c < 0.0 and side_d < 0.0):
        return False
    side_a = (dx - cx) * (ay - cy) - (dy - cy) * (ax - cx)
    side_b = (dx - cx) * (by - cy) - (dy - cy) * (bx - cx)
    return not ((side_a > 0.0 and side_b > 0.0) or (side_a < 0.0 and side_b < 0.0))


@kernel
def is_tangent(x: float, y: float, vertex: NDArray[np.float64], slack: float) -> bool:
    ux, uy = vertex[0] - x, vertex[1] - y
    before = ux * (vertex[3] - vertex[1]) - uy * (vertex[2] - vertex[0])
    after = ux * (vertex[5] - vertex[1]) - uy * (vertex[4] - vertex[0])
    margin = slack * np.sqrt(ux * ux + uy * uy)
    left = bool(before >= -margin and after >= -margin)
    return left or bool(before <= margin and after <= margin)


@kernel
def visible_vertices(
    corner: NDArray[np.float64],
    vertices: NDArray[np.float64],
    usable: NDArray[np.bool_],
    walls: NDArray[np.float64],
    slack: float,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the usable vertices that are visible along tangents, and their distances in metres.

    `corner` is a row of `vertices`. A point without neighbours has three times the same x and y.
    """
    x, y = corner[0], corner[1]
    found, lengths = [0], [0.0]
    for j in range(vertices.shape[0]):
        q = vertices[j]
        if not usable[j] or not is_tangent(x, y, q, slack) or not is_tangent(q[0], q[1], corner, slack):
            continue
        if is_visible(x, y, q[0], q[1], walls):
            found.append(j)
            lengths.append(np.hypot(q[0] - x, q[1] - y))
    return np.array(found[1:]).astype(np.int32), np.array(lengths[1:])


@kernel
def direct_distances(
    a: NDArray[np.float64], b: NDArray[np.float64], walls: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the straight-line distances from points `a` to points `b`, infinite if blocked, shape (s, t)."""
    result = np.full((a.shape[0], b.shape[0]), np.inf)
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            if is_visible(a[i, 0], a[i, 1], b[j, 0], b[j, 1], walls):
                result[i, j] = np.hypot(b[j, 0] - a[i, 0], b[j, 1] - a[i, 1])
    return result
