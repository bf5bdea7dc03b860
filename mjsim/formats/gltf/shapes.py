"""Triangulate geoms with the same vertices and normals as MuJoCo's renderer."""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

_Geom = mujoco.mjtGeom
MESHES = (_Geom.mjGEOM_MESH, _Geom.mjGEOM_SDF)
_FLATTENED_BELOW = 0.8  # cosine between vertex and face normals below which shading is flat


class Shape(NamedTuple):
    """A triangle mesh in the frame of a geom."""

    positions: Floats  # vertices in metres, shape (n, 3)
    normals: Floats  # unit normals, shape (n, 3)
    triangles: Indices  # vertex indices in counter-clockwise order seen from outside, shape (t, 3)
    unscaled: Floats  # vertex directions from the centre of a cube texture, shape (n, 3)
    uv: Floats | None  # texture coordinates with v pointing down, shape (n, 2), or None if a mesh has none


def shape_of(model: Any, geom: Any) -> Shape:
    """Triangulate a geom (`MjvGeom`) of a model. Raise `ValueError` if its type is not supported."""
    kind, size = _Geom(geom.type), np.array(geom.size, np.float64)
    if kind in MESHES:
        return _mesh(model, geom.dataid // 2)
    slices, stacks = int(model.vis.quality.numslices), int(model.vis.quality.numstacks)
    if kind == _Geom.mjGEOM_CAPSULE:
        return _capsule(size, slices, stacks)
    if kind == _Geom.mjGEOM_PLANE:
        return _plane(size, 2.0 * model.vis.map.zfar * model.stat.extent)
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
        np.concatenate([part.unscaled for part in parts]),
        np.concatenate([part.uv for part in parts if part.uv is not None]),
    )


def _grid(rows: int, columns: int) -> Indices:
    i, j = (index.ravel() for index in np.mgrid[:rows, :columns])
    low = i * (columns + 1) + j
    high = low + columns + 1
    return np.concatenate([np.column_stack((low, low + 1, high + 1)), np.column_stack((low, high + 1, high))])


def _sphere(slices: int, stacks: int, low: int = -1, high: int = 1) -> Shape:
    halves = max(stacks // 2, 1)
    heights = np.arange(low * halves, high * halves + 1) / halves
    around, up = np.meshgrid(np.arange(slices + 1) / slices, heights)
    flat, angle = np.cos(0.5 * math.pi * up), 2.0 * math.pi * around
    axes = flat * np.cos(angle), flat * np.sin(angle), np.sin(0.5 * math.pi * up)
    points = np.stack(axes, axis=-1).reshape(-1, 3)
    uv = np.column_stack((around.ravel(), (high - up.ravel()) / (high - low)))
    # Cells at a pole are single triangles. The u coordinate of the pole is midway between the other corners.
    is_pole = np.abs(points[:, 2]) > 1.0 - 1e-9
    uv[is_pole, 0] -= 0.5 / slices * np.sign(points[is_pole, 2])
    triangles = _grid(len(up) - 1, slices)
    return Shape(points, points, triangles[is_pole[triangles].sum(axis=1) < 2], points, uv)


def _circle(slices: int) -> Floats:
    angles = np.arange(slices + 1) * (2.0 * math.pi / slices)
    return np.column_stack((np.cos(angles), np.sin(angles)))


def _tube(slices: int) -> Shape:
    around = np.column_stack((_circle(slices), np.zeros(slices + 1)))
    up = np.array([0.0, 0.0, 1.0])
    points = np.concatenate((around - up, around + up))
    share = np.tile(np.arange(slices + 1) / slices, 2)
    uv = np.column_stack((share, 0.5 * (1.0 - points[:, 2])))
    return Shape(points, np.concatenate((around, around)), _grid(1, slices), points, uv)


def _disc(slices: int, height: float) -> Shape:
    flat = np.concatenate((np.zeros((1, 2)), _circle(slices)[:-1]))
    number = np.arange(slices)
    triangles = np.column_stack((np.zeros(slices, np.int64), 1 + number, 1 + (number + 1) % slices))
    points = np.column_stack((flat, np.full(slices + 1, height)))
    normals = np.tile([0.0, 0.0, height], (slices + 1, 1))
    return Shape(points, normals, triangles if height > 0.0 else triangles[:, ::-1], points, 0.5 + 0.5 * flat)


def _quad() -> Shape:
    points = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [1.0, 1.0, 0.0], [-1.0, 1.0, 0.0]])
    uv = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]])
    return Shape(points, np.tile([0.0, 0.0, 1.0], (4, 1)), np.array([[0, 1, 2], [0, 2, 3]]), points, uv)


def _plane(size: Floats, far: float) -> Shape:
    """Return a plane with the given half sizes. Where a half size is 0, the plane is infinite and drawn up to `far`."""
    shape = _quad()
    endless = size[:2] <= 0.0
    half = np.where(endless, far, size[:2])
    # On an infinite plane, the image is 2 m wide and starts at the centre of the plane.
    uv = shape.positions[:, :2] * [0.5, -0.5] * np.where(endless, half, 1.0) + np.where(endless, 0.0, 0.5)
    return shape._replace(positions=shape.positions * [*half, 1.0], uv=uv)


def _box() -> Shape:
    """Return the six sides of a box. The image is upright on vertical sides and mirrored on three sides."""
    quad, sides = _quad(), []
    for normal, right, up in ((0, 1, 2), (1, 0, 2), (2, 0, 1)):
        for sign in (-1.0, 1.0):
            points, normals = np.zeros((4, 3)), np.zeros((4, 3))
            points[:, right], points[:, up] = quad.positions[:, 0], quad.positions[:, 1]
            points[:, normal] = normals[:, normal] = sign
            is_turned = sign * (1.0 if normal != 1 else -1.0) < 0.0
            triangles = quad.triangles[:, ::-1] if is_turned else quad.triangles
            sides.append(Shape(points, normals, triangles, points, quad.uv))
    return _joined(*sides)


def _capsule(size: Floats, slices: int, stacks: int) -> Shape:
    """Return a capsule, which consists of a tube and two hemispheres. Each part shows the whole image."""
    radius, half = (size[0] + size[1]) / 2.0, size[2]
    parts = [_scaled(_tube(slices), size)]
    for low, high in ((0, 1), (-1, 0)):
        cap = _scaled(_sphere(slices, stacks, low, high), np.array([size[0], size[1], radius]))
        up = np.array([0.0, 0.0, low + high])
        # In MuJoCo, the hemispheres are centred at the ends of the unit cylinder.
        parts.append(cap._replace(positions=cap.positions + half * up, unscaled=cap.unscaled + up))
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
    """Replace vertex normals (t, 3, 3) by the face normal if the angle between them is large."""
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.maximum(np.linalg.norm(flat, axis=1, keepdims=True), 1e-15)
    along = np.einsum("tck,tk->tc", normals, flat)
    return np.where(along[..., None] < _FLATTENED_BELOW, flat[:, None], normals)


def _without_copies(faces: Any, vertices: Floats, normals: Floats, uv: Floats | None) -> Shape:
    parts = [vertices[faces].reshape(-1, 3), normals.reshape(-1, 3)]
    if uv is not None:
        parts.append(uv.reshape(-1, 2))
    unique, index = np.unique(np.concatenate(parts, axis=1), axis=0, return_inverse=True)
    points = unique[:, :3]
    places = None if uv is None else unique[:, 6:]
    return Shape(points, unique[:, 3:6], index.reshape(-1, 3), points, places)
