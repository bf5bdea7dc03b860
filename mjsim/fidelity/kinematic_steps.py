"""Kernels of a household without physics: the body walks, the hands keep their posture, loads move with the hands.

All that changes from step to step is one array of `LIVE` numbers and the poses of the objects, shape (n, 7).
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.fidelity import kinematics
from mjsim.fidelity.body_state import BODY_SIZE, FORWARD, HEADING, PITCH, X, Y
from mjsim.fidelity.kinematics import Gait
from mjsim.fidelity.trunk_contact import Floor
from mjsim.kernels import kernel
from mjsim.person.postures import update_hands

Floats = NDArray[np.float64]

TIME = 0  # s
BODY = 1  # the body of `mjsim.fidelity.kinematics`
HANDS = BODY + BODY_SIZE  # both hands in the body frame, m
HAND_SPEEDS = HANDS + 6  # m/s
HOLDS = HAND_SPEEDS + 6  # per hand: 2 * object + grip, or -1
LIVE = HOLDS + 2

_PRIME = np.uint64(0x9E3779B97F4A7C15)
_SHIFT = np.uint64(29)
_NO_GEOMS, _NO_FRAMES, _NO_BEARERS = np.zeros((0, 2), np.int32), np.zeros((0, 9)), np.zeros(0, np.int32)


class KinematicModel(NamedTuple):
    """What does not change, for kernels.

    Attributes:
        gait: Limits and servos of the body.
        floor: What the trunk meets.
        grips: Pose of an object in the frame of the hand that holds it, by object and grip, shape (n, 2, 7).
        loads: How far each object reaches sideways and down about its grip, m, shape (n, 2).
        rest: Where an empty left hand belongs, m, shape (3,).
        distance, gradient, frame: Clearance at the height of the hands (`mjsim.model.clearance`).
        timestep: Of the physics, s.
        yields, goals: Room for results in between, shapes (2, 2), all 0, and (2, 3).
    """

    gait: Gait
    floor: Floor
    grips: Floats
    loads: Floats
    rest: Floats
    distance: Floats
    gradient: Floats
    frame: Floats
    timestep: float
    yields: Floats
    goals: Floats


class Rows(NamedTuple):
    """What n control steps write: the arrays of a `Rollout`."""

    times: Floats
    positions: Floats
    headings: Floats
    pitches: Floats
    object_positions: Floats
    object_quaternions: Floats
    state_hashes: NDArray[np.uint64]
    health: Floats

    @classmethod
    def empty(cls, count: int, objects: int) -> "Rows":
        """Room for `count` rows."""
        return cls(
            np.empty(count), np.empty((count, 2)), np.empty(count), np.empty(count),
            np.empty((count, objects, 3)), np.empty((count, objects, 4)), np.empty(count, np.uint64),
            np.empty((count, 7)),
        )  # fmt: skip


@kernel
def walk_rows(
    moves: Floats, live: Floats, poses: Floats, posture: Floats, house: KinematicModel, rows: Rows
) -> None:
    """One control step per row of moves (n, 4); `posture` is that of a left hand that holds something."""
    for step in range(len(moves)):
        kinematics.command(
            live[BODY:HANDS], moves[step, 0], moves[step, 1], moves[step, 2], moves[step, 3], house.gait
        )
        tick(live, poses, posture, -1, house)
        write_row(step, live, poses, rows)


@kernel
def tick(live: Floats, poses: Floats, posture: Floats, moving: int, house: KinematicModel) -> None:
    """One control step with the present commands; the hand `moving` stays where it was put."""
    body = live[BODY:HANDS]
    hands, speeds = live[HANDS:HAND_SPEEDS].reshape(2, 3), live[HAND_SPEEDS:HOLDS].reshape(2, 3)
    update_hands(
        body, body[FORWARD :], hands, speeds, house.yields, house.goals,
        held_in(live, 0), held_in(live, 1), moving, posture, house.rest, house.loads,
        house.distance, house.gradient, house.frame, _NO_GEOMS, _NO_FRAMES, _NO_BEARERS, house.gait.dt,
    )  # fmt: skip
    kinematics.advance(body, house.gait, house.floor)
    for _ in range(house.gait.substeps):  # the sum that the physics forms, to the last bit
        live[TIME] += house.timestep
    carry(live, poses, house)


@kernel
def held_in(live: Floats, hand: int) -> int:
    """Object in a hand, or -1."""
    hold = int(live[HOLDS + hand])
    return hold // 2 if hold >= 0 else -1


@kernel
def carry(live: Floats, poses: Floats, house: KinematicModel) -> None:
    """Put what the hands hold where they are."""
    half = 0.5 * live[BODY + HEADING]
    c, s = math.cos(live[BODY + HEADING]), math.sin(live[BODY + HEADING])
    ch, sh = math.cos(half), math.sin(half)
    for hand in range(2):
        hold = int(live[HOLDS + hand])
        if hold < 0:
            continue
        grip = house.grips[hold // 2, hold % 2]
        pose = poses[hold // 2]
        first = HANDS + 3 * hand
        forward, left = live[first] + grip[0], live[first + 1] + grip[1]
        pose[0] = live[BODY + X] + c * forward - s * left
        pose[1] = live[BODY + Y] + s * forward + c * left
        pose[2] = live[first + 2] + grip[2]
        pose[3] = ch * grip[3] - sh * grip[6]
        pose[4] = ch * grip[4] - sh * grip[5]
        pose[5] = ch * grip[5] + sh * grip[4]
        pose[6] = ch * grip[6] + sh * grip[3]


@kernel
def write_row(step: int, live: Floats, poses: Floats, rows: Rows) -> None:
    """Note the present state."""
    rows.times[step] = live[TIME]
    rows.positions[step, 0], rows.positions[step, 1] = live[BODY + X], live[BODY + Y]
    rows.headings[step], rows.pitches[step] = live[BODY + HEADING], live[BODY + PITCH]
    rows.object_positions[step] = poses[:, :3]
    rows.object_quaternions[step] = poses[:, 3:]
    rows.state_hashes[step] = state_hash(live, poses)
    # What is held is in line with its hand, and nothing else touches anything.
    rows.health[step, :2], rows.health[step, 6] = 0.0, math.nan
    for hand in range(2):
        error = 0.0 if live[HOLDS + hand] >= 0.0 else math.nan
        rows.health[step, 2 + hand] = rows.health[step, 4 + hand] = error


@kernel
def state_hash(live: Floats, poses: Floats) -> np.uint64:
    """64 bits over everything that changes."""
    digest = np.uint64(0)
    for word in live.view(np.uint64):
        digest = (digest ^ word) * _PRIME
        digest ^= digest >> _SHIFT
    # Four chains side by side, which a processor works on at once.
    words = poses.reshape(poses.size).view(np.uint64)
    lanes = np.array([1, 2, 3, 4], np.uint64)
    for i in range(len(words)):
        lanes[i % 4] = (lanes[i % 4] ^ words[i]) * _PRIME
        lanes[i % 4] ^= lanes[i % 4] >> _SHIFT
    for lane in lanes:
        digest = (digest ^ lane) * _PRIME
        digest ^= digest >> _SHIFT
    return digest
