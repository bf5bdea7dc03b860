"""Visibility graph over the reflex vertices of free space: the exact part of a shortest-path search.

A shortest path among polygons bends only at reflex vertices of free space and is tangent to the obstacle at
each, so only tangent sight lines are edges (de Berg et al., Computational Geometry, chapter 15).
"""

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from scipy.sparse import csr_array
from shapely.geometry.polygon import orient

from mjsim.support.kernels import kernel
from planner.grid import SegmentGrid, is_visible
from planner.navmesh import TOLERANCE, NavMesh
from planner.path_search import Edges


@dataclass(frozen=True, eq=False)
class VisibilityGraph:
    """Static part of the shortest-path search; built once per navmesh."""

    vertices: NDArray[
        np.float64
    ]  # reflex vertices, (v, 6): x, y, then the ring's previous and next vertex, m
    island: NDArray[np.int64]  # island of each vertex, (v,) int64
    walls: SegmentGrid  # edges of the solid obstacles
    edges: Edges  # which vertices see each other

    @classmethod
    def build(cls, navmesh: NavMesh) -> "VisibilityGraph":
        """Find the reflex vertices of a navmesh and which of them see each other."""
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
    """Rings of all polygons without the repeated last vertex; the polygon lies to the left of each."""
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
    """Whether a line from (x, y) passes a vertex, (6,), with both of its neighbours on one side; all m."""
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
    """Pairs i < j of vertices (v, 6) that see each other along a line tangent at both; i and j, each (pairs,).

    `island` is that of each vertex, (v,), `walls` the edges of the solid obstacles, `slack` the tolerance, m.
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
    """Usable (v,) vertices (v, 6) that a point sees along tangents, and distances to them, m, each (seen,)."""
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
    """Straight distances from points a (s, 2) to points b (t, 2), infinite where a wall is between, (s, t); all m."""
    result = np.full((a.shape[0], b.shape[0]), np.inf)
    for i in range(a.shape[0]):
        for j in range(b.shape[0]):
            if is_visible(a[i, 0], a[i, 1], b[j, 0], b[j, 1], walls):
                result[i, j] = np.hypot(b[j, 0] - a[i, 0], b[j, 1] - a[i, 1])
    return result
