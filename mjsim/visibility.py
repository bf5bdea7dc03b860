"""Which objects a person sees now: rays from the eye, without any rendering.

It stands in for looking: a simulated participant without assistance knows only what came into view.
"""

import math
from collections.abc import Collection
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.model.drawn_state import drawn_state
from mjsim.model.scene import Scene
from mjsim.person_parameters import PersonParameters
from mjsim.sight_lines import OFFSETS, Gaze, SightGeometry, open_rays

DRAWN_GROUPS = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # what the first-person view draws
SKIP = 1e-4  # share of a ray that is skipped to get through a surface of the person
MIN_WALL = 0.25  # m, half extents of the boxes that are tested before any ray is cast


@dataclass(frozen=True)
class FieldOfView:
    """How far and how wide a person sees.

    Attributes:
        horizontal: Full angle, rad.
        vertical: Full angle, rad.
        range: How far an object is noticed, m.
    """

    horizontal: float
    vertical: float
    range: float

    @classmethod
    def of(cls, person: PersonParameters) -> "FieldOfView":
        """What a person sees in a picture of 4:3."""
        return cls(person.field_of_view, person.vertical_field, person.viewing_distance)


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
    own body does not.

    Args:
        scene: The composed episode.
        data: Its state, with geom poses up to date.
        eye: Eye position, m, shape (3,).
        heading: Yaw of the gaze, rad, 0 along +x, counter-clockwise.
        pitch: Elevation of the gaze, rad, positive upwards.
        field: Field of view; None for that of the scene's person.
        among: Instance names to look for; None for all. The fewer, the quicker.
    """
    seen: set[int] = set()
    names = scene.index.names
    rays = _rays(scene, data, eye, heading, pitch, field=field, among=among)
    for owner, ray in zip(rays.owners.tolist(), rays.vectors, strict=True):
        if owner not in seen and rays.reaches(owner, ray):
            seen.add(owner)
    return tuple(names[i] for i in sorted(seen))


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
    """How much is seen of each object in view, as the share of its seven rays that reach it: 0 < share <= 1.

    Args:
        scene: As in `visible_objects`, and so are the other arguments.
        data: Its state.
        eye: Eye position, m, shape (3,).
        heading: Yaw of the gaze, rad.
        pitch: Elevation of the gaze, rad.
        field: Field of view; None for that of the scene's person.
        among: Instance names to look for; None for all.
    """
    rays = _rays(scene, data, eye, heading, pitch, field=field, among=among)
    hits = [o for o, ray in zip(rays.owners.tolist(), rays.vectors, strict=True) if rays.reaches(o, ray)]
    return {scene.index.names[i]: hits.count(i) / len(OFFSETS) for i in sorted(set(hits))}


@dataclass(frozen=True, eq=False)
class _Rays:
    """Rays from the eye to objects, none of them certainly behind a wall.

    Attributes:
        scene: The composed episode.
        data: Its state.
        eye: m, (3,).
        owners: Object of each ray, by its place in the episode's order, (k,).
        vectors: From the eye, m, (k, 3).
        person: Which geoms belong to the person, (ngeom,).
    """

    scene: Scene
    data: mujoco.MjData
    eye: NDArray[np.float64]
    owners: NDArray[np.int64]
    vectors: NDArray[np.float64]
    person: NDArray[np.bool_]

    def reaches(self, owner: int, ray: NDArray[np.float64]) -> bool:
        """Whether a ray (3,) meets its object before anything else."""
        geom, _ = first_hit(self.scene.model, self.data, self.eye, ray, self.person)
        return geom >= 0 and bool(self.scene.index.geom_owner[geom] == owner)


def _rays(
    scene: Scene,
    data: mujoco.MjData,
    eye: ArrayLike,
    heading: float,
    pitch: float,
    *,
    field: FieldOfView | None,
    among: Collection[str] | None,
) -> _Rays:
    scene, data = drawn_state(scene, data)
    sight = _sight(scene)
    names = scene.index.names
    looked_for = frozenset(names if among is None else among)
    wanted = np.array([name in looked_for for name in names], np.bool_)
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field or FieldOfView.of(scene.person))
    owners, vectors = open_rays(sight, data.geom_xpos, data.geom_xmat, wanted, gaze)
    return _Rays(scene, data, gaze.eye, owners, vectors, sight.person)


def in_field_of_view(
    points: ArrayLike, eye: ArrayLike, heading: float, pitch: float, field: FieldOfView
) -> NDArray[np.bool_]:
    """Which points are inside the field of view, however far away and whatever stands in between; shape (n,).

    Args:
        points: House frame, m, shape (n, 3).
        eye: Eye position, m, shape (3,).
        heading: Yaw of the gaze, rad, 0 along +x, counter-clockwise.
        pitch: Elevation of the gaze, rad, positive upwards.
        field: Field of view, whose range does not count.
    """
    gaze = _gaze(np.array(eye, dtype=np.float64), heading, pitch, field)
    forward, left, up = gaze.axes @ (np.reshape(points, (-1, 3)) - gaze.eye).T
    return np.asarray((np.abs(left) <= forward * gaze.slopes[0]) & (np.abs(up) <= forward * gaze.slopes[1]))


def persons_geoms(scene: Scene) -> NDArray[np.bool_]:
    """Which geoms belong to the person, shape (ngeom,)."""
    return _sight(scene).person


def first_hit(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    eye: NDArray[np.float64],
    ray: NDArray[np.float64],
    person: NDArray[np.bool_],
) -> tuple[int, float]:
    """Geom that a ray (3,), m, from the eye (3,) meets first, -1 for none, and where, as a share of the ray's length.

    It passes through the geoms of the person (ngeom,): the hands are drawn, but hide nothing from the person.
    """
    geom = np.full(1, -1, np.int32)
    distance = mujoco.mj_ray(model, data, eye, ray, DRAWN_GROUPS, True, -1, geom)
    while geom[0] >= 0 and person[geom[0]]:
        distance += SKIP
        distance += mujoco.mj_ray(model, data, eye + distance * ray, ray, DRAWN_GROUPS, True, -1, geom)
    return int(geom[0]), float(distance)


def _sight(scene: Scene) -> SightGeometry:
    return scene.once("sight", lambda: _sight_geometry(scene))


def _sight_geometry(scene: Scene) -> SightGeometry:
    model, owner = scene.model, scene.index.geom_owner
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    drawn = DRAWN_GROUPS[model.geom_group] > 0
    static = model.body_weldid[model.geom_bodyid] == 0
    geoms = np.flatnonzero((owner >= 0) & drawn)
    alpha = model.geom_rgba[:, 3].copy()  # a ray passes through what is fully transparent
    textured = model.geom_matid >= 0
    alpha[textured] *= model.mat_rgba[model.geom_matid[textured], 3]
    extents = np.sort(model.geom_size, axis=1)
    large = (model.geom_type == mujoco.mjtGeom.mjGEOM_BOX) & (extents[:, 1] >= MIN_WALL)
    walls = np.flatnonzero(large & static & drawn & (alpha > 0))
    walls = walls[np.argsort(-extents[walls, 1] * extents[walls, 2], kind="stable")]
    return SightGeometry(
        geoms=geoms,
        owners=owner[geoms].astype(np.int64),
        boxes=model.geom_aabb[geoms],
        wall_centers=data.geom_xpos[walls],
        wall_axes=data.geom_xmat[walls].reshape(-1, 3, 3),
        wall_half_sizes=model.geom_size[walls],
        person=(owner == -1) & ~static,
    )


def _gaze(eye: NDArray[np.float64], heading: float, pitch: float, field: FieldOfView) -> Gaze:
    c, s, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
    axes = np.array([[c * cp, s * cp, sp], [-s, c, 0.0], [-c * sp, -s * sp, cp]])
    slopes = np.array([math.tan(field.horizontal / 2), math.tan(field.vertical / 2)])
    return Gaze(eye, axes, slopes, float(field.range))
