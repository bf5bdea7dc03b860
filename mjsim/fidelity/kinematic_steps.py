"""Kernels of control steps without physics: the body walks, the hands keep their posture, held objects move along."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.fidelity import kinematics
from mjsim.fidelity.body_state import BODY_SIZE, FORWARD, HEADING, PITCH, X, Y
from mjsim.fidelity.kinematics import Gait
from mjsim.fidelity.trunk_contact import Floor
from mjsim.kernels import kernel
from mjsim.model.clearance import ClearanceField
from mjsim.motion_parameters import CarryingParameters
from mjsim.person.load_room import BodyMotion
from mjsim.person.postures import Contacts, Hands, Holding, update_hands
from mjsim.rollout import RolloutArrays

Floats = NDArray[np.float64]

# Layout of `KinematicState.vector`.
TIME = 0  # s
BODY = 1  # the body of `mjsim.fidelity.kinematics`
HANDS = BODY + BODY_SIZE  # both hands in the body frame, m
HAND_SPEEDS = HANDS + 6  # m/s
GRASPS = HAND_SPEEDS + 6  # per hand: 2 * object + grip, or -1
STATE_SIZE = GRASPS + 2

REST, CARRY, TUCKED, ASIDE = 0, 1, 2, 3  # rows of `KinematicModel.postures`

_PRIME = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(29)
_NO_GEOMS, _NO_FRAMES, _NO_OWNERS = np.zeros((0, 2), np.int32), np.zeros((0, 9)), np.zeros(0, np.int32)


class KinematicState(NamedTuple):
    """Everything that changes from control step to control step; kernels change it in place.

    Attributes:
        vector: Time, body, hands and grasps, shape (STATE_SIZE,).
        poses: Poses of the objects, m and wxyz, shape (n, 7).
    """

    vector: Floats
    poses: Floats


class KinematicModel(NamedTuple):
    """Everything that stays the same.

    Attributes:
        gait: Limits and servos of the body.
        floor: Outlines that the trunk meets.
        grips: Pose of an object in the frame of the hand that holds it, by object and grip, shape (n, 2, 7).
        loads: How far each object reaches sideways and down about its grip, m, shape (n, 2).
        posture_pace: As `Hands.pace`, shape (3,).
        carrying: How the person carries.
        postures: Where an empty left hand belongs (`REST`), and one that holds something while walking (`CARRY`),
            turning (`TUCKED`) or when the other hand reaches (`ASIDE`), m, shape (4, 3).
        clearance: Clearance at the heights of carried objects.
        timestep: Of the physics, s.
        compliance: Compliance offsets of the hands, which touch nothing: all 0, m, shape (2, 2).
        goals: Scratch space for the goals of the hands, m, shape (2, 3).
    """

    gait: Gait
    floor: Floor
    grips: Floats
    loads: Floats
    posture_pace: Floats
    carrying: CarryingParameters
    postures: Floats
    clearance: ClearanceField
    timestep: float
    compliance: Floats
    goals: Floats


@kernel
def walk_rows(moves: Floats, state: KinematicState, model: KinematicModel, rows: RolloutArrays) -> None:
    """One control step per row of moves (n, 4): forward and left, m/s, turn and look, rad/s."""
    body = state.vector[BODY:HANDS]
    for row in range(len(moves)):
        kinematics.command(body, moves[row, 0], moves[row, 1], moves[row, 2], moves[row, 3], model.gait)
        control_step(state, CARRY, -1, model)
        write_row(row, state, rows)


@kernel
def control_step(state: KinematicState, posture: int, moving: int, model: KinematicModel) -> None:
    """One control step with the present commands.

    Args:
        state: Changed in place.
        posture: Row of `KinematicModel.postures` for hands that hold something.
        moving: Hand that stays where it was put, or -1.
        model: Everything that stays the same.
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
    for _ in range(model.gait.substeps):  # the sum that the physics forms, to the last bit
        vector[TIME] += model.timestep
    carry(state, model)


@kernel
def held_in(vector: Floats, hand: int) -> int:
    """Object in a hand, or -1; the vector is that of a `KinematicState`, shape (STATE_SIZE,)."""
    grasp = int(vector[GRASPS + hand])
    return grasp // 2 if grasp >= 0 else -1


@kernel
def carry(state: KinematicState, model: KinematicModel) -> None:
    """Put the held objects where the hands are."""
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
def write_row(row: int, state: KinematicState, rows: RolloutArrays) -> None:
    """Write the present state into a row of a rollout."""
    vector = state.vector
    rows.times[row] = vector[TIME]
    rows.positions[row, 0], rows.positions[row, 1] = vector[BODY + X], vector[BODY + Y]
    rows.headings[row], rows.pitches[row] = vector[BODY + HEADING], vector[BODY + PITCH]
    rows.object_positions[row] = state.poses[:, :3]
    rows.object_quaternions[row] = state.poses[:, 3:]
    rows.state_hashes[row] = state_hash(state)
    # Held objects are in line with their hands, and nothing else touches anything.
    rows.health[row, :2], rows.health[row, 6] = 0.0, math.nan
    for hand in range(2):
        error = 0.0 if vector[GRASPS + hand] >= 0.0 else math.nan
        rows.health[row, 2 + hand] = rows.health[row, 4 + hand] = error


@kernel
def state_hash(state: KinematicState) -> np.uint64:
    """64 bits over everything that changes."""
    digest = np.uint64(0)
    for word in state.vector.view(np.uint64):
        digest = (digest ^ word) * _PRIME
        digest ^= digest >> _SHIFT
    # Four chains side by side, which a processor works on at once.
    words = state.poses.reshape(state.poses.size).view(np.uint64)
    lanes = np.array([1, 2, 3, 4], np.uint64)
    for i in range(len(words)):
        lanes[i % 4] = (lanes[i % 4] ^ words[i]) * _PRIME
        lanes[i % 4] ^= lanes[i % 4] >> _SHIFT
    for lane in lanes:
        digest = (digest ^ lane) * _PRIME
        digest ^= digest >> _SHIFT
    return digest
