"""Primitives for building meshes, such as lathes, tubes and extrusions, and a compact OBJ writer."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.polygon import orient

from mjsim.support.files import write_text_atomically
from mjsim.values.errors import AssetError

Floats = NDArray[np.float64]
CREASE = math.radians(40.0)  # edges with a larger angle between their faces are drawn sharp


@dataclass(frozen=True, eq=False)
class LabelledMesh:
    """A triangle mesh with optional texture coordinates.

    Attributes:
        vertices: Vertex positions in metres, (n, 3).
        faces: Vertex indices, counter-clockwise seen from outside, (m, 3).
        uv: Texture coordinates of each vertex, (n, 2), or None.
    """

    vertices: Floats
    faces: NDArray[np.int64]
    uv: Floats | None = None

    def moved(self, offset: ArrayLike) -> "LabelledMesh":
        """Return the mesh moved by an offset (3,) in metres."""
        return LabelledMesh(self.vertices + np.asarray(offset, dtype=float), self.faces, self.uv)

    def turned(self, angle: float) -> "LabelledMesh":
        c, s = math.cos(angle), math.sin(angle)
        return LabelledMesh(
            self.vertices @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]), self.faces, self.uv
        )

    def lengthwise(self) -> "LabelledMesh":
        """Return the mesh with axes x, y, z mapped to y, z, x, so that an extruded drawing stands upright."""
        return LabelledMesh(self.vertices[:, [2, 0, 1]], self.faces, self.uv)

    def bent(self, rule: Callable[[Floats], Floats]) -> "LabelledMesh":
        """Return the mesh with a function applied to its vertices (n, 3)."""
        return LabelledMesh(rule(self.vertices), self.faces, self.uv)


def mm(points: str) -> Floats:
    """Parse a string of points in mm, such as `x y, x y`. Return an array (n, 2) in metres."""
    return np.array([[float(value) / 1000 for value in point.split()] for point in points.split(",")])


def join(surfaces: Sequence[LabelledMesh]) -> LabelledMesh:
    """Join several meshes into one. It has texture coordinates only if all of them do."""
    offsets = np.cumsum([0, *(len(s.vertices) for s in surfaces[:-1])])
    uvs = [s.uv for s in surfaces if s.uv is not None]
    return LabelledMesh(
        np.vstack([s.vertices for s in surfaces]),
        np.vstack([s.faces + o for s, o in zip(surfaces, offsets, strict=True)]),
        np.vstack(uvs) if len(uvs) == len(surfaces) else None,
    )


def sheet(points: Floats) -> LabelledMesh:
    """Build a surface over a grid of points (rows, columns, 3) that faces in the direction rows x columns."""
    rows, columns = points.shape[:2]
    index = np.arange(rows * columns).reshape(rows, columns)
    a, b = index[:-1, :-1].ravel(), index[1:, :-1].ravel()
    c, d = index[1:, 1:].ravel(), index[:-1, 1:].ravel()
    faces = np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    vertices = points.reshape(-1, 3)
    u, v = np.meshgrid(np.linspace(0, 1, rows), np.linspace(0, 1, columns), indexing="ij")
    return LabelledMesh(vertices, _without_slivers(vertices, faces), np.column_stack([u.ravel(), v.ravel()]))


def lathe(
    profile: ArrayLike, sections: int = 24, start: float = 0.0, stop: float = 2 * math.pi
) -> LabelledMesh:
    """Rotate a profile of (radius, height) points about z. The outside is on the right of its direction."""
    line = np.asarray(profile, dtype=float)
    angles = np.linspace(start, stop, sections + 1)
    points = np.empty((sections + 1, len(line), 3))
    points[..., 0] = np.cos(angles)[:, None] * line[:, 0]
    points[..., 1] = np.sin(angles)[:, None] * line[:, 0]
    points[..., 2] = line[:, 1]
    return sheet(points)


def tube(path: ArrayLike, radius: float | Sequence[float], sides: int = 8) -> LabelledMesh:
    """Build a round bar with closed ends along a path (k, 3). The radius may vary along the path."""
    line = np.asarray(path, dtype=float)
    radii = np.broadcast_to(np.asarray(radius, dtype=float), (len(line),))
    tangents = np.gradient(line, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    normal = np.cross(tangents[0], np.eye(3)[np.argmin(np.abs(tangents[0]))])
    angles = np.linspace(0.0, -2 * math.pi, sides + 1)  # clockwise, so that the faces point outwards
    rings = []
    for point, tangent, r in zip(line, tangents, radii, strict=True):
        normal = normal - tangent * (normal @ tangent)  # transported along the path without twist
        normal /= np.linalg.norm(normal)
        side = np.cross(tangent, normal)
        rings.append(point + r * (np.cos(angles)[:, None] * normal + np.sin(angles)[:, None] * side))
    first, last = np.repeat(line[:1], sides + 1, axis=0), np.repeat(line[-1:], sides + 1, axis=0)
    return sheet(np.stack([first, *rings, last]))


def arc(radius: float, start: float, stop: float, points: int, squash: float = 1.0) -> Floats:
    """Return `points` points (points, 2) on an arc around the origin, with y scaled by `squash`."""
    t = np.linspace(start, stop, points)
    return np.column_stack([radius * np.cos(t), squash * radius * np.sin(t)])


def extrude(polygon: Polygon | MultiPolygon, height: float) -> LabelledMesh:
    """Build a prism over polygons in the x-y plane, from z = 0 to `height`."""
    if isinstance(polygon, MultiPolygon):
        return join([extrude(part, height) for part in polygon.geoms])
    mesh = trimesh.creation.extrude_polygon(orient(polygon), height, engine="manifold")
    return LabelledMesh(np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64))


def side(drawing: Polygon | MultiPolygon, width: float, rounding: float = 0.0) -> LabelledMesh:
    """Extrude a drawing in the y-z plane to `width` metres along x, and round its corners by `rounding`."""
    if rounding:
        drawing = drawing.buffer(-rounding, quad_segs=3).buffer(rounding, quad_segs=3)
    return extrude(drawing, width).moved((0, 0, -width / 2)).lengthwise()


def ridge(drawing: Polygon, length: float) -> LabelledMesh:
    prism = extrude(drawing, length).moved((0, 0, -length / 2))
    # Rotate the extrusion about x: (x, y, z) -> (x, -z, y).
    return LabelledMesh(prism.vertices[:, [0, 2, 1]] * [1, -1, 1], prism.faces)


def cushion(polygon: Polygon, height: float, edge: float) -> LabelledMesh:
    """Build a cushion over a polygon: a prism with rounded edges and texture coordinates from above.

    Raises:
        AssetError: `edge` is larger than the radius of the outline's corners permits.
    """
    # The radius of the corners exceeds the edge radius, so that the inset outlines do not cross themselves.
    solid = orient(polygon.buffer(-1.3 * edge, quad_segs=2).buffer(1.3 * edge, quad_segs=2).simplify(0.0005))
    levels = [
        (edge, 0.0),
        (0.0, edge),
        (0.0, height - edge),
        (0.3 * edge, height - 0.3 * edge),
        (edge, height),
    ]
    outline = np.asarray(solid.exterior.coords, dtype=float)[:-1]
    inward = _inward(outline)
    rings = [np.column_stack([outline + inset * inward, np.full(len(outline), z)]) for inset, z in levels]
    wall = sheet(np.stack([np.vstack([r, r[:1]]) for r in rings], axis=1))
    lids = []
    for ring, flip in ((rings[-1], False), (rings[0], True)):
        lid = Polygon(ring[:, :2])
        if not lid.is_valid:
            raise AssetError(
                f"a cushion's edge of {edge} m is too wide for its outline; round its corners more"
            )
        flat, faces = trimesh.creation.triangulate_polygon(lid, engine="manifold")
        vertices = np.column_stack([flat, np.full(len(flat), ring[0, 2])])
        spans = flat[faces][:, 1:] - flat[faces][:, :1]
        downwards = (spans[:, 0, 0] * spans[:, 1, 1] - spans[:, 0, 1] * spans[:, 1, 0]).sum() < 0
        lids.append(
            LabelledMesh(vertices, np.asarray(faces[:, ::-1] if flip != downwards else faces, dtype=np.int64))
        )
    return from_above(join([wall, *lids]))


def from_above(surface: LabelledMesh) -> LabelledMesh:
    """Set texture coordinates by projection from above, with u along x and v along y of the bounding box."""
    low, high = surface.vertices[:, :2].min(axis=0), surface.vertices[:, :2].max(axis=0)
    return LabelledMesh(surface.vertices, surface.faces, (surface.vertices[:, :2] - low) / (high - low))


def slab(width: float, depth: float, height: float) -> LabelledMesh:
    """Build a box on z = 0 with the texture on its top. Its sides have the colour of the texture's corner."""
    x, y = width / 2, depth / 2
    corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    top = LabelledMesh(np.column_stack([corners, np.full(4, height)]), np.array([[0, 1, 2], [0, 2, 3]]))
    box = trimesh.creation.box((width, depth, height))
    rest = LabelledMesh(
        np.asarray(box.vertices) + np.array([0, 0, height / 2]),
        np.asarray(box.faces[box.face_normals[:, 2] < 0.5]),
    )
    edge = np.full((len(rest.vertices), 2), 0.01)
    return join([from_above(top), LabelledMesh(rest.vertices, rest.faces, edge)])


