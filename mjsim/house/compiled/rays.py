"""Ray casts into a compiled model: nearest geoms and lines of sight."""

import math

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]

# Groups of colliding geoms: structure and furniture (0) and collision guards (3), without ceilings (1), decoration (2)
# and the person (4).
SOLID = np.array([1, 0, 0, 1, 0, 0], np.uint8)
DRAWN = np.array([1, 1, 1, 0, 0, 0], np.uint8)  # geom groups that the first-person view shows
RIM = 0.06  # Geoms up to this far outside a receptacle's volume count as its own walls, in metres.
_SKIP = 1e-6  # step past a surface that the ray passes through, as a fraction of the ray's length
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
    """Return the distance to the nearest geom along a ray and the geom's id, or infinity and -1 if the ray hits none.

    Args:
        start, ray: Start in metres, and direction, each (3,). Distances are in units of the direction's length.
        groups: Mask of the geom groups to hit, (6,).
        through: Mask of the geoms that the ray passes through, (ngeom,).
        without: Id of a body to ignore, so that geoms touching its surface are found too. -1 for none.
        reach: End of the ray. Hits beyond it may be reported or not.
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
    """Return True if no static solid geom is on the line between two points (3,), in metres."""
    return first_hit(model, data, eye, point - eye, through=moving_geoms(model), reach=1.0)[0] >= 1.0


def receptacle_in_sight(
    model: mujoco.MjModel, data: mujoco.MjData, eye: Floats, receptacle: ReceptacleGeometry
) -> bool:
    """Return True if an eye (3,) sees the centre or the nearest point of the top of a receptacle's volume.

    Geoms within the receptacle's outline count as its own rim, which does not hide it.
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
