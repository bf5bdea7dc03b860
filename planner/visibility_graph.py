"""Build visibility graphs and find the shortest paths in them.

A shortest path around polygons bends only at reflex vertices of the free space, where it is a tangent to an
obstacle. The graph therefore contains only tangents (de Berg et al., Computational Geometry, chapter 15).
"""

from dataclasses import dataclass
from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from shapely.geometry.polygon import orient

from mjsim.support.kernels import kernel
from planner.grid import SegmentGrid, is_visible
from planner.navmesh import TOLERANCE, NavMesh

SLACK = 1e-9  # upper bound on rounding errors of path lengths, in metres
REPEATED = 1e-9  # distance below which two corners of a path are merged, in metres


class Edges(NamedTuple):
    """A graph of points in the plane, in compressed sparse row format."""

    vertices: NDArray[np.float64]  # positions in metres in the first two columns
    starts: NDArray[np.int32]  # index of each vertex's first edge, shape (v + 1,)
    ends: NDArray[np.int32]  # vertex at the end of each edge, shape (e,)
    lengths: NDArray[np.float64]  # length of each edge in metres, shape (e,)


class Views(NamedTuple):
    """The vertices that are visible from each of m points, in compressed sparse row format."""

    starts: NDArray[np.int32]  # index of each point's first entry in the other arrays, shape (m + 1,)
    seen: NDArray[np.int32]  # visible vertices, grouped by point, shape (k,)
    lengths: NDArray[np.float64]  # distance from the point to each visible vertex in metres, shape (k,)


class Paths(NamedTuple):
    """The shortest known distance to each vertex in metres, and the previous vertex or -1, shape (v,)."""

    over: NDArray[np.float64]
    before: NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class VisibilityGraph:
    """The visibility graph of a navmesh."""

    # x and y of each reflex vertex, and of its two neighbours on the ring, in metres, shape (v, 6)
    vertices: NDArray[np.float64]
    island: NDArray[np.int64]  # island of each vertex, shape (v,)
    walls: SegmentGrid  # edges of the obstacles
    edges: Edges  # edges between vertices that are visible from each other

    @classmethod
    def build(cls, navmesh: NavMesh) -> "VisibilityGraph":
        found = [_reflex_vertices(island) for island in navmesh.islands]
        vertices = np.concatenate([np.empty((0, 6)), *found])
        island = np.repeat(np.arange(len(found)), [len(f) for f in found])
        walls = SegmentGrid.build(navmesh.frame, _edges(navmesh.solid))
        rows, columns = vertex_pairs(vertices, island, walls, TOLERANCE)
        weights = np.hypot(*(vertices[rows, :2] - vertices[columns, :2]).T)
        count = len(vertices)
        graph = csr_array(
            (np.r_[weights, weights], (np.r_[rows, columns], np.r_[columns, rows])), shape=(count, count)
        )
        return cls(
            vertices=vertices,
            island=island.astype(np.int64),
            walls=walls,
            edges=Edges(vertices, graph.indptr.astype(np.int32), graph.indices.astype(np.int32), graph.data),
        )


def _rings(geometry: shapely.Geometry) -> list[NDArray[np.float64]]:
    rings = []
    for polygon in map(orient, shapely.get_parts(geometry)):
        for ring in (polygon.exterior, *polygon.interiors):
            rings.append(np.asarray(ring.coords, dtype=np.float64)[:-1])
    return rings


def _reflex_vertices(island: shapely.Geometry) -> NDArray[np.float64]:
    found = [np.empty((0, 6))]
    for ring in _rings(island):
        before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
        a, b = ring - before, after - ring
        turn = (a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]) / (np.hypot(*a.T) * np.hypot(*b.T))
        found.append(np.hstack([ring, before, after])[turn < -1e-9])
    return np.concatenate(found)


def _edges(geometry: shapely.Geometry) -> NDArray[np.float64]:
    edges = [np.hstack([ring, np.roll(ring, -1, axis=0)]) for ring in _rings(geometry)]
    return np.ascontiguousarray(np.concatenate([np.empty((0, 4)), *edges]))


@kernel
def is_tangent(x: float, y: float, vertex: NDArray[np.float64], slack: float) -> bool:
    ux, uy = vertex[0] - x, vertex[1] - y
    before = ux * (vertex[3] - vertex[1]) - uy * (vertex[2] - vertex[0])
    after = ux * (vertex[5] - vertex[1]) - uy * (vertex[4] - vertex[0])
    margin = slack * np.sqrt(ux * ux + uy * uy)
    left = bool(before >= -margin and after >= -margin)
    return left or bool(before <= margin and after <= margin)


