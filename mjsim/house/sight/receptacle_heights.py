"""Measure how high receptacles are filled, by casting vertical rays into the geoms nearby."""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.rays import SOLID
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

_SPHERE, _CAPSULE, _ELLIPSOID, _CYLINDER, _BOX, _MESH = (
    int(getattr(mujoco.mjtGeom, f"mjGEOM_{name}"))
    for name in ("SPHERE", "CAPSULE", "ELLIPSOID", "CYLINDER", "BOX", "MESH")
)


class Shapes(NamedTuple):
    """The arrays of `MjModel` that describe the shapes of all geoms."""

    types: Ints  # `MjModel.geom_type`, shape (ngeom,)
    sizes: Floats  # `MjModel.geom_size` in metres, shape (ngeom, 3)
    bounds: Floats  # `MjModel.geom_rbound` in metres, shape (ngeom,)
    meshes: Ints  # `MjModel.geom_dataid`, shape (ngeom,)
    first_vertex: Ints  # `MjModel.mesh_vertadr`, shape (nmesh,)
    first_face: Ints  # `MjModel.mesh_faceadr`, shape (nmesh,)
    face_count: Ints  # `MjModel.mesh_facenum`, shape (nmesh,)
    vertices: Floats  # `MjModel.mesh_vert` in metres, shape (nmeshvert, 3)
    faces: Ints  # `MjModel.mesh_face`, shape (nmeshface, 3)


class ReceptacleHeights:
    """A sensor that uses ray casts to measure how high the receptacles of a scene are filled."""

    def __init__(self, scene: Scene) -> None:
        model = scene.model
        visible = model.geom_rgba[:, 3] > 0
        solid = visible & np.isin(model.geom_group, np.flatnonzero(SOLID)) & (model.geom_type != 0)
        moving = scene.index.geom_owner >= 0
        self._model = model
        self._moving = np.flatnonzero(solid & moving).astype(np.int32)
        self._static = np.flatnonzero(solid & (model.body_weldid[model.geom_bodyid] == 0)).astype(np.int32)
        self._shapes = Shapes(
            model.geom_type,
            model.geom_size,
            model.geom_rbound,
            model.geom_dataid,
            model.mesh_vertadr,
            model.mesh_faceadr,
            model.mesh_facenum,
            vertices=np.ascontiguousarray(model.mesh_vert, np.float64),
            faces=model.mesh_face,
        )
        self._near: dict[str, Ints] = {}

    def heights(
        self, data: mujoco.MjData, receptacle: ReceptacleGeometry, points: Floats, top: float, ignore: Ints
    ) -> Floats:
        """Return the height of the first solid surface below each point (k, 2), or -inf if there is none.

        The rays start at the height `top` and ignore bodies whose ids are in `ignore`. Lengths are in metres.
        """
        moving = self._within_reach(data, receptacle, self._moving)
        bodies = self._model.geom_bodyid[moving]
        moving = moving[(bodies[:, None] != ignore).all(axis=1)]
        geoms = np.concatenate((self._static_near(data, receptacle), moving))
        points = np.ascontiguousarray(points)
        return cast_down(points, top, geoms, data.geom_xpos, data.geom_xmat, self._shapes)

    def _static_near(self, data: mujoco.MjData, receptacle: ReceptacleGeometry) -> Ints:
        if receptacle.key not in self._near:
            self._near[receptacle.key] = self._within_reach(data, receptacle, self._static)
        return self._near[receptacle.key]

    def _within_reach(self, data: mujoco.MjData, receptacle: ReceptacleGeometry, geoms: Ints) -> Ints:
        offsets = data.geom_xpos[geoms, :2] - receptacle.center[:2]
        reach = float(np.hypot(*receptacle.half_size[:2])) + self._model.geom_rbound[geoms]
        return np.asarray(geoms[np.hypot(offsets[:, 0], offsets[:, 1]) < reach])


@kernel
def cast_down(
    points: Floats, top: float, geoms: Ints, positions: Floats, rotations: Floats, shapes: Shapes
) -> Floats:
    """Return the height at which a ray straight down from each point (k, 2) first hits a geom, or -inf."""
    heights = np.full(len(points), -math.inf)
    start, along = np.empty(3), np.empty(3)
    for geom in geoms:
        x, y, dz = positions[geom, 0], positions[geom, 1], top - positions[geom, 2]
        bound, axes = shapes.bounds[geom] ** 2, rotations[geom]  # columns of a rotation are the geom's axes
        size, is_box = shapes.sizes[geom], shapes.types[geom] == _BOX
        along[0], along[1], along[2] = -axes[6], -axes[7], -axes[8]
        for k in range(len(points)):
            dx, dy = points[k, 0] - x, points[k, 1] - y
            if dx * dx + dy * dy > bound:
                continue
            for axis in range(3):
                start[axis] = axes[axis] * dx + axes[3 + axis] * dy + axes[6 + axis] * dz
            depth = _into_box(start, along, size) if is_box else _into_geom(start, along, geom, shapes)
            if depth >= 0.0:
                heights[k] = max(heights[k], top - depth)
    return heights


