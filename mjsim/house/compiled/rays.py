"""Cast rays into a compiled model to find the nearest geom or to check a line of sight."""

import math

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Mask of the geom groups that block rays: structure and furniture (0) and invisible collision geoms (3), but
# not ceilings (1), decoration (2) or the person (4).
SOLID = np.array([1, 0, 0, 1, 0, 0], np.uint8)
DRAWN = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # mask of the geom groups that the first-person view shows
RIM = 0.06  # maximum distance between the walls of a receptacle and its volume, in metres
_SKIP = 1e-6  # length by which a ray continues behind an ignored surface, relative to the length of the ray
_MAX_SKIPS = 32


def first_hit(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    start: ArrayLike,
    ray: ArrayLike,
    *,
    groups: NDArray[np.uint8] = SOLID,
    through: Mask | None = None,
    without: int = -1,
    reach: float = math.inf,
) -> tuple[float, int]:
    """Return the distance along a ray to the first geom, and the id of the geom, or (inf, -1) for a miss.

    Args:
        start, ray: Start in metres, and direction, each (3,). Distances are multiples of its length.
        groups: Mask of the geom groups that the ray can hit, shape (6,).
        through: Mask of the geoms that the ray passes through, shape (ngeom,).
        without: Id of a body to ignore, or -1. Unlike with `through`, geoms that touch its surface are found.
        reach: Distance at which the ray ends. Hits beyond this distance may or may not be reported.
    """
    origin, along = np.asarray(start, np.float64), np.asarray(ray, np.float64)
    geom, travelled = np.zeros(1, np.int32), 0.0
    for _ in range(_MAX_SKIPS):
        distance = mujoco.mj_ray(model, data, origin + travelled * along, along, groups, True, without, geom)
        if distance < 0 or travelled > reach:
            break
        travelled += distance
        if through is None or not through[geom[0]]:
            return travelled, int(geom[0])
        travelled += _SKIP
    return math.inf, -1


def moving_geoms(model: mujoco.MjModel) -> Mask:
    return np.asarray(model.body_weldid[model.geom_bodyid] != 0)


def sees(model: mujoco.MjModel, data: mujoco.MjData, eye: Floats, point: Floats) -> bool:
    """Return True if no static solid geom blocks the line between two points (3,), in metres."""
    return first_hit(model, data, eye, point - eye, through=moving_geoms(model), reach=1.0)[0] >= 1.0


def receptacle_in_sight(
    model: mujoco.MjModel, data: mujoco.MjData, eye: Floats, receptacle: ReceptacleGeometry
) -> bool:
    """Return True if the centre or the nearest point of the top of a receptacle is visible from an eye (3,).

    Geoms within the receptacle's outline count as its own rim and do not hide it.
    """
    half, through = receptacle.half_size, moving_geoms(model)
    nearest = np.clip(
        (receptacle.rotation.T @ (eye - receptacle.center))[:2], -0.8 * half[:2], 0.8 * half[:2]
    )
    for at in (np.zeros(2), nearest):
        towards = receptacle.center + receptacle.rotation @ np.array([*at, half[2]]) - eye
        distance, _ = first_hit(model, data, eye, towards, through=through)
        if distance >= 1.0:
            return True
        local = receptacle.rotation.T @ (eye + distance * towards - receptacle.center)
        if np.all(np.abs(local[:2]) <= half[:2] + RIM):
            return True
    return False
