"""Which objects a person sees now: rays from the eye, without any rendering.

It stands in for looking: a simulated participant without assistance knows only what came into view.
"""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.model.scene import Scene

SHOWN_GROUPS = (0, 1, 2)  # what the first-person view draws of the house and the objects
PASS = 1e-4  # share of a ray that is skipped to get through a surface of the person
INSET = 0.7  # of the half extents: box corners and face centres of round things are empty
_OFFSETS = np.vstack([np.zeros(3), INSET * np.eye(3), -INSET * np.eye(3)])


@dataclass(frozen=True)
class FieldOfView:
    """How far and how wide a person sees.

    Attributes:
        horizontal: Full angle, rad.
        vertical: Full angle, rad.
        range: How far an object is noticed, m.
    """

    horizontal: float = math.radians(80.0)
    vertical: float = math.radians(65.0)
    range: float = 8.0


def visible_objects(
    scene: Scene,
    data: mujoco.MjData,
    eye: ArrayLike,
    heading: float,
    pitch: float = 0.0,
    *,
    field: FieldOfView | None = None,
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
        field: Field of view; by default 80 by 65 degrees and 8 m.
    """
    field = field or FieldOfView()
    origin = np.array(eye, dtype=np.float64)
    rays = _targets(scene, data) - origin
    inside = _in_field(rays, heading, pitch, field)
    owners, points = np.nonzero(inside)
    if not owners.size:
        return ()
    hits = _first_hits(scene, data, origin, rays[owners, points])
    met = np.where(hits >= 0, scene.index.geom_owner[hits], -1)
    seen = np.unique(owners[met == owners])
    return tuple(scene.index.names[i] for i in seen)


def _first_hits(
    scene: Scene, data: mujoco.MjData, origin: NDArray[np.float64], directions: NDArray[np.float64]
) -> NDArray[np.int32]:
    """Geom that each ray (k, 3) from `origin` meets first, the person's aside; -1 for none; shape (k,)."""
    model, count = scene.model, len(directions)
    groups = np.zeros(mujoco.mjNGROUP, np.uint8)
    groups[list(SHOWN_GROUPS)] = 1
    hits, distances = np.full(count, -1, np.int32), np.empty(count)
    mujoco.mj_multiRay(
        model, data, origin, np.ascontiguousarray(directions).ravel(), groups, True, -1, hits, distances, None,
        count, mujoco.mjMAXVAL,
    )  # fmt: skip
    # What moves and is no object is the person: the hands are drawn, but nobody looks at them.
    person = (scene.index.geom_owner == -1) & (model.body_weldid[model.geom_bodyid] != 0)
    for ray in np.flatnonzero((hits >= 0) & person[hits]):
        gone, geom = distances[ray], hits[ray : ray + 1]
        while geom[0] >= 0 and person[geom[0]]:
            gone += PASS
            start = origin + gone * directions[ray]
            gone += mujoco.mj_ray(model, data, start, directions[ray], groups, True, -1, geom)
    return hits


def _targets(scene: Scene, data: mujoco.MjData) -> NDArray[np.float64]:
    """Points to look at, m, shape (n, 7, 3): in the upright box around each object's shown geoms."""
    model, owner = scene.model, scene.index.geom_owner
    geoms = np.flatnonzero((owner >= 0) & np.isin(model.geom_group, SHOWN_GROUPS))
    rotations = data.geom_xmat[geoms].reshape(-1, 3, 3)
    local = model.geom_aabb[geoms]
    centers = data.geom_xpos[geoms] + np.einsum("gij,gj->gi", rotations, local[:, :3])
    halves = np.einsum("gij,gj->gi", np.abs(rotations), local[:, 3:])
    low = np.full((len(scene.index.names), 3), np.inf)
    high = -low
    np.minimum.at(low, owner[geoms], centers - halves)
    np.maximum.at(high, owner[geoms], centers + halves)
    middle, half = (low + high) / 2, (high - low) / 2
    return np.asarray(middle[:, None] + half[:, None] * _OFFSETS)


def _in_field(
    rays: NDArray[np.float64], heading: float, pitch: float, field: FieldOfView
) -> NDArray[np.bool_]:
    """Which rays (..., 3) end inside the viewing frustum."""
    c, s, cp, sp = math.cos(heading), math.sin(heading), math.cos(pitch), math.sin(pitch)
    forward = rays @ np.array([c * cp, s * cp, sp])
    left = rays @ np.array([-s, c, 0.0])
    up = rays @ np.array([-c * sp, -s * sp, cp])
    return np.asarray(
        (np.abs(left) <= forward * math.tan(field.horizontal / 2))
        & (np.abs(up) <= forward * math.tan(field.vertical / 2))
        & (np.linalg.norm(rays, axis=-1) <= field.range)
    )