def rounded_box(width: float, depth: float, height: float, radius: float) -> LabelledMesh:
    ball = trimesh.creation.icosphere(subdivisions=1, radius=radius).vertices
    reach = np.array([width, depth, height]) / 2 - radius
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (-1, 1)])
    hull = trimesh.convex.convex_hull((ball[None] + (signs * reach)[:, None]).reshape(-1, 3))
    return LabelledMesh(
        np.asarray(hull.vertices) + np.array([0, 0, height / 2]), np.asarray(hull.faces, dtype=np.int64)
    )


def write_obj(path: Path, surface: LabelledMesh) -> None:
    """Write a mesh as an OBJ file with sharp edges kept, rounded to 0.01 mm."""
    normals, normal_of = np.unique(np.round(_corner_normals(surface), 3) + 0.0, axis=0, return_inverse=True)
    corner = normal_of.reshape(-1, 3)
    lines = [f"v {x:.5f} {y:.5f} {z:.5f}" for x, y, z in np.round(surface.vertices, 5) + 0.0]
    if surface.uv is not None:
        lines += [f"vt {u:.4f} {v:.4f}" for u, v in surface.uv]
    lines += [f"vn {x:.3f} {y:.3f} {z:.3f}" for x, y, z in normals]
    middle = "/{0}/" if surface.uv is not None else "//"
    for face, ns in zip(surface.faces + 1, corner + 1, strict=True):
        lines.append("f " + " ".join(f"{v}{middle.format(v)}{n}" for v, n in zip(face, ns, strict=True)))
    write_text_atomically(path, "\n".join(lines) + "\n")


