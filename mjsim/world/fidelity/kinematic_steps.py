"""Kernels that compute kinematic control steps of the body, the hands and the held objects."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField, Floor
from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import CarryingParameters
from mjsim.values.observation import StepStates
from mjsim.world.body.load_room import BodyMotion
from mjsim.world.body.postures import Contacts, Hands, Holding, update_hands
from mjsim.world.body.rig import BODY_SIZE, FORWARD, HEADING, PITCH, X, Y
from mjsim.world.fidelity import kinematics
from mjsim.world.fidelity.kinematics import Gait
from mjsim.world.walking.path_following import ARRIVED, BLOCKED, CHANGED, Walk, later_step, next_step

Floats = NDArray[np.float64]

# Indices into `KinematicState.vector`.
TIME = 0  # simulated time in seconds
BODY = 1  # body state, with the layout of `mjsim.world.body.rig`
HANDS = BODY + BODY_SIZE  # positions of both hands in the body frame, in metres
HAND_SPEEDS = HANDS + 6  # velocities of the hands in m/s
GRASPS = HAND_SPEEDS + 6  # for each hand, 2 * object index + grip index, or -1 if the hand is empty
STATE_SIZE = GRASPS + 2

REST, CARRY, TUCKED, ASIDE = 0, 1, 2, 3  # rows of `KinematicModel.postures`

_PRIME = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(29)
_NO_GEOMS, _NO_FRAMES, _NO_OWNERS = np.zeros((0, 2), np.int32), np.zeros((0, 9)), np.zeros(0, np.int32)


class KinematicState(NamedTuple):
    """The state of a kinematic world, which kernels modify in place."""

    vector: Floats  # time, body, hands and grasps, shape (STATE_SIZE,)
    poses: Floats  # poses (metres and wxyz) of the objects, shape (n, 7)


class KinematicModel(NamedTuple):
    """The constants of a kinematic world."""

    gait: Gait  # movement limits and servo parameters of the body
    floor: Floor  # outlines of the obstacles to the trunk
    grips: Floats  # pose of each object relative to the holding hand, for each grip, shape (n, 2, 7)
    loads: Floats  # radius and downward extent of each object, measured from its grip in metres, shape (n, 2)
    posture_pace: Floats  # see `Hands.pace`, shape (3,)
    carrying: CarryingParameters
    # Positions of the left hand in metres, shape (4, 3): empty (`REST`), or loaded while the person walks
    # (`CARRY`), turns (`TUCKED`) or reaches with the other hand (`ASIDE`).
    postures: Floats
    clearance: ClearanceField  # clearance at the heights of carried objects
    timestep: float  # physics timestep in seconds
    compliance: Floats  # see `Hands.compliance`; always 0, because there are no contacts
    goals: Floats  # buffer for `Hands.goals`


@kernel
def walk_rows(moves: Floats, state: KinematicState, model: KinematicModel, rows: StepStates) -> None:
    """Execute one control step per row of `moves` (n, 4): forward and left (m/s), turn and look (rad/s)."""
    body = state.vector[BODY:HANDS]
    for row in range(len(moves)):
        kinematics.command(body, moves[row, 0], moves[row, 1], moves[row, 2], moves[row, 3], model.gait)
        control_step(state, CARRY, -1, model)
        write_row(row, state, rows)


@kernel
def follow_rows(
    walk: Walk,
    progress: Floats,
    state: KinematicState,
    model: KinematicModel,
    moves: Floats,
    rows: StepStates,
) -> tuple[int, int]:
    """Walk along a path until the walk has to stop. Store the moves (n, 4) and the state after each step.

    Returns the number of control steps, at most n, and the latest phase of the walk.
    """
    body, count = state.vector[BODY:HANDS], 0
    while True:
        x, y, heading, time = body[X], body[Y], body[HEADING], state.vector[TIME]
        if count == 0:
            phase, forward, left, turn = next_step(walk, x, y, heading, time, progress)
        else:
            phase, forward, left, turn = later_step(walk, x, y, heading, time, progress)
        if phase in (ARRIVED, CHANGED):
            return count, phase
        moves[count, 0], moves[count, 1], moves[count, 2], moves[count, 3] = forward, left, turn, 0.0
        kinematics.command(body, forward, left, turn, 0.0, model.gait)
        control_step(state, CARRY, -1, model)
        write_row(count, state, rows)
        count += 1
        if phase == BLOCKED or count == len(moves):
            return count, phase


@kernel
def control_step(state: KinematicState, posture: int, moving: int, model: KinematicModel) -> None:
    """Execute a control step with the current commands.

    `posture` is the row of `KinematicModel.postures` for loaded hands. `moving` is the hand whose position
    remains unchanged, or -1.
    """
    vector = state.vector
    body = vector[BODY:HANDS]
    targets, speeds = vector[HANDS:HAND_SPEEDS].reshape(2, 3), vector[HAND_SPEEDS:GRASPS].reshape(2, 3)
    update_hands(
        BodyMotion(body, body[FORWARD:], model.clearance),
        Hands(
            targets,
            speeds,
            model.compliance,
            model.goals,
            model.postures[REST],
            model.loads,
            model.posture_pace,
        ),
        model.carrying,
        Holding(held_in(vector, 0), held_in(vector, 1), moving, model.postures[posture]),
        Contacts(_NO_GEOMS, _NO_FRAMES, _NO_OWNERS),
        model.gait.dt,
    )
    kinematics.advance(body, model.gait, model.floor)
    # Add the timesteps one by one, so that the time is bit-identical to that of the physics.
    for _ in range(model.gait.substeps):
        vector[TIME] += model.timestep
    carry(state, model)


@kernel
def held_in(vector: Floats, hand: int) -> int:
    """Return the index of the object in a hand, or -1. `vector` is `KinematicState.vector`."""
    grasp = int(vector[GRASPS + hand])
    return grasp // 2 if grasp >= 0 else -1


@kernel
def carry(state: KinematicState, model: KinematicModel) -> None:
    vector = state.vector
    heading = vector[BODY + HEADING]
    half = 0.5 * heading
    c, s = math.cos(heading), math.sin(heading)
    ch, sh = math.cos(half), math.sin(half)
    for hand in range(2):
        grasp = int(vector[GRASPS + hand])
        if grasp < 0:
            continue
        grip = model.grips[grasp // 2, grasp % 2]
        pose = state.poses[grasp // 2]
        first = HANDS + 3 * hand
        forward, left = vector[first] + grip[0], vector[first + 1] + grip[1]
        pose[0] = vector[BODY + X] + c * forward - s * left
        pose[1] = vector[BODY + Y] + s * forward + c * left
        pose[2] = vector[first + 2] + grip[2]
        pose[3] = ch * grip[3] - sh * grip[6]
        pose[4] = ch * grip[4] - sh * grip[5]
        pose[5] = ch * grip[5] + sh * grip[4]
        pose[6] = ch * grip[6] + sh * grip[3]


@kernel
def write_row(row: int, state: KinematicState, rows: StepStates) -> None:
    vector = state.vector
    rows.time[row] = vector[TIME]
    rows.position[row, 0], rows.position[row, 1] = vector[BODY + X], vector[BODY + Y]
    rows.heading[row], rows.pitch[row] = vector[BODY + HEADING], vector[BODY + PITCH]
    rows.object_position[row] = state.poses[:, :3]
    rows.object_quaternion[row] = state.poses[:, 3:]
    rows.state_hash[row] = state_hash(state)
    # Held objects are aligned exactly with the hands, and there are no contacts.
    rows.health[row, :2], rows.health[row, 6] = 0.0, math.nan
    for hand in range(2):
        error = 0.0 if vector[GRASPS + hand] >= 0.0 else math.nan
        rows.health[row, 2 + hand] = rows.health[row, 4 + hand] = error


@kernel
def state_hash(state: KinematicState) -> np.uint64:
    digest = np.uint64(0)
    for word in state.vector.view(np.uint64):
        digest = (digest ^ word) * _PRIME
        digest ^= digest >> _SHIFT
    # Compute four independent hashes, which the processor can do in parallel.
    words = state.poses.reshape(state.poses.size).view(np.uint64)
    lanes = np.array([1, 2, 3, 4], np.uint64)
    for i in range(len(words)):
        lanes[i % 4] = (lanes[i % 4] ^ words[i]) * _PRIME
        lanes[i % 4] ^= lanes[i % 4] >> _SHIFT
    for lane in lanes:
        digest = (digest ^ lane) * _PRIME
        digest ^= digest >> _SHIFT
    return digest