@kernel
def _into_geom(start: Floats, along: Floats, geom: int, shapes: Shapes) -> float:
    kind, size = shapes.types[geom], shapes.sizes[geom]
    if kind != _MESH:
        return _into_round(start, along, size, kind)
    mesh = shapes.meshes[geom]
    vertices, faces = shapes.vertices[shapes.first_vertex[mesh] :], shapes.faces[shapes.first_face[mesh] :]
    return _into_mesh(start, along, vertices, faces, shapes.face_count[mesh])


@kernel
def _into_box(start: Floats, along: Floats, size: Floats) -> float:
    enter, leave = 0.0, math.inf
    for axis in range(3):
        if abs(along[axis]) < 1e-12:
            if abs(start[axis]) > size[axis]:
                return -1.0
            continue
        near = (-size[axis] - start[axis]) / along[axis]
        far = (size[axis] - start[axis]) / along[axis]
        enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
    return enter if enter <= leave else -1.0


@kernel
def _into_round(start: Floats, along: Floats, size: Floats, kind: int) -> float:
    if kind == _SPHERE:
        return _into_ball(start, along, size[0], size[0], size[0], 0.0)
    if kind == _ELLIPSOID:
        return _into_ball(start, along, size[0], size[1], size[2], 0.0)
    depth = _into_tube(start, along, size[0], size[1])
    if kind == _CAPSULE:
        for end in (-size[1], size[1]):
            depth = _sooner(depth, _into_ball(start, along, size[0], size[0], size[0], end))
        return depth
    if kind == _CYLINDER and abs(along[2]) > 1e-12:
        for end in (-size[1], size[1]):
            lid = (end - start[2]) / along[2]
            x, y = start[0] + lid * along[0], start[1] + lid * along[1]
            if x * x + y * y <= size[0] * size[0]:
                depth = _sooner(depth, lid)
    return depth


@kernel
def _into_ball(start: Floats, along: Floats, rx: float, ry: float, rz: float, z: float) -> float:
    sx, sy, sz = start[0] / rx, start[1] / ry, (start[2] - z) / rz
    ax, ay, az = along[0] / rx, along[1] / ry, along[2] / rz
    return _root(ax * ax + ay * ay + az * az, sx * ax + sy * ay + sz * az, sx * sx + sy * sy + sz * sz - 1.0)


@kernel
def _into_tube(start: Floats, along: Floats, radius: float, half: float) -> float:
    a = along[0] * along[0] + along[1] * along[1]
    if a < 1e-12:
        return -1.0
    b = start[0] * along[0] + start[1] * along[1]
    depth = _root(a, b, start[0] * start[0] + start[1] * start[1] - radius * radius)
    return depth if abs(start[2] + depth * along[2]) <= half else -1.0


@kernel
def _root(a: float, b: float, c: float) -> float:
    inside = b * b - a * c
    return (-b - math.sqrt(inside)) / a if inside >= 0.0 else -1.0


@kernel
def _sooner(first: float, second: float) -> float:
    if first < 0.0 or (0.0 <= second < first):
        return second
    return first


@kernel
def _into_mesh(start: Floats, along: Floats, vertices: Floats, faces: Ints, count: int) -> float:
    """Return the distance along a ray to the first triangle, or -1 (Moeller and Trumbore, 1997)."""
    best = -1.0
    for face in range(count):
        a, b, c = vertices[faces[face, 0]], vertices[faces[face, 1]], vertices[faces[face, 2]]
        ux, uy, uz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
        vx, vy, vz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
        px, py = along[1] * vz - along[2] * vy, along[2] * vx - along[0] * vz
        pz = along[0] * vy - along[1] * vx
        determinant = ux * px + uy * py + uz * pz
        if abs(determinant) < 1e-15:
            continue
        sx, sy, sz = start[0] - a[0], start[1] - a[1], start[2] - a[2]
        u = (sx * px + sy * py + sz * pz) / determinant
        if u < 0.0 or u > 1.0:
            continue
        qx, qy, qz = sy * uz - sz * uy, sz * ux - sx * uz, sx * uy - sy * ux
        v = (along[0] * qx + along[1] * qy + along[2] * qz) / determinant
        if v >= 0.0 and u + v <= 1.0:
            best = _sooner(best, (vx * qx + vy * qy + vz * qz) / determinant)
    return best
