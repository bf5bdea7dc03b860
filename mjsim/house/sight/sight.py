"""Which objects and receptacles a person sees: rays from the eye, without any rendering.

A kernel leaves out the rays that a large wall certainly blocks, and MuJoCo casts the others one by one: for the few
objects that are in the same room, this takes two thirds of the time of one `mj_multiRay`.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.compiled.rays import DRAWN, RIM, Floats, Mask, first_hit, moving_geoms
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.house.scene.scene import Scene
from mjsim.house.sight.drawn_state import drawn_state
from mjsim.support.kernels import kernel
from mjsim.values.person_parameters import PersonParameters

INSET = 0.7  # of the half extents: box corners and face centres of round objects are empty
OFFSETS = np.vstack([np.zeros(3), INSET * np.eye(3), -INSET * np.eye(3)])
_MIN_WALL = 0.25  # m, half extents of the boxes that are tested before any ray is cast
_MARGIN = 1e-6  # m, for rounding


@dataclass(frozen=True)
class FieldOfView:
    """How far and how wide a person sees."""

    horizontal: float  # full angle, rad
    vertical: float  # full angle, rad
    range: float  # how far an object is noticed, m

    @classmethod
    def of(cls, person: PersonParameters) -> "FieldOfView":
        """The field of view of a person, whose picture is 4:3."""
        return cls(person.field_of_view, person.vertical_field, person.viewing_distance)


def persons_geoms(scene: Scene) -> Mask:
    """Which geoms belong to the person, (ngeom,)."""
    return _sight(scene).person


def in_field_of_view(
    points: ArrayLike, eye: ArrayLike, heading: float, pitch: float, field: FieldOfView
) -> Mask:
    """Which points (n, 3), m, are inside the field of view, at any distance and behind whatever; shape (n,).

    The gaze is as in `visible_objects`.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field)
    forward, left, up = gaze.axes @ (np.reshape(points, (-1, 3)) - gaze.eye).T
    return np.asarray((np.abs(left) <= forward * gaze.slopes[0]) & (np.abs(up) <= forward * gaze.slopes[1]))


def visible_receptacles(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    receptacles: Mapping[str, ReceptacleGeometry],
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    field: FieldOfView,
    own: Mask | None = None,
) -> frozenset[str]:
    """Keys of the receptacles in view.

    A receptacle is in view when one of seven rays, to the middle of its volume and to points around it, is inside the
    field of view and meets nothing before the receptacle. The model is any that contains the house, `own` (ngeom,)
    marks geoms of the person, which hide nothing, and the gaze is as in `visible_objects`.
    """
    origin = np.array(eye, dtype=np.float64)

    def is_open(point: Floats, receptacle: ReceptacleGeometry) -> bool:
        share, _ = first_hit(model, data, origin, point - origin, groups=DRAWN, through=own)
        return share >= 1.0 or receptacle.contains(origin + share * (point - origin), RIM)

    seen = set()
    for key, receptacle in receptacles.items():
        points = receptacle.center + (OFFSETS * receptacle.half_size) @ receptacle.rotation.T
        near = np.linalg.norm(points - origin, axis=1) <= field.range
        inside = near & in_field_of_view(points, origin, heading, pitch, field)
        if any(is_open(point, receptacle) for point in points[inside]):
            seen.add(key)
    return frozenset(seen)


def visible_objects(
    scene: Scene,
    data: mujoco.MjData,
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    field: FieldOfView | None = None,
    among: Collection[str] | None = None,
) -> tuple[str, ...]:
    """Instance names of the objects in view, in the episode's order.

    An object is in view when one of seven rays, to the middle of its bounding box and to points around it, is
    inside the field of view and meets the object first. Walls, furniture and other objects block; the person's
    own body does not. `data` has geom poses up to date; `eye` is in m, (3,), `heading` rad, counter-clockwise from +x,
    `pitch` rad, positive upwards; `field` defaults to that of the scene's person, `among`, names to look for, to all.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field or FieldOfView.of(scene.person))
    return tuple(scene.index.names[i] for i in sorted(set(_met(scene, data, gaze, among, once=True))))


def visible_shares(
    scene: Scene,
    data: mujoco.MjData,
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    field: FieldOfView | None = None,
    among: Collection[str] | None = None,
) -> dict[str, float]:
    """How much of each object in view is seen, as the share of its seven rays that reach it: 0 < share <= 1.

    Arguments are as in `visible_objects`.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field or FieldOfView.of(scene.person))
    hits = list(_met(scene, data, gaze, among, once=False))
    return {scene.index.names[i]: hits.count(i) / len(OFFSETS) for i in sorted(set(hits))}


