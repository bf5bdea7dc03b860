"""Triangles of geoms, with the vertices and normals that MuJoCo's renderer gives them."""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_Geom = mujoco.mjtGeom
_MESHES = (_Geom.mjGEOM_MESH, _Geom.mjGEOM_SDF)
_FLATTENED_BELOW = (
    0.8  # cosine between the normals of a vertex and its face, below which MuJoCo takes the face's
)


class Shape(NamedTuple):
    """Triangles in a geom's frame."""

    positions: Floats  # m, (n, 3)
    normals: Floats  # of unit length, (n, 3)
    triangles: Indices  # counter-clockwise seen from outside, (t, 3)
    uv: (
        Floats | None
    )  # texture coordinates, of an image that covers the shape once, (n, 2); None for a mesh without


def shape_of(model: Any, geom: Any) -> Shape:
    """Triangles of an `MjvGeom` of a model; `ValueError` of a kind that the renderer does not draw."""
    kind, size = _Geom(geom.type), np.array(geom.size, np.float64)
    if kind in _MESHES:
        return _mesh(model, geom.dataid // 2)
    slices, stacks = int(model.vis.quality.numslices), int(model.vis.quality.numstacks)
    if kind == _Geom.mjGEOM_CAPSULE:
        return _capsule(size, slices, stacks)
    if kind == _Geom.mjGEOM_PLANE:
        return _scaled(_quad(), np.array([size[0], size[1], 1.0]))
    if kind == _Geom.mjGEOM_BOX:
        return _scaled(_box(), size)
    if kind == _Geom.mjGEOM_CYLINDER:
        return _scaled(_joined(_tube(slices), _disc(slices, 1.0), _disc(slices, -1.0)), size)
    if kind in (_Geom.mjGEOM_SPHERE, _Geom.mjGEOM_ELLIPSOID):
        return _scaled(_sphere(slices, stacks), size)
    raise ValueError(kind)


def _scaled(unit: Shape, size: Floats) -> Shape:
    normals = unit.normals / size
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return unit._replace(positions=unit.positions * size, normals=normals)


def _joined(*parts: Shape) -> Shape:
    starts = np.cumsum([0, *(len(part.positions) for part in parts)])
    return Shape(
        np.concatenate([part.positions for part in parts]),
        np.concatenate([part.normals for part in parts]),
        np.concatenate([part.triangles + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([part.uv for part in parts if part.uv is not None]),
    )


def _laid_over(across: Floats, down: Floats) -> Floats:
    """Texture coordinates (n, 2) of vertices whose places (n,) across and down an image go from -1 to 1."""
    return np.column_stack((1.0 + across, 1.0 + down)) / 2.0


def _grid(rows: int, columns: int) -> Indices:
    """Two triangles for each cell between (rows + 1) x (columns + 1) vertices, row by row; the rows go up."""
    i, j = (index.ravel() for index in np.mgrid[:rows, :columns])
    low = i * (columns + 1) + j
    high = low + columns + 1
    return np.concatenate([np.column_stack((low, low + 1, high + 1)), np.column_stack((low, high + 1, high))])


def _circle(slices: int) -> tuple[Floats, Floats]:
    angles = np.arange(slices + 1) * (2.0 * math.pi / slices)
    return np.cos(angles), np.sin(angles)


def _sphere(slices: int, stacks: int, low: int = -1, high: int = 1) -> Shape:
    """The unit sphere from the height `low` to `high`, each -1, 0 or 1."""
    halves = max(stacks // 2, 1)
    elevations = np.arange(low * halves, high * halves + 1) * (0.5 * math.pi / halves)
    cosines, sines = _circle(slices)
    flat = np.cos(elevations)[:, None]
    heights = np.repeat(np.sin(elevations)[:, None], slices + 1, axis=1)
    points = np.stack((flat * cosines, flat * sines, heights), axis=-1).reshape(-1, 3)
    down, around = np.meshgrid(
        np.linspace(1, 0, len(elevations)), np.linspace(0, 1, slices + 1), indexing="ij"
    )
    triangles = _grid(len(elevations) - 1, slices)
    corners = points[triangles]
    twice_area = np.linalg.norm(
        np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
    )
    uv = np.column_stack((around.ravel(), down.ravel()))
    return Shape(points, points, triangles[twice_area > 1e-9], uv)


def _tube(slices: int) -> Shape:
    """The unit cylinder without its ends."""
    cosines, sines = _circle(slices)
    around = np.column_stack((cosines, sines, np.zeros(slices + 1)))
    up = np.array([0.0, 0.0, 1.0])
    points = np.concatenate((around - up, around + up))
    turn = np.linspace(0.0, 1.0, slices + 1)
    uv = np.column_stack((np.tile(turn, 2), np.repeat([1.0, 0.0], slices + 1)))
    return Shape(points, np.concatenate((around, around)), _grid(1, slices), uv)


def _disc(slices: int, height: float) -> Shape:
    """The end of a unit cylinder at the height 1 or -1."""
    cosines, sines = _circle(slices)
    ring = np.column_stack((cosines, sines, np.full(slices + 1, height)))[:-1]
    number = np.arange(slices)
    triangles = np.column_stack((np.zeros(slices, np.int64), 1 + number, 1 + (number + 1) % slices))
    points = np.concatenate(([[0.0, 0.0, height]], ring))
    normals = np.tile([0.0, 0.0, height], (slices + 1, 1))
    uv = _laid_over(points[:, 0], points[:, 1])  # on its head: so MuJoCo does it
    return Shape(points, normals, triangles if height > 0.0 else triangles[:, ::-1], uv)


def _quad() -> Shape:
    points = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    uv = _laid_over(points[:, 0], -points[:, 1])
    return Shape(points, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), uv)


def _box() -> Shape:
    sides = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            turned = np.roll(_quad().positions, axis + 1, axis=1)
            turned[:, axis] = sign
            normals = np.zeros((4, 3))
            normals[:, axis] = sign
            triangles = _quad().triangles
            uv = _laid_over(turned[:, 1 if axis == 0 else 0], -turned[:, 1 if axis == 2 else 2])
            sides.append(Shape(turned, normals, triangles if sign > 0.0 else triangles[:, ::-1], uv))
    return _joined(*sides)


def _capsule(size: Floats, slices: int, stacks: int) -> Shape:
    """A tube between two half spheres, each of which shows the whole image."""
    radius, half = (size[0] + size[1]) / 2.0, size[2]
    parts = [_scaled(_tube(slices), size)]
    for low, high, height in ((0, 1, half), (-1, 0, -half)):
        cap = _scaled(_sphere(slices, stacks, low, high), np.array([size[0], size[1], radius]))
        parts.append(cap._replace(positions=cap.positions + np.array([0.0, 0.0, height])))
    return _joined(*parts)


def _mesh(model: Any, mesh: int) -> Shape:
    vertices = model.mesh_vert[model.mesh_vertadr[mesh] :][: model.mesh_vertnum[mesh]].astype(np.float64)
    normals = model.mesh_normal[model.mesh_normaladr[mesh] :][: model.mesh_normalnum[mesh]].astype(np.float64)
    rows = slice(model.mesh_faceadr[mesh], model.mesh_faceadr[mesh] + model.mesh_facenum[mesh])
    faces, face_normals = model.mesh_face[rows], model.mesh_facenormal[rows]
    first = model.mesh_texcoordadr[mesh]
    if first >= 0:
        uv = model.mesh_texcoord[first:][: model.mesh_texcoordnum[mesh]].astype(np.float64)
        return _without_copies(faces, vertices, normals[face_normals], uv[model.mesh_facetexcoord[rows]])
    return _without_copies(faces, vertices, _flattened(vertices[faces], normals[face_normals]), None)


def _flattened(corners: Floats, normals: Floats) -> Floats:
    """Normals (t, 3, 3) of the corners (t, 3, 3) of triangles, those far from their face's replaced by it."""
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-15)
    along = np.einsum("tck,tk->tc", normals, flat)
    return np.where(along[..., None] < _FLATTENED_BELOW, flat[:, None], normals)


def _without_copies(faces: Any, vertices: Floats, normals: Floats, uv: Floats | None) -> Shape:
    """Triangles of a mesh with one vertex for equal position, normal and texture coordinates."""
    parts = [vertices[faces].reshape(-1, 3), normals.reshape(-1, 3)]
    if uv is not None:
        parts.append(uv.reshape(-1, 2))
    unique, index = np.unique(np.concatenate(parts, axis=1), axis=0, return_inverse=True)
    points = unique[:, :3]
    return Shape(points, unique[:, 3:6], index.reshape(-1, 3), unique[:, 6:] if uv is not None else None)
