"""Ray casts against the compiled model: the nearest geom, and lines of sight."""

import math
from collections.abc import Collection

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.model.receptacles import ReceptacleGeometry

# What collides: structure and furniture (0), collision guards (3); not ceilings (1), decoration (2) or the person (4).
SOLID = np.array([1, 0, 0, 1, 0, 0], np.uint8)
_MAX_SKIPS = 32
_RIM = 0.06  # m, from a receptacle's volume to the outside of its walls


def first_hit(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    start: ArrayLike,
    direction: ArrayLike,
    *,
    ignore: Collection[int] = (),
    static_only: bool = False,
    reach: float = math.inf,
) -> tuple[float, int]:
    """Nearest solid geom along a ray.

    Args:
        model: Compiled scene.
        data: State; positions are those of the last physics step.
        start: Start (3,), m.
        direction: Direction (3,); distances are in units of its length.
        ignore: Body ids that the ray passes through.
        static_only: Whether it passes through everything that can move.
        reach: Where the ray ends; what lies farther may be reported or not.

    Returns:
        Distance and geom id; infinity and -1 when nothing is hit.
    """
    origin = np.array(start, np.float64)
    along = np.array(direction, np.float64)
    geom = np.zeros(1, np.int32)
    travelled = 0.0
    excluded = next(iter(ignore)) if len(ignore) == 1 else -1
    for _ in range(_MAX_SKIPS):
        distance = mujoco.mj_ray(model, data, origin + travelled * along, along, SOLID, 1, excluded, geom)
        if distance < 0:
            break
        travelled += distance
        body = int(model.geom_bodyid[geom[0]])
        if body not in ignore and not (static_only and model.body_weldid[body] != 0):
            return travelled, int(geom[0])
        travelled += 1e-6
        if travelled > reach:
            break
    return float("inf"), -1


def sees(
    model: mujoco.MjModel, data: mujoco.MjData, eye: NDArray[np.float64], point: NDArray[np.float64]
) -> bool:
    """Whether nothing static lies between two points (3,), m."""
    distance, _ = first_hit(model, data, eye, point - eye, static_only=True, reach=1.0)
    return distance >= 1.0


def receptacle_in_sight(
    model: mujoco.MjModel, data: mujoco.MjData, eye: NDArray[np.float64], receptacle: ReceptacleGeometry
) -> bool:
    """Whether the top of a receptacle's volume is visible from an eye (3,), m, at its middle or at the nearest point.

    The receptacle's own rim does not hide it: a geom within its outline is taken to be part of it.
    """
    half = receptacle.half_size
    nearest = np.clip(
        (receptacle.rotation.T @ (eye - receptacle.center))[:2], -0.8 * half[:2], 0.8 * half[:2]
    )
    for at in (np.zeros(2), nearest):
        towards = receptacle.center + receptacle.rotation @ np.array([*at, half[2]]) - eye
        distance, _ = first_hit(model, data, eye, towards, static_only=True)
        if distance >= 1.0:
            return True
        local = receptacle.rotation.T @ (eye + distance * towards - receptacle.center)
        if np.all(np.abs(local[:2]) <= half[:2] + _RIM):
            return True
    return False
