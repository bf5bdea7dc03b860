"""Free space for carried loads, now and in the near future.

The kernels look up the clearance where the hand will be soon, and move the hand away from geoms that are too near. For
example, a person draws in a box when passing a door frame.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField, clearance_at
from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import CarryingParameters

Floats = NDArray[np.float64]

# Indices into `Rig.pose` and `Rig.motion`.
X, Y, HEADING = 0, 1, 2
FORWARD, LEFT, TURN = 0, 1, 2

ROUNDS = 3
# Candidate positions of a hand, as fractions of the way from the body's axis to the posture.
EXTENSIONS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 1.0)


class BodyMotion(NamedTuple):
    """Pose and command of the body, and the clearance around it."""

    pose: Floats  # starts with x, y (metres) and heading (radians), shape (10,) or longer
    command: Floats  # starts with the forward and left velocity (m/s) and the yaw rate (rad/s), shape (3,) or longer
    clearance: ClearanceField  # clearance at the heights of carried objects


@kernel
def drawn_in(
    forward: float, left: float, radius: float, body: BodyMotion, carrying: CarryingParameters
) -> tuple[float, float]:
    """Return the (forward, left) position closest to a posture where a load is clear of the house, now and soon.

    The kernel tries a sideways shift first, such as past a door frame. Otherwise it chooses a point between the body's
    axis and the posture, as far out as the line from the axis is clear, because the far side of a wall is out of reach.
    """
    needed = radius + carrying.margin
    shift_f, shift_l = _sideways(forward, left, needed, body, carrying)
    forward, left = forward + shift_f, left + shift_l
    if _clear_throughout(forward, left, needed, body, carrying):
        return forward, left
    best_f, best_l, best_room, before = 0.0, 0.0, -math.inf, -math.inf
    for share in EXTENSIONS:
        at_f, at_l = share * forward, share * left
        room = math.inf
        for horizon in (0.0, carrying.near, carrying.far):
            there, _, _ = _room(at_f, at_l, horizon, body)
            room = min(room, there)
        room -= radius
        clear = room >= 0.5 * carrying.margin
        if not clear and room < before:
            break
        if clear or room > best_room:
            best_f, best_l, best_room = at_f, at_l, room
        before = room
    return best_f, best_l


@kernel
def _clear_throughout(
    forward: float, left: float, needed: float, body: BodyMotion, carrying: CarryingParameters
) -> bool:
    length = math.sqrt(forward * forward + left * left)
    for horizon in (0.0, carrying.near, carrying.far):
        axis, _, _ = _room(0.0, 0.0, horizon, body)
        there, _, _ = _room(forward, left, horizon, body)
        if min(axis, there, 0.5 * (axis + there - length)) < needed:
            return False
    return True


@kernel
def _sideways(
    forward: float, left: float, needed: float, body: BodyMotion, carrying: CarryingParameters
) -> tuple[float, float]:
    shift_f, shift_l = 0.0, 0.0
    for horizon in (0.0, carrying.near, carrying.far):
        for _ in range(ROUNDS):
            room, away_f, away_l = _room(forward + shift_f, left + shift_l, horizon, body)
            if room >= needed:
                break
            shift_f += (needed - room) * away_f
            shift_l += (needed - room) * away_l
    size = math.hypot(shift_f, shift_l)
    limit = min(1.0, carrying.most_shift / size) if size > 0.0 else 1.0
    return shift_f * limit, shift_l * limit


@kernel
def _room(forward: float, left: float, horizon: float, body: BodyMotion) -> tuple[float, float, float]:
    pose, command = body.pose, body.command
    forward += command[FORWARD] * horizon
    left += command[LEFT] * horizon
    heading = pose[HEADING] + command[TURN] * horizon
    c, s = math.cos(heading), math.sin(heading)
    x, y = pose[X] + c * forward - s * left, pose[Y] + s * forward + c * left
    room, away_x, away_y = clearance_at(x, y, body.clearance)
    return room, c * away_x + s * away_y, c * away_y - s * away_x
