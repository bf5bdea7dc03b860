"""Kernels of picking and placing without physics: the movements of `picking` and `placing`, timed alike."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.fidelity import kinematics
from mjsim.fidelity.body_state import FORWARD, HEADING, LEFT, LOOK, PITCH, TURN, TURN_RATE, VX, VY, X, Y
from mjsim.fidelity.kinematic_steps import (
    BODY,
    HAND_SPEEDS,
    HANDS,
    LIVE,
    KinematicModel,
    Rows,
    tick,
    write_row,
)
from mjsim.fidelity.kinematics import Gait
from mjsim.kernels import kernel
from mjsim.model.avatar import EYE_FORWARD, EYE_HEIGHT
from mjsim.person.hand_path import progress
from mjsim.person.motion_parameters import MotionParameters

Floats = NDArray[np.float64]

_SPEEDS = HAND_SPEEDS - HANDS


class Script(NamedTuple):
    """A motion, worked out before it is played: the state after each of its control steps.

    Attributes:
        live: Rows of `strides`, shape (most, LIVE).
        poses: Poses of the objects, shape (most, n, 7).
    """

    live: Floats
    poses: Floats

    @classmethod
    def empty(cls, most: int, objects: int) -> "Script":
        """Room for `most` control steps."""
        return cls(np.empty((most, LIVE)), np.empty((most, objects, 7)))


@kernel
def turn_step(
    body: Floats, x: float, y: float, z: float, heading: float, tolerance: float, motion: MotionParameters,
    gait: Gait,
) -> bool:  # fmt: skip
    """One decision of `Person.face`: whether the person stands and faces (x, y, z), or the heading unless NaN.

    If not, the commands are set for the next control step; if so, they are those of standing.
    """
    towards = math.atan2(y - body[Y], x - body[X]) if math.isnan(heading) else heading
    error = towards - body[HEADING]
    error = (error + math.pi) % (2.0 * math.pi) - math.pi
    speed = math.sqrt(body[VX] * body[VX] + body[VY] * body[VY])
    if (
        abs(error) < tolerance
        and speed < motion.standing_speed
        and abs(body[TURN_RATE]) < motion.standing_turn_rate
    ):
        body[FORWARD] = body[LEFT] = body[TURN] = 0.0
        return True
    kinematics.brake(body, motion.turn_gain * error if abs(error) > 0.5 * tolerance else 0.0, gait)
    glance(body, x, y, z, motion, gait)
    return False


@kernel
def glance(body: Floats, x: float, y: float, z: float, motion: MotionParameters, gait: Gait) -> None:
    """Move the head's pitch towards a point of the house."""
    out = EYE_FORWARD * math.cos(body[PITCH])
    dx = x - body[X] - out * math.cos(body[HEADING])
    dy = y - body[Y] - out * math.sin(body[HEADING])
    dz = z - EYE_HEIGHT - EYE_FORWARD * math.sin(body[PITCH])
    look_towards(body, math.atan2(dz, math.sqrt(dx * dx + dy * dy)), motion, gait)


@kernel
def look_towards(body: Floats, pitch: float, motion: MotionParameters, gait: Gait) -> None:
    """Move the head's pitch towards an angle, at the pace of a glance."""
    most = motion.look_speed * gait.dt
    change = min(most, max(-most, motion.look_gain * (pitch - body[LOOK])))
    kinematics.look_at(body, body[LOOK] + change, gait)


@kernel
def face(
    live: Floats, poses: Floats, script: Script, row: int, x: float, y: float, z: float, heading: float,
    tolerance: float, most: int, posture: Floats, motion: MotionParameters, house: KinematicModel,
) -> int:  # fmt: skip
    """Stand still and turn, as `Person.face`; returns the next free row of the script."""
    body = live[BODY:HANDS]
    for _ in range(most):
        if turn_step(body, x, y, z, heading, tolerance, motion, house.gait):
            return row
        tick(live, poses, posture, -1, house)
        row = _note(live, poses, script, row)
    body[FORWARD] = body[LEFT] = body[TURN] = 0.0
    return row


@kernel
def swing(
    live: Floats, poses: Floats, script: Script, row: int, hand: int, goal: Floats, in_house: bool, count: int,
    manner: int, look: Floats, posture: Floats, motion: MotionParameters, house: KinematicModel,
) -> int:  # fmt: skip
    """Move a hand in `count` control steps to a goal in the frame of the house or of the body, (3,) m.

    The person glances at the point `look`, (3,) m, or looks at the pitch that it ends in where it begins with NaN.
    Returns the next free row of the script.
    """
    body, first = live[BODY:HANDS], HANDS + 3 * hand
    start_f, start_l, start_u = live[first], live[first + 1], live[first + 2]
    goal_f, goal_l, goal_u = goal[0], goal[1], goal[2]
    live[first + _SPEEDS : first + _SPEEDS + 3] = 0.0  # it begins and ends at rest
    for k in range(1, count + 1):
        if in_house:
            c, s = math.cos(body[HEADING]), math.sin(body[HEADING])
            dx, dy = goal[0] - body[X], goal[1] - body[Y]
            goal_f, goal_l = c * dx + s * dy, c * dy - s * dx
        across, up = progress(k / count, manner, motion.lead)
        live[first] = start_f + across * (goal_f - start_f)
        live[first + 1] = start_l + across * (goal_l - start_l)
        live[first + 2] = start_u + up * (goal_u - start_u)
        if math.isnan(look[0]):
            look_towards(body, look[2], motion, house.gait)
        else:
            glance(body, look[0], look[1], look[2], motion, house.gait)
        tick(live, poses, posture, hand, house)
        row = _note(live, poses, script, row)
    return row


@kernel
def let_go(
    live: Floats, poses: Floats, script: Script, row: int, hand: int, fall: Floats, pitch: float,
    posture: Floats, motion: MotionParameters, house: KinematicModel,
) -> int:  # fmt: skip
    """Withdraw a hand upwards, then to its rest, while objects fall: their poses are `fall`, (k, n, 7)."""
    first = HANDS + 3 * hand
    for k in range(len(fall)):
        goal = live[first : first + 3].copy()
        if k < motion.withdraw_steps:
            goal[2] += motion.withdraw_step
        poses[:] = fall[k]
        look_towards(live[BODY:HANDS], pitch, motion, house.gait)
        if k < motion.withdraw_steps:
            live[first : first + 3] = goal
            tick(live, poses, posture, hand, house)
        else:
            tick(live, poses, posture, -1, house)
        row = _note(live, poses, script, row)
    return row


@kernel
def end(live: Floats, poses: Floats, script: Script, row: int, posture: Floats, house: KinematicModel) -> int:
    """The control step in which a motion has ended: the hands go to their postures."""
    live[HAND_SPEEDS : HAND_SPEEDS + 6] = 0.0
    tick(live, poses, posture, -1, house)
    return _note(live, poses, script, row)


@kernel
def play_rows(script: Script, start: int, end: int, live: Floats, poses: Floats, rows: Rows) -> None:
    """Take the state through rows of a script."""
    for row in range(start, end):
        live[:] = script.live[row]
        poses[:] = script.poses[row]
        write_row(row - start, live, poses, rows)


@kernel
def _note(live: Floats, poses: Floats, script: Script, row: int) -> int:
    script.live[row] = live
    script.poses[row] = poses
    return row + 1