class _SightGeometry(NamedTuple):
    """The objects' drawn geoms, the large static boxes and the person in a scene; none of it changes."""

    geoms: NDArray[np.int64]  # ids of the drawn geoms, (g,)
    owners: NDArray[np.int64]  # position of the object of each in the episode's order, (g,)
    boxes: Floats  # centre and half extents of each one's bounding box, in its own frame, m, (g, 6)
    wall_centers: Floats  # of walls and cupboards, the largest first, m, (w, 3)
    wall_axes: Floats  # as columns, (w, 3, 3)
    wall_half_sizes: Floats  # m, (w, 3)
    person: Mask  # which geoms belong to the person, (ngeom,)


class _Gaze(NamedTuple):
    """The eye (3,), m, rows forward, left and up (3, 3), tangents of half the field of view (2,), and its range, m."""

    eye: Floats
    axes: Floats
    slopes: Floats
    range: float


def _gaze(eye: Floats, heading: float, pitch: float, field: FieldOfView) -> _Gaze:
    c, s, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
    axes = np.array([[c * cp, s * cp, sp], [-s, c, 0.0], [-c * sp, -s * sp, cp]])
    slopes = np.array([math.tan(field.horizontal / 2), math.tan(field.vertical / 2)])
    return _Gaze(eye, axes, slopes, float(field.range))


def _met(
    scene: Scene, data: mujoco.MjData, gaze: _Gaze, among: Collection[str] | None, *, once: bool
) -> Iterator[int]:
    """Position of the object of each ray that meets it first; `once` stops at an object's first such ray."""
    scene, data = drawn_state(scene, data)
    sight, names = _sight(scene), scene.index.names
    looked_for = frozenset(names if among is None else among)
    wanted = np.array([name in looked_for for name in names], np.bool_)
    seen: set[int] = set()
    owners, rays = _open_rays(sight, data.geom_xpos, data.geom_xmat, wanted, gaze)
    for owner, ray in zip(owners.tolist(), rays, strict=True):
        if owner in seen:
            continue
        _, geom = first_hit(scene.model, data, gaze.eye, ray, groups=DRAWN, through=sight.person)
        if geom >= 0 and scene.index.geom_owner[geom] == owner:
            yield owner
            if once:
                seen.add(owner)


def _sight(scene: Scene) -> _SightGeometry:
    return scene.once("sight", lambda: _sight_geometry(scene))


def _sight_geometry(scene: Scene) -> _SightGeometry:
    model, owner = scene.model, scene.index.geom_owner
    drawn, static = DRAWN[model.geom_group] > 0, ~moving_geoms(model)
    geoms = np.flatnonzero((owner >= 0) & drawn)
    centers, axes, half_sizes = large_boxes(scene, 0.0)
    return _SightGeometry(
        geoms=geoms,
        owners=owner[geoms].astype(np.int64),
        boxes=model.geom_aabb[geoms],
        wall_centers=centers,
        wall_axes=axes,
        wall_half_sizes=half_sizes,
        person=(owner == -1) & ~static,
    )


def large_boxes(scene: Scene, alpha: float) -> tuple[Floats, Floats, Floats]:
    """The large boxes in a scene with visuals that never move and are less transparent than `alpha`, the largest first.

    Returns their centres, m, (w, 3), axes as columns, (w, 3, 3), and half extents, m, (w, 3).
    """
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    drawn, static = DRAWN[model.geom_group] > 0, ~moving_geoms(model)
    opacity = model.geom_rgba[:, 3].copy()  # a ray passes through what is fully transparent
    textured = model.geom_matid >= 0
    opacity[textured] *= model.mat_rgba[model.geom_matid[textured], 3]
    extents = np.sort(model.geom_size, axis=1)
    large = (model.geom_type == mujoco.mjtGeom.mjGEOM_BOX) & (extents[:, 1] >= _MIN_WALL)
    found = np.flatnonzero(large & static & drawn & (opacity > alpha))
    found = found[np.argsort(-extents[found, 1] * extents[found, 2], kind="stable")]
    return data.geom_xpos[found], data.geom_xmat[found].reshape(-1, 3, 3), model.geom_size[found]


