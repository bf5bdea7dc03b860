"""Shortest paths along the edges of a visibility graph, between points that see some of its vertices."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel

SLACK = 1e-9  # m, for the rounding of lengths
REPEATED = 1e-9  # m between corners that count as one


class Edges(NamedTuple):
    """A graph on a plane, as in a `csr_array`.

    Attributes:
        vertices: x and y of each vertex, m, then anything, (v, 2 or more).
        starts: First edge of each vertex, (v + 1,).
        ends: Vertex that each edge leads to, (e,).
        lengths: Of the edges, m, (e,).
    """

    vertices: NDArray[np.float64]
    starts: NDArray[np.int32]
    ends: NDArray[np.int32]
    lengths: NDArray[np.float64]


class Views(NamedTuple):
    """The vertices that some points see.

    Attributes:
        starts: First entry of each of m points in the other two, (m + 1,).
        seen: Vertices, those of one point after those of another, (k,).
        lengths: Distances to them, m, (k,).
    """

    starts: NDArray[np.int32]
    seen: NDArray[np.int32]
    lengths: NDArray[np.float64]


class Search(NamedTuple):
    """What a search finds out; a heap of vertices by key, and what is known of each vertex.

    Attributes:
        keys: Of the heap's entries, m, (room,).
        entries: Vertices of the heap, (room,).
        over: Length of the shortest known path to each vertex, m, (v,).
        before: Vertex before each on that path, -1 for none, (v,).
    """

    keys: NDArray[np.float64]
    entries: NDArray[np.int32]
    over: NDArray[np.float64]
    before: NDArray[np.int32]


@kernel
def new_search(graph: Edges) -> Search:
    """Room for a search: a vertex is pushed once for each edge to it at most, and once as seen."""
    size = len(graph.vertices)
    room = len(graph.ends) + size
    return Search(
        np.empty(room), np.empty(room, np.int32), np.full(size, np.inf), np.full(size, np.int32(-1), np.int32)
    )


@kernel
def push(search: Search, size: int, key: float, vertex: int) -> None:
    """Put a vertex on a heap of `size` entries."""
    k = size
    while k > 0:
        parent = (k - 1) >> 1
        if search.keys[parent] <= key:
            break
        search.keys[k], search.entries[k] = search.keys[parent], search.entries[parent]
        k = parent
    search.keys[k], search.entries[k] = key, vertex


@kernel
def pop(search: Search, size: int) -> None:
    """Remove the first entry of a heap, which has `size` entries afterwards."""
    key, vertex = search.keys[size], search.entries[size]
    k = 0
    while True:
        child = 2 * k + 1
        if child >= size:
            break
        if child + 1 < size and search.keys[child + 1] < search.keys[child]:
            child += 1
        if search.keys[child] >= key:
            break
        search.keys[k], search.entries[k] = search.keys[child], search.entries[child]
        k = child
    search.keys[k], search.entries[k] = key, vertex


@kernel
def search_from(
    graph: Edges,
    views: Views,
    point: int,
    search: Search,
    goal: NDArray[np.float64],
    rest: NDArray[np.float64],
) -> int:
    """Find shortest paths from a point, nearest to the goal first (A*; Hart, Nilsson and Raphael 1968).

    Of equally short paths it finds the one of Dijkstra's algorithm: with the earlier last corners.

    Args:
        graph: The graph.
        views: Of the point, among others.
        point: Its number there.
        search: Takes the paths.
        goal: Where a path shall lead, m, (2,); empty to find the paths to all vertices.
        rest: Length of the last leg to the goal from each vertex, infinite where it is not seen, m, (v,).

    Returns:
        The last vertex of the shortest path to the goal; -1 without one.
    """
    search.over[:], search.before[:] = np.inf, -1
    size, last, best = 0, -1, np.inf
    for k in range(views.starts[point], views.starts[point + 1]):
        vertex = views.seen[k]
        search.over[vertex] = views.lengths[k]
        push(search, size, views.lengths[k] + at_least(graph, vertex, goal), vertex)
        size += 1
    while size > 0 and search.keys[0] <= best + SLACK:
        key, vertex = search.keys[0], search.entries[0]
        size -= 1
        pop(search, size)
        length = search.over[vertex]
        if key > length + at_least(graph, vertex, goal):
            continue  # it was pushed again, with a shorter path
        total = length + rest[vertex]
        if total < best or (total == best and vertex < last):
            best, last = total, vertex
        for edge in range(graph.starts[vertex], graph.starts[vertex + 1]):
            end, total = graph.ends[edge], length + graph.lengths[edge]
            if total < search.over[end]:
                search.over[end], search.before[end] = total, vertex
                push(search, size, total + at_least(graph, end, goal), end)
                size += 1
            elif total == search.over[end] and length < earlier(search, end):
                search.before[end] = vertex
    return last


@kernel
def earlier(search: Search, vertex: int) -> float:
    """Length of the path to the vertex before a vertex, m; 0 where that is the start."""
    before = search.before[vertex]
    return float(search.over[before]) if before >= 0 else 0.0


@kernel
def at_least(graph: Edges, vertex: int, goal: NDArray[np.float64]) -> float:
    """Least possible distance from a vertex to the goal (2,), m; 0 without a goal."""
    if goal.size == 0:
        return 0.0
    return float(np.hypot(graph.vertices[vertex, 0] - goal[0], graph.vertices[vertex, 1] - goal[1]))


@kernel
def shortest_path(graph: Edges, ends: NDArray[np.float64], views: Views) -> tuple[float, NDArray[np.float64]]:
    """The shortest path between two points over vertices.

    Args:
        graph: The graph.
        ends: Both points, m, (2, 2).
        views: Of both.

    Returns:
        Its length, m, infinite without a path, and its points, m, (k, 2).
    """
    search, rest = new_search(graph), np.full(len(graph.vertices), np.inf)
    for k in range(views.starts[1], views.starts[2]):
        rest[views.seen[k]] = views.lengths[k]
    vertex = search_from(graph, views, 0, search, ends[1], rest)
    if vertex < 0:
        return np.inf, ends
    length, corners = search.over[vertex] + rest[vertex], 0
    while vertex >= 0:  # back from the end; the heap is not needed any more
        search.entries[corners] = vertex
        corners, vertex = corners + 1, search.before[vertex]
    points = np.empty((corners + 2, 2))
    points[0], kept = ends[0], 1
    for k in range(corners - 1, -1, -1):
        corner = graph.vertices[search.entries[k], :2]
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
    search, nowhere, rest = new_search(graph), np.empty(0), np.full(len(graph.vertices), np.inf)
    for s in range(count):
        search_from(graph, sources, s, search, nowhere, rest)
        for t in range(points):
            for k in range(targets.starts[t], targets.starts[t + 1]):
                result[s, t] = min(result[s, t], search.over[targets.seen[k]] + targets.lengths[k])
    return result
