"""Find the objects and receptacles that a person can see. This uses ray casts instead of rendering.

A kernel discards rays that are certainly blocked by a large wall. MuJoCo casts the remaining rays one by one,
because this takes only two thirds of the time of `mj_multiRay` for the few objects in a room.
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
from mjsim.house.sight.drawn_state import MARGIN, WallBoxes, drawn_state, is_blocked, large_boxes
from mjsim.support.kernels import kernel
from mjsim.values.person_parameters import PersonParameters

# Rays aim at this fraction of the half extents, because the corners of bounding boxes are often empty.
INSET = 0.7
OFFSETS = np.vstack([np.zeros(3), INSET * np.eye(3), -INSET * np.eye(3)])


@dataclass(frozen=True)
class FieldOfView:
    """The angles and the range of a person's field of view."""

    horizontal: float  # full horizontal angle in radians
    vertical: float  # full vertical angle in radians
    range: float  # maximum distance at which a person notices objects, in metres

    @classmethod
    def of(cls, person: PersonParameters) -> "FieldOfView":
        """Return the field of view of a person for an image with an aspect ratio of 4:3."""
        return cls(person.field_of_view, person.vertical_field, person.viewing_distance)


def persons_geoms(scene: Scene) -> Mask:
    """Return a mask (ngeom,) of the geoms that belong to the person's body."""
    return _sight(scene).person


def in_field_of_view(
    points: ArrayLike, eye: ArrayLike, heading: float, pitch: float, field: FieldOfView
) -> Mask:
    """Return a mask (n,) of the points (n, 3) that are inside a person's field of view.

    Distance and obstacles are ignored. `points` and `eye` are in metres, `heading` and `pitch` in radians.
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
    """Return the keys of the receptacles that a person can see.

    Seven rays are cast to each receptacle: one to the centre of its volume, and six to points around it. The
    receptacle is visible if one of them is inside the field of view and not blocked. `model` is any model of
    the house. `own` (ngeom,) masks geoms that block no rays. See `visible_objects` for other arguments.
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
    """Return the names of the objects that a person can see, in the order of the episode.

    Seven rays are cast to each object: one to the centre of its bounding box, and six to points around the
    centre. The object is visible if one of them is inside the field of view and hits the object first. Walls,
    furniture and other objects block rays, but the person's body does not.

    `data` must contain the current poses of geoms. `eye` (3,) is in metres. `heading` (counter-clockwise from
    +x) and `pitch` (positive upwards) are in radians. `field` defaults to the field of view of the scene's
    person. If `among` is given, only the objects with these names are considered.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field or FieldOfView.of(scene.person))
    return tuple(scene.index.names[i] for i in sorted(set(_object_hits(scene, data, gaze, among, once=True))))


def visible_shares(
    scene: Scene,
    data: mujoco.MjData,
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    among: Collection[str] | None = None,
) -> dict[str, float]:
    """Return the visible fraction of each object in view, estimated as the fraction of rays that hit it.

    See `visible_objects` for the arguments.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, FieldOfView.of(scene.person))
    hits = list(_object_hits(scene, data, gaze, among, once=False))
    return {scene.index.names[i]: hits.count(i) / len(OFFSETS) for i in sorted(set(hits))}


class _SightGeometry(NamedTuple):
    """The constant data of a scene: the geoms of objects and of the person, and large static boxes."""

    geoms: NDArray[np.int64]  # ids of drawn geoms that belong to objects, shape (g,)
    owners: NDArray[np.int64]  # index of the object to which each drawn geom belongs, shape (g,)
    boxes: Floats  # centre and half extents of the bounding box of each drawn geom in its frame, shape (g, 6)
    walls: WallBoxes
    person: Mask  # mask of the geoms of the person's body, shape (ngeom,)