@kernel
def vertex_pairs(
    vertices: NDArray[np.float64], island: NDArray[np.int64], walls: SegmentGrid, slack: float
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return the indices i < j of vertices that are connected by an unobstructed line, tangent at both ends.

    `vertices` and `island` are those of `VisibilityGraph`. `slack` is the tolerance of the tangent test in metres.
    """
    rows, columns = [0], [0]
    for i in range(vertices.shape[0]):
        for j in range(i + 1, vertices.shape[0]):
            if island[i] != island[j]:
                continue
            p, q = vertices[i], vertices[j]
            if not (is_tangent(p[0], p[1], q, slack) and is_tangent(q[0], q[1], p, slack)):
                continue
            if is_visible(p[0], p[1], q[0], q[1], walls):
                rows.append(i)
                columns.append(j)
    return np.array(rows[1:]), np.array(columns[1:])


@kernel
def visible_vertices(
    x: float,
    y: float,
    vertices: NDArray[np.float64],
    usable: NDArray[np.bool_],
    walls: SegmentGrid,
    slack: float,
) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
    """Return the usable vertices visible from a point along tangents, and their distances in metres."""
    found, lengths = [0], [0.0]
    for j in range(vertices.shape[0]):
        q = vertices[j]
        if usable[j] and is_tangent(x, y, q, slack) and is_visible(x, y, q[0], q[1], walls):
            found.append(j)
            lengths.append(np.hypot(q[0] - x, q[1] - y))
    return np.array(found[1:]).astype(np.int32), np.array(lengths[1:])


@kernel
def direct_distances(
    a: NDArray[np.float64], b: NDArray[np.float64], walls: SegmentGrid
) -> NDArray[np.float64]:
    """Return the straight-line distances from points `a` to points `b`, infinite if blocked, shape (s, t)."""
    result = np.full((a.shape[0], b.shape[0]), np.inf)
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            if is_visible(a[i, 0], a[i, 1], b[j, 0], b[j, 1], walls):
                result[i, j] = np.hypot(b[j, 0] - a[i, 0], b[j, 1] - a[i, 1])
    return result


@kernel
def search_from(
    graph: Edges, views: Views, point: int, goal: NDArray[np.float64], rest: NDArray[np.float64]
) -> tuple[Paths, int]:
    """Find the shortest paths from a point with the A* algorithm (Hart, Nilsson and Raphael 1968).

    Among equally short paths, it selects the same one as Dijkstra's algorithm. `point` is the index of the
    start in `views`. `goal` has shape (2,), or is empty to find the paths to all vertices. `rest` is the
    straight-line distance from each vertex to the goal in metres, infinite if the goal is not visible, shape
    (v,). Return the paths, and the last vertex of the shortest path to the goal, or -1 if there is none.
    """
    size = len(graph.vertices)
    paths = Paths(np.full(size, np.inf), np.full(size, np.int32(-1), np.int32))
    last, best = -1, np.inf
    heap: list[tuple[float, Any]] = [(np.inf, np.int32(-1))]  # (key, vertex); the sentinel is always last
    for k in range(views.starts[point], views.starts[point + 1]):
        vertex = views.seen[k]
        paths.over[vertex] = views.lengths[k]
        heappush(heap, (views.lengths[k] + at_least(graph, vertex, goal), vertex))
    while heap[0][1] >= 0 and heap[0][0] <= best + SLACK:
        key, vertex = heappop(heap)
        length = paths.over[vertex]
        if key > length + at_least(graph, vertex, goal):
            continue  # the vertex was pushed again with a shorter path
        total = length + rest[vertex]
        if total < best or (total == best and vertex < last):
            best, last = total, vertex
        for edge in range(graph.starts[vertex], graph.starts[vertex + 1]):
            end, total = graph.ends[edge], length + graph.lengths[edge]
            if total < paths.over[end]:
                paths.over[end], paths.before[end] = total, vertex
                heappush(heap, (total + at_least(graph, end, goal), end))
            elif total == paths.over[end] and length < earlier(paths, end):
                paths.before[end] = vertex
    return paths, last


@kernel
def earlier(paths: Paths, vertex: int) -> float:
    before = paths.before[vertex]
    return float(paths.over[before]) if before >= 0 else 0.0


@kernel
def at_least(graph: Edges, vertex: int, goal: NDArray[np.float64]) -> float:
    if goal.size == 0:
        return 0.0
    return float(np.hypot(graph.vertices[vertex, 0] - goal[0], graph.vertices[vertex, 1] - goal[1]))


@kernel
def shortest_path(graph: Edges, ends: NDArray[np.float64], views: Views) -> tuple[float, NDArray[np.float64]]:
    """Return the length and the points of the shortest path via vertices between two points, in metres.

    `ends` has shape (2, 2), and `views` contains the views of both ends. The length is infinite if there is no path.
    """
    rest = np.full(len(graph.vertices), np.inf)
    for k in range(views.starts[1], views.starts[2]):
        rest[views.seen[k]] = views.lengths[k]
    paths, vertex = search_from(graph, views, 0, ends[1], rest)
    if vertex < 0:
        return np.inf, ends
    length, corners = paths.over[vertex] + rest[vertex], [vertex]
    while paths.before[vertex] >= 0:
        vertex = paths.before[vertex]
        corners.append(vertex)
    points = np.empty((len(corners) + 2, 2))
    points[0], kept = ends[0], 1
    for vertex in corners[::-1]:
        corner = graph.vertices[vertex, :2]
        if np.hypot(corner[0] - points[kept - 1, 0], corner[1] - points[kept - 1, 1]) > REPEATED:
            points[kept] = corner
            kept += 1
    points[kept] = ends[1]
    return length, points[: kept + 1].copy()


@kernel
def distances(graph: Edges, sources: Views, targets: Views) -> NDArray[np.float64]:
    """Return the lengths of shortest paths via vertices in metres, infinite without a path, shape (s, t)."""
    count, points = len(sources.starts) - 1, len(targets.starts) - 1
    result = np.full((count, points), np.inf)
    nowhere, rest = np.empty(0), np.full(len(graph.vertices), np.inf)
    for s in range(count):
        paths, _ = search_from(graph, sources, s, nowhere, rest)
        for t in range(points):
            for k in range(targets.starts[t], targets.starts[t + 1]):
                result[s, t] = min(result[s, t], paths.over[targets.seen[k]] + targets.lengths[k])
    return result
