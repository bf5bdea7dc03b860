"""Kernels for the movements of hands and body during kinematic picks and places."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import MotionParameters
from mjsim.values.observation import StepStates
from mjsim.world.body.motion_profiles import progress
from mjsim.world.body.rig import (
    FORWARD,
    HEADING,
    LEFT,
    LOOK,
    PITCH,
    TURN,
    TURN_RATE,
    VX,
    VY,
    X,
    Y,
)
from mjsim.world.fidelity import kinematics
from mjsim.world.fidelity.kinematic_steps import (
    ASIDE,
    BODY,
    CARRY,
    HAND_SPEEDS,
    HANDS,
    STATE_SIZE,
    TUCKED,
    KinematicModel,
    KinematicState,
    control_step,
    write_row,
)
from mjsim.world.fidelity.kinematics import Gait

Floats = NDArray[np.float64]


class MotionTrajectory(NamedTuple):
    """The states of a planned motion after each control step."""

    vectors: Floats  # `KinematicState.vector` after each step, shape (capacity, STATE_SIZE)
    poses: Floats  # poses of the objects (metres and wxyz) after each step, shape (capacity, n, 7)
    length: NDArray[np.int64]  # number of stored control steps, shape (1,)

    @classmethod
    def empty(cls, max_steps: int, objects: int) -> "MotionTrajectory":
        return cls(
            np.empty((max_steps, STATE_SIZE)), np.empty((max_steps, objects, 7)), np.zeros(1, np.int64)
        )

    def longer(self, steps: int) -> "MotionTrajectory":
        """Return a copy with capacity for at least `steps` more control steps."""
        size, objects = len(self.vectors) + max(steps, len(self.vectors)), self.poses.shape[1]
        longer, length = MotionTrajectory.empty(size, objects), int(self.length[0])
        longer.vectors[:length], longer.poses[:length] = self.vectors[:length], self.poses[:length]
        longer.length[0] = length
        return longer


class HandMovement(NamedTuple):
    """A movement of a hand to a goal, and the direction in which the person looks during it."""

    hand: int
    goal: Floats  # final position in metres, shape (3,)
    in_house: bool  # True if the goal is in the house frame, False if it is in the body frame
    steps: int  # number of control steps
    order: int  # `STRAIGHT`, `ACROSS_FIRST` or `UP_FIRST`, from `mjsim.world.body.motion_profiles`
    gaze: Floats  # point (3,) in the house to look at, or (NaN, NaN, pitch in radians)


@kernel
def _append(trajectory: MotionTrajectory, state: KinematicState) -> None:
    row = trajectory.length[0]
    trajectory.vectors[row] = state.vector
    trajectory.poses[row] = state.poses
    trajectory.length[0] = row + 1


@kernel
def play_rows(
    trajectory: MotionTrajectory, start: int, end: int, state: KinematicState, rows: StepStates
) -> None:
    for row in range(start, end):
        state.vector[:] = trajectory.vectors[row]
        state.poses[:] = trajectory.poses[row]
        write_row(row - start, state, rows)


@kernel
def face(
    state: KinematicState,
    trajectory: MotionTrajectory,
    point: Floats,
    heading: float,
    tolerance: float,
    max_steps: int,
    motion: MotionParameters,
    model: KinematicModel,
) -> None:
    """Stop and turn to a point (3,), or to `heading` if it is not NaN."""
    body = state.vector[BODY:HANDS]
    for _ in range(max_steps):
        if _turn(body, point, heading, tolerance, motion, model.gait):
            return
        control_step(state, TUCKED, -1, model)
        _append(trajectory, state)
    body[FORWARD] = body[LEFT] = body[TURN] = 0.0


@kernel
def _turn(
    body: Floats, point: Floats, heading: float, tolerance: float, motion: MotionParameters, gait: Gait
) -> bool:
    towards = math.atan2(point[1] - body[Y], point[0] - body[X]) if math.isnan(heading) else heading
    error = towards - body[HEADING]
    error = (error + math.pi) % (2.0 * math.pi) - math.pi
    speed = math.sqrt(body[VX] * body[VX] + body[VY] * body[VY])
    standing = speed < motion.standing_speed and abs(body[TURN_RATE]) < motion.standing_turn_rate
    if abs(error) < tolerance and standing:
        body[FORWARD] = body[LEFT] = body[TURN] = 0.0
        return True
    kinematics.brake(body, motion.turn_gain * error if abs(error) > 0.5 * tolerance else 0.0, gait)
    _glance(body, point, motion, gait)
    return False


@kernel
def _glance(body: Floats, point: Floats, motion: MotionParameters, gait: Gait) -> None:
    out = gait.eye_forward * math.cos(body[PITCH])
    dx = point[0] - body[X] - out * math.cos(body[HEADING])
    dy = point[1] - body[Y] - out * math.sin(body[HEADING])
    dz = point[2] - gait.eye_height - gait.eye_forward * math.sin(body[PITCH])
    _look_towards(body, math.atan2(dz, math.sqrt(dx * dx + dy * dy)), motion, gait)


@kernel
def _look_towards(body: Floats, pitch: float, motion: MotionParameters, gait: Gait) -> None:
    limit = motion.look_speed * gait.dt
    change = min(limit, max(-limit, motion.look_gain * (pitch - body[LOOK])))
    kinematics.look_at(body, body[LOOK] + change, gait)


@kernel
def move_hand(
    state: KinematicState,
    trajectory: MotionTrajectory,
    movement: HandMovement,
    motion: MotionParameters,
    model: KinematicModel,
) -> None:
    vector, goal = state.vector, movement.goal
    body, first = vector[BODY:HANDS], HANDS + 3 * movement.hand
    start_f, start_l, start_u = vector[first], vector[first + 1], vector[first + 2]
    goal_f, goal_l, goal_u = goal[0], goal[1], goal[2]
    speeds = HAND_SPEEDS + 3 * movement.hand
    vector[speeds : speeds + 3] = 0.0
    for k in range(1, movement.steps + 1):
        if movement.in_house:
            c, s = math.cos(body[HEADING]), math.sin(body[HEADING])
            dx, dy = goal[0] - body[X], goal[1] - body[Y]
            goal_f, goal_l = c * dx + s * dy, c * dy - s * dx
        across, up = progress(k / movement.steps, movement.order, motion.lead)
        vector[first] = start_f + across * (goal_f - start_f)
        vector[first + 1] = start_l + across * (goal_l - start_l)
        vector[first + 2] = start_u + up * (goal_u - start_u)
        if math.isnan(movement.gaze[0]):
            _look_towards(body, movement.gaze[2], motion, model.gait)
        else:
            _glance(body, movement.gaze, motion, model.gait)
        control_step(state, ASIDE, movement.hand, model)
        _append(trajectory, state)


@kernel
def withdraw(
    state: KinematicState,
    trajectory: MotionTrajectory,
    hand: int,
    poses: Floats,
    pitch: float,
    motion: MotionParameters,
    model: KinematicModel,
) -> None:
    """Raise a hand and move it to its rest posture, with one control step per row of `poses` (k, n, 7).

    Meanwhile, the head returns to `pitch` (radians).
    """
    first = HANDS + 3 * hand
    for k in range(len(poses)):
        goal = state.vector[first : first + 3].copy()
        if k < motion.withdraw_steps:
            goal[2] += motion.withdraw_step
        state.poses[:] = poses[k]
        _look_towards(state.vector[BODY:HANDS], pitch, motion, model.gait)
        if k < motion.withdraw_steps:
            state.vector[first : first + 3] = goal
            control_step(state, ASIDE, hand, model)
        else:
            control_step(state, ASIDE, -1, model)
        _append(trajectory, state)


@kernel
def end(state: KinematicState, trajectory: MotionTrajectory, model: KinematicModel) -> None:
    """Append the first control step after a motion, in which the hands move towards their postures."""
    state.vector[HAND_SPEEDS : HAND_SPEEDS + 6] = 0.0
    control_step(state, CARRY, -1, model)
    _append(trajectory, state)