@kernel
def _open_rays(
    sight: _SightGeometry, positions: Floats, rotations: Floats, wanted: Mask, gaze: _Gaze
) -> tuple[NDArray[np.int64], Floats]:
    """Rays worth casting, inside the field of view and not certainly behind a wall.

    Takes poses of geoms, (ngeom, 3) m and (ngeom, 9), and which objects are wanted, (n,). Returns the object of each
    ray, (k,), in order, and vectors from the eye to points in its bounding box, m, (k, 3).
    """
    low, high = _bounding_boxes(sight, positions, rotations, wanted)
    owners, rays = np.empty(7 * len(wanted), np.int64), np.empty((7 * len(wanted), 3))
    count = 0
    for i in np.flatnonzero(low[:, 0] <= high[:, 0]):
        for offset in OFFSETS:
            ray = rays[count]
            for k in range(3):
                middle, half = (low[i, k] + high[i, k]) / 2, (high[i, k] - low[i, k]) / 2
                ray[k] = middle + half * offset[k] - gaze.eye[k]
            if _in_field(ray, gaze) and not _is_blocked(ray, low[i], high[i], gaze.eye, sight):
                owners[count] = i
                count += 1
    return owners[:count], rays[:count]


@kernel
def _bounding_boxes(
    sight: _SightGeometry, positions: Floats, rotations: Floats, wanted: Mask
) -> tuple[Floats, Floats]:
    """Corners of the upright boxes around wanted objects, m, each (n, 3); infinity and -infinity for the others."""
    low, high = np.full((len(wanted), 3), np.inf), np.full((len(wanted), 3), -np.inf)
    for geom, i, box in zip(sight.geoms, sight.owners, sight.boxes):  # noqa: B905 - numba knows no `strict`
        if not wanted[i]:
            continue
        for k in range(3):
            r0, r1, r2 = rotations[geom, 3 * k], rotations[geom, 3 * k + 1], rotations[geom, 3 * k + 2]
            center = positions[geom, k] + (r0 * box[0] + r1 * box[1] + r2 * box[2])
            half = abs(r0) * box[3] + abs(r1) * box[4] + abs(r2) * box[5]
            low[i, k] = min(low[i, k], center - half)
            high[i, k] = max(high[i, k], center + half)
    return low, high


@kernel
def _in_field(ray: Floats, gaze: _Gaze) -> bool:
    """Whether a vector (3,) from the eye, m, ends inside the viewing frustum."""
    if ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2 > gaze.range**2:
        return False
    forward = ray[0] * gaze.axes[0, 0] + ray[1] * gaze.axes[0, 1] + ray[2] * gaze.axes[0, 2]
    left = ray[0] * gaze.axes[1, 0] + ray[1] * gaze.axes[1, 1] + ray[2] * gaze.axes[1, 2]
    up = ray[0] * gaze.axes[2, 0] + ray[1] * gaze.axes[2, 1] + ray[2] * gaze.axes[2, 2]
    return bool(abs(left) <= forward * gaze.slopes[0] and abs(up) <= forward * gaze.slopes[1])


@kernel
def _is_blocked(ray: Floats, low: Floats, high: Floats, eye: Floats, sight: _SightGeometry) -> bool:
    """Whether a ray (3,) from the eye enters a wall before the box from `low` to `high`, each (3,), m.

    Walls are taken as a little smaller than they are, and the box as a little larger.
    """
    reach = 0.0  # share of the ray at which it enters the object's box
    for k in range(3):
        if ray[k] > _MARGIN:
            reach = max(reach, (low[k] - _MARGIN - eye[k]) / ray[k])
        elif ray[k] < -_MARGIN:
            reach = max(reach, (high[k] + _MARGIN - eye[k]) / ray[k])
    for w in range(len(sight.wall_centers)):
        enter, leave = -np.inf, reach
        for k in range(3):
            along = start = 0.0
            for j in range(3):
                along += ray[j] * sight.wall_axes[w, j, k]
                start += (eye[j] - sight.wall_centers[w, j]) * sight.wall_axes[w, j, k]
            half = sight.wall_half_sizes[w, k] - _MARGIN
            if abs(along) > _MARGIN:
                near, far = (-half - start) / along, (half - start) / along
                enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
            elif abs(start) > half:
                leave = -np.inf
            if enter >= leave:
                break
        if 0.0 < enter < leave:
            return True
    return False
