"""Kernels that find free space for carried objects, both now and in the near future.

They look up the clearance at predicted positions of the hand, and move the hand away from geoms that are too
close. For example, a person who carries a box pulls it closer to the body before a door frame.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField, clearance_at
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import CarryingParameters

Floats = NDArray[np.float64]

# Indices into `Rig.pose` and `Rig.motion`.
X, Y, HEADING = 0, 1, 2
FORWARD, LEFT, TURN = 0, 1, 2

LOW, HIGH = 0.93, 1.60  # range of heights of carried objects, in metres
ROUNDS = 3
# Candidate positions of a hand, as fractions of the distance from the body's axis to the posture.
EXTENSIONS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 1.0)


class BodyMotion(NamedTuple):
    """The pose and the command of the body, and the clearance field of the house."""

    pose: Floats  # starts with x, y (metres) and heading (radians), shape (10,) or longer
    command: Floats  # starts with forward and left velocity (m/s) and yaw rate (rad/s), shape (3,) or longer
    clearance: ClearanceField  # clearance at the heights of carried objects


def carry_clearance(scene: Scene) -> ClearanceField:
    """Return the clearance field of a house at the heights of carried objects."""
    return compiled_house(scene.catalogue).cached(
        "carry clearance", lambda: ClearanceField.from_model(scene.model, low=LOW, high=HIGH)
    )


@kernel
def drawn_in(
    forward: float, left: float, radius: float, body: BodyMotion, carrying: CarryingParameters
) -> tuple[float, float]:
    """Return a hand position (forward, left) close to the given one at which the load has enough room.

    First, a sideways shift is tried, for example past a door frame. If it does not help, the hand is pulled
    towards the body's axis until the line from the axis to the hand is clear.
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