def _corner_normals(surface: LabelledMesh) -> Floats:
    """Return the normal at each corner of each face, (3 m, 3). Normals are averaged over smooth edges."""
    _, place = np.unique(np.round(surface.vertices, 6), axis=0, return_inverse=True)
    triangles = surface.vertices[surface.faces]
    weighted = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    units = weighted / np.linalg.norm(weighted, axis=1, keepdims=True)
    around: dict[int, list[int]] = {}
    corners = place.reshape(-1)[surface.faces]
    for face, spots in enumerate(corners):
        for spot in spots:
            around.setdefault(int(spot), []).append(face)
    normals = np.empty((len(surface.faces), 3, 3))
    for face, spots in enumerate(corners):
        for k, spot in enumerate(spots):
            near = np.array(around[int(spot)])
            total = weighted[near[units[near] @ units[face] > math.cos(CREASE)]].sum(axis=0)
            normals[face, k] = total / np.linalg.norm(total)
    return normals.reshape(-1, 3)


def _without_slivers(vertices: Floats, faces: NDArray[np.int64]) -> NDArray[np.int64]:
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    kept: NDArray[np.int64] = faces[np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-10]
    return kept


def _inward(outline: Floats) -> Floats:
    """Return unit normals (n, 2) that point inwards, at the vertices of a counter-clockwise outline."""
    ahead = np.roll(outline, -1, axis=0) - outline
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    along = ahead + np.roll(ahead, 1, axis=0)
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    return np.column_stack([-along[:, 1], along[:, 0]])
