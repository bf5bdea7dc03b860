"""Shortest paths along the edges of a visibility graph, between points that see some of its vertices."""

from heapq import heappop, heappush
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

SLACK = 1e-9  # m, for the rounding of lengths
REPEATED = 1e-9  # m between corners that count as one


class Edges(NamedTuple):
    """A graph on a plane, as in a `csr_array`."""

    vertices: NDArray[np.float64]  # x and y of each vertex, m, then anything, (v, 2 or more)
    starts: NDArray[np.int32]  # first edge of each vertex, (v + 1,)
    ends: NDArray[np.int32]  # vertex that each edge leads to, (e,)
    lengths: NDArray[np.float64]  # of the edges, m, (e,)


class Views(NamedTuple):
    """The vertices that some points see."""

    starts: NDArray[np.int32]  # first entry of each of m points in the other two, (m + 1,)
    seen: NDArray[np.int32]  # vertices, those of one point after those of another, (k,)
    lengths: NDArray[np.float64]  # distances to them, m, (k,)


class Paths(NamedTuple):
    """The shortest known path to each vertex: its length, m, (v,), and the vertex before, -1 for none, (v,)."""

    over: NDArray[np.float64]
    before: NDArray[np.int32]


@kernel
def search_from(
    graph: Edges, views: Views, point: int, goal: NDArray[np.float64], rest: NDArray[np.float64]
) -> tuple[Paths, int]:
    """Find shortest paths from a point, nearest to the goal first (A*; Hart, Nilsson and Raphael 1968).

    Of equally short paths it finds the one of Dijkstra's algorithm: with the earlier last corners. `point` is a
    number in `views`; `goal` is where a path shall lead, m, (2,), empty to find the paths to all vertices; `rest` is
    the last leg to it from each vertex, infinite where it is not seen, m, (v,). Returns the paths, and the last
    vertex of the shortest path to the goal, -1 without one.
    """
    size = len(graph.vertices)
    paths = Paths(np.full(size, np.inf), np.full(size, np.int32(-1), np.int32))
    last, best = -1, np.inf
    heap: list[tuple[float, Any]] = [(np.inf, np.int32(-1))]  # key, vertex; this one stays last
    for k in range(views.starts[point], views.starts[point + 1]):
        vertex = views.seen[k]
        paths.over[vertex] = views.lengths[k]
        heappush(heap, (views.lengths[k] + at_least(graph, vertex, goal), vertex))
    while heap[0][1] >= 0 and heap[0][0] <= best + SLACK:
        key, vertex = heappop(heap)
        length = paths.over[vertex]
        if key > length + at_least(graph, vertex, goal):
            continue  # it was pushed again, with a shorter path
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
    """Length of the path to the vertex before a vertex, m; 0 where that is the start."""
    before = paths.before[vertex]
    return float(paths.over[before]) if before >= 0 else 0.0


@kernel
def at_least(graph: Edges, vertex: int, goal: NDArray[np.float64]) -> float:
    """Least possible distance from a vertex to the goal (2,), m; 0 without a goal."""
    if goal.size == 0:
        return 0.0
    return float(np.hypot(graph.vertices[vertex, 0] - goal[0], graph.vertices[vertex, 1] - goal[1]))


@kernel
def shortest_path(graph: Edges, ends: NDArray[np.float64], views: Views) -> tuple[float, NDArray[np.float64]]:
    """The shortest path between two points (2, 2), m, over vertices, by the views of both.

    Returns its length, m, infinite without a path, and its points, m, (k, 2).
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
    """Distances over vertices from points to points, infinite without a path, (s, t), m."""
    count, points = len(sources.starts) - 1, len(targets.starts) - 1
    result = np.full((count, points), np.inf)
    nowhere, rest = np.empty(0), np.full(len(graph.vertices), np.inf)
    for s in range(count):
        paths, _ = search_from(graph, sources, s, nowhere, rest)
        for t in range(points):
            for k in range(targets.starts[t], targets.starts[t + 1]):
                result[s, t] = min(result[s, t], paths.over[targets.seen[k]] + targets.lengths[k])
    return result