class _Gaze(NamedTuple):
    """The position and direction of a person's eye, with the limits of the field of view."""

    eye: Floats  # position of the eye in metres, shape (3,)
    axes: Floats  # forward, left and up directions as rows, shape (3, 3)
    slopes: Floats  # tangents of half the horizontal and half the vertical angle of view, shape (2,)
    range: float  # maximum viewing distance in metres


def _gaze(eye: Floats, heading: float, pitch: float, field: FieldOfView) -> _Gaze:
    c, s, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
    axes = np.array([[c * cp, s * cp, sp], [-s, c, 0.0], [-c * sp, -s * sp, cp]])
    slopes = np.array([math.tan(field.horizontal / 2), math.tan(field.vertical / 2)])
    return _Gaze(eye, axes, slopes, float(field.range))


def _object_hits(
    scene: Scene, data: mujoco.MjData, gaze: _Gaze, among: Collection[str] | None, *, once: bool
) -> Iterator[int]:
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
    return scene.cached("sight", lambda: _sight_geometry(scene))


def _sight_geometry(scene: Scene) -> _SightGeometry:
    model, owner = scene.model, scene.index.geom_owner
    drawn, static = DRAWN[model.geom_group] > 0, ~moving_geoms(model)
    geoms = np.flatnonzero((owner >= 0) & drawn)
    return _SightGeometry(
        geoms=geoms,
        owners=owner[geoms].astype(np.int64),
        boxes=model.geom_aabb[geoms],
        walls=large_boxes(scene, 0.0),
        person=(owner == -1) & ~static,
    )


@kernel
def _open_rays(
    sight: _SightGeometry, positions: Floats, rotations: Floats, wanted: Mask, gaze: _Gaze
) -> tuple[NDArray[np.int64], Floats]:
    """Return the rays to objects that are inside the field of view and not certainly blocked by a large wall.

    The result is the object index of each ray, shape (k,), in ascending order, and the vectors from the eye
    to points in the object's bounding box, in metres, shape (k, 3). `wanted` (n,) is a mask of objects.
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
            if _in_field(ray, gaze) and not _is_blocked_before(ray, low[i], high[i], gaze.eye, sight):
                owners[count] = i
                count += 1
    return owners[:count], rays[:count]


@kernel
def _bounding_boxes(
    sight: _SightGeometry, positions: Floats, rotations: Floats, wanted: Mask
) -> tuple[Floats, Floats]:
    low, high = np.full((len(wanted), 3), np.inf), np.full((len(wanted), 3), -np.inf)
    for geom, i, box in zip(sight.geoms, sight.owners, sight.boxes):  # noqa: B905 - numba has no `strict`
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
    if ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2 > gaze.range**2:
        return False
    forward = ray[0] * gaze.axes[0, 0] + ray[1] * gaze.axes[0, 1] + ray[2] * gaze.axes[0, 2]
    left = ray[0] * gaze.axes[1, 0] + ray[1] * gaze.axes[1, 1] + ray[2] * gaze.axes[1, 2]
    up = ray[0] * gaze.axes[2, 0] + ray[1] * gaze.axes[2, 1] + ray[2] * gaze.axes[2, 2]
    return bool(abs(left) <= forward * gaze.slopes[0] and abs(up) <= forward * gaze.slopes[1])


@kernel
def _is_blocked_before(ray: Floats, low: Floats, high: Floats, eye: Floats, sight: _SightGeometry) -> bool:
    """Return True if a wall blocks a ray from the eye to the box with corners `low` (3,) and `high` (3,).

    The box is made larger by `MARGIN`, so that rounding errors never block a ray.
    """
    reach = 0.0  # fraction of the ray that is in front of the box
    for k in range(3):
        if ray[k] > MARGIN:
            reach = max(reach, (low[k] - MARGIN - eye[k]) / ray[k])
        elif ray[k] < -MARGIN:
            reach = max(reach, (high[k] + MARGIN - eye[k]) / ray[k])
    return is_blocked(eye, ray, reach, sight.walls, False)
