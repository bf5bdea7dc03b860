"""Decompose an object into a few convex collision parts that are thick enough for the physics."""

from dataclasses import dataclass

import coacd
import numpy as np
import scipy.spatial
import trimesh

from mjsim.formats.scene.surface import Floats
from mjsim.house.validation.object_rules import THIN
from mjsim.importing.object.closed_body import ClosedBody, simplified

MAX_PARTS = 6
MAX_VERTICES = 64  # maximum number of vertices of a collision part
MIN_WIDTH = THIN  # minimum width of a collision part in any direction, in metres
_WALL = 0.008  # mean wall thickness below which an object collides as its convex hull, in metres
_CONVEX = 0.9  # share of its convex hull that a body must fill to count as convex
_TRIANGLES = 1000  # maximum number of triangles of a body before decomposition
_CONCAVITY = 0.12  # default concavity threshold of CoACD
_COARSE = 0.35  # concavity threshold for complex bodies, whose decomposition is slow
_MANY = 8  # number of pieces above which a body counts as complex
_CUT = 1e-6  # tolerance for the intersection of an edge and a triangle, relative to their sides


@dataclass(frozen=True, eq=False)
class Parts:
    """The convex collision parts of an object."""

    hulls: tuple[Floats, ...]  # vertices of each collision part in metres, shape (k, 3) each
    reason: str  # explanation of how the parts were made, for the report
    thickened: int  # number of parts that were thickened

    @property
    def points(self) -> Floats:
        """The vertices of all parts in metres, shape (k, 3)."""
        return np.concatenate(self.hulls)


def convex_parts(solid: ClosedBody) -> Parts:
    hull = solid.mesh.convex_hull
    hulls, reason = [np.asarray(hull.vertices)], "convex: its own hull"
    filled = solid.mesh.volume / hull.volume
    if filled < _CONVEX:
        # The mean thickness of thin walls is twice their volume, divided by the area of both sides.
        walls = 2 * solid.mesh.volume / solid.mesh.area < _WALL
        pieces = [] if walls else _decomposed(solid)
        if walls or min(narrowest(points)[1] for points in pieces) < _WALL:
            reason = f"hollow or thin: its convex hull, of which it fills {100 * filled:.0f} %"
        else:
            hulls, reason = pieces, "convex parts by CoACD"
    reduced = [_few_vertices(points) for points in hulls]
    thick = [_thickened(points) for points in reduced]
    changed = sum(len(a) != len(b) or not np.array_equal(a, b) for a, b in zip(reduced, thick, strict=True))
    return Parts(tuple(thick), reason, changed)


def _decomposed(solid: ClosedBody) -> list[Floats]:
    """Decompose a body with CoACD (Wei et al., 2022). Return the vertices of each part, largest first."""
    coarse = simplified(solid.mesh, _TRIANGLES)
    coacd.set_log_level("error")
    found = coacd.run_coacd(
        coacd.Mesh(coarse.vertices, coarse.faces),
        threshold=_COARSE if solid.pieces > _MANY or cuts_itself(coarse) else _CONCAVITY,
        max_convex_hull=MAX_PARTS,
        resolution=500,
        mcts_iterations=20,
        mcts_nodes=10,
        mcts_max_depth=2,
        seed=0,
    )
    hulls = [np.asarray(vertices, np.float64) for vertices, _ in found]
    return sorted(hulls, key=lambda points: -scipy.spatial.ConvexHull(points).volume)


def cuts_itself(mesh: trimesh.Trimesh) -> bool:
    """Return True if a surface intersects itself, that is, if an edge intersects a triangle."""
    vertices, edges = np.asarray(mesh.vertices), mesh.edges_unique
    start = vertices[edges[:, 0]]
    along = vertices[edges[:, 1]] - start
    for face in mesh.faces:
        corner, *others = vertices[face]
        one, two = others - corner
        normal = np.cross(one, two)
        with np.errstate(all="ignore"):  # Edges in the plane of the triangle give NaN.
            share = (corner - start) @ normal / (along @ normal)
            there = start + share[:, None] * along - corner
            u, v = (np.cross(there, two) @ normal, np.cross(one, there) @ normal) / (normal @ normal)
            least = np.min((share, 1.0 - share, u, v, 1.0 - u - v), axis=0)
        if np.any((least > _CUT) & ~np.isin(edges, face).any(axis=1)):
            return True
    return False


def _few_vertices(points: Floats) -> Floats:
    """Simplify the hull of points (n, 3) to at most `MAX_VERTICES` vertices. Its bounding box is kept."""
    hull = trimesh.convex.convex_hull(points)
    if len(hull.vertices) <= MAX_VERTICES:
        return np.asarray(hull.vertices)
    for faces in range(2 * MAX_VERTICES - 4, 8, -8):
        coarse = hull.simplify_quadric_decimation(face_count=faces).convex_hull
        if len(coarse.vertices) <= MAX_VERTICES:
            break
    else:  # If no edge can be collapsed, take the farthest vertex in each of many directions.
        turn = np.arange(MAX_VERTICES) + 0.5
        z, angle = 1 - 2 * turn / MAX_VERTICES, np.pi * (1 + 5**0.5) * turn
        level = np.sqrt(1 - z * z)
        directions = np.column_stack((level * np.cos(angle), level * np.sin(angle), z))
        farthest = np.unique((hull.vertices @ directions.T).argmax(axis=0))
        coarse = trimesh.convex.convex_hull(hull.vertices[farthest])
    scale = hull.extents / coarse.extents
    return np.asarray((coarse.vertices - coarse.bounds[0]) * scale + hull.bounds[0])


def _thickened(points: Floats) -> Floats:
    """Thicken the hull of points (n, 3) symmetrically until it is at least `MIN_WIDTH` wide."""
    for _ in range(4):
        direction, across = narrowest(points)
        if across > MIN_WIDTH - 1e-6:
            break
        step = direction * (MIN_WIDTH - across) / 2
        points = _few_vertices(np.concatenate((points - step, points + step)))
    return points


def narrowest(points: Floats) -> tuple[Floats, float]:
    """Return the direction (3,) in which the hull of points (n, 3) is narrowest, and the width there."""
    normals = scipy.spatial.ConvexHull(points).equations[:, :3]
    directions = np.concatenate((np.eye(3), normals))
    widths = np.ptp(points @ directions.T, axis=0)
    best = int(np.flatnonzero(widths <= 1.01 * widths.min())[0])
    return directions[best], float(widths[best])
