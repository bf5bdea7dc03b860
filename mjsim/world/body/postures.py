"""Kernels that update the hand postures in each control step and keep carried objects in free space.

If an object nevertheless touches a static geom, the hand presses on it only gently and yields along the contact
normal, up to a limit. Beyond this limit, the body stops walking or turning into the contact.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import CarryingParameters, MotionParameters
from mjsim.world.body.load_room import FORWARD, HEADING, LEFT, TURN, BodyMotion, drawn_in

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# Horizontal part of a contact normal above which the object touches an obstacle and not a surface below it.
UPRIGHT = 0.3

# Distance in metres by which the target is ahead of a hand that an obstacle stops. The servo then pushes with 20 N.
_PRESS = 0.01
_ARRIVED = 0.0005  # distance to the goal at which a hand stops, in metres


class Hands(NamedTuple):
    """Arrays for the control of the left and the right hand, in the body frame."""

    targets: Floats  # commanded positions of the hands in metres, shape (2, 3)
    velocities: Floats  # velocities of the targets in m/s, shape (2, 3)
    compliance: Floats  # horizontal offsets by which the hands yield to contacts, in metres, shape (2, 2)
    goals: Floats  # buffer for the positions towards which the targets move, in metres, shape (2, 3)
    rest: Floats  # rest posture of the left hand, in metres, shape (3,)
    loads: Floats  # radius and downward extent of each object, measured from its grip in metres, shape (n, 2)
    pace: Floats  # gain (1/s), speed limit (m/s) and acceleration limit (m/s^2) of the targets, shape (3,)


class Contacts(NamedTuple):
    """The contacts in the physics simulation."""

    geoms: Ints  # ids of the two geoms of each contact, shape (k, 2)
    frames: Floats  # axes of each contact frame, of which the first is the normal, shape (k, 9)
    owners: Ints  # object index of each geom, -1 for the house, -2 for the person, shape (ngeom,)


class Holding(NamedTuple):
    """The objects in the hands, and the posture of a hand that holds an object."""

    left: int  # index of the object in the hand, or -1 if the hand is empty
    right: int
    moving: int  # hand that the current motion moves, or -1
    posture: Floats  # posture of a loaded left hand, in metres, shape (3,)


def posture_pace(motion: MotionParameters) -> Floats:
    """Return the values of `Hands.pace` for a person, shape (3,)."""
    return np.array([motion.posture_gain, motion.posture_speed, motion.posture_acceleration])


@kernel
def update_hands(
    body: BodyMotion,
    hands: Hands,
    carrying: CarryingParameters,
    holding: Holding,
    contacts: Contacts,
    dt: float,
) -> None:
    """Update the targets of hands that no motion moves. Cancel commands that push objects into walls."""
    for hand in range(2):
        side = 1.0 - 2.0 * hand
        hands.compliance[hand, 0] *= 1.0 - carrying.return_rate * dt
        hands.compliance[hand, 1] *= 1.0 - carrying.return_rate * dt
        goal = hands.goals[hand]
        goal[0], goal[1], goal[2] = hands.rest[0], side * hands.rest[1], hands.rest[2]
        item = holding.left if hand == 0 else holding.right
        if item < 0 or hand == holding.moving:
            continue
        _comply(hand, item, body, hands, carrying, contacts, dt)
        radius, height = hands.loads[item, 0], hands.loads[item, 1]
        forward, left = drawn_in(holding.posture[0], side * holding.posture[1], radius, body, carrying)
        goal[0] = forward + hands.compliance[hand, 0]
        goal[1] = left + hands.compliance[hand, 1]
        goal[2] = max(holding.posture[2], carrying.least_height + height)
    if holding.left >= 0 and holding.right >= 0 and holding.moving < 0:
        loads, left, right = hands.loads, holding.left, holding.right
        radii = loads[left, 0] + loads[right, 0]
        _raise_right(hands.goals, hands.targets, radii, loads[right, 1], carrying)
    for hand in range(2):
        if hand != holding.moving:
            goal = hands.goals[hand]
            move_hand(hands.targets, hands.velocities, hand, goal[0], goal[1], goal[2], hands.pace, dt)


@kernel
def move_hand(
    targets: Floats, velocities: Floats, hand: int, x: float, y: float, z: float, pace: Floats, dt: float
) -> None:
    """Move a hand's target towards x, y, z in the body frame for `dt` seconds. It slows down near the goal.

    `targets` (2, 3), in metres, and `velocities` (2, 3), in m/s, are updated. `pace` is `Hands.pace`.
    """
    dx, dy, dz = x - targets[hand, 0], y - targets[hand, 1], z - targets[hand, 2]
    gap = math.sqrt(dx * dx + dy * dy + dz * dz)
    if gap < _ARRIVED:
        velocities[hand, 0] = velocities[hand, 1] = velocities[hand, 2] = 0.0
        return
    rate = min(pace[0] * gap, pace[1]) / gap
    cx = dx * rate - velocities[hand, 0]
    cy = dy * rate - velocities[hand, 1]
    cz = dz * rate - velocities[hand, 2]
    size = math.sqrt(cx * cx + cy * cy + cz * cz)
    share = min(1.0, pace[2] * dt / size) if size > 0.0 else 0.0
    velocities[hand, 0] += cx * share
    velocities[hand, 1] += cy * share
    velocities[hand, 2] += cz * share
    for axis in range(3):
        targets[hand, axis] += velocities[hand, axis] * dt


@kernel
def _raise_right(
    goals: Floats, targets: Floats, radii: float, height: float, carrying: CarryingParameters
) -> None:
    """Raise the right load above the left one where they would overlap, at the goals or on the way to them."""
    apart = math.hypot(goals[1, 0] - goals[0, 0], goals[1, 1] - goals[0, 1])
    apart = min(apart, math.hypot(targets[1, 0] - targets[0, 0], targets[1, 1] - targets[0, 1]))
    near = (radii + carrying.stacking_distance - apart) / carrying.stacking_distance
    over = goals[0, 2] + height + carrying.stacking_gap - goals[1, 2]
    goals[1, 2] += min(1.0, max(0.0, near)) * max(0.0, over)


@kernel
def _comply(
    hand: int,
    item: int,
    body: BodyMotion,
    hands: Hands,
    carrying: CarryingParameters,
    contacts: Contacts,
    dt: float,
) -> None:
    owners = contacts.owners
    for contact in range(len(contacts.geoms)):
        first, second = owners[contacts.geoms[contact, 0]], owners[contacts.geoms[contact, 1]]
        if first == item and second == -1:
            sign = -1.0
        elif second == item and first == -1:
            sign = 1.0
        else:
            continue
        nx, ny = sign * contacts.frames[contact, 0], sign * contacts.frames[contact, 1]
        size = math.sqrt(nx * nx + ny * ny)
        if size > UPRIGHT:
            _give_way(hand, nx / size, ny / size, body, hands, carrying, dt)


@kernel
def _give_way(
    hand: int,
    nx: float,
    ny: float,
    body: BodyMotion,
    hands: Hands,
    carrying: CarryingParameters,
    dt: float,
) -> None:
    command, target, offset = body.command, hands.targets[hand], hands.compliance[hand]
    c, s = math.cos(body.pose[HEADING]), math.sin(body.pose[HEADING])
    away_f, away_l = c * nx + s * ny, c * ny - s * nx
    swing = (away_l * target[0] - away_f * target[1]) * command[TURN]
    approach = -(away_f * command[FORWARD] + away_l * command[LEFT] + swing)
    _slacken(hand, away_f, away_l, body.pose, hands)
    push = (max(approach, 0.0) + carrying.push_back) * dt
    offset[0] += away_f * push
    offset[1] += away_l * push
    size = math.sqrt(offset[0] ** 2 + offset[1] ** 2)
    most = carrying.most_compliance
    if size > most:
        offset[0] *= most / size
        offset[1] *= most / size
        if swing < 0.0:
            command[TURN] = 0.0
        into = away_f * command[FORWARD] + away_l * command[LEFT]
        if into < 0.0:
            command[FORWARD] -= into * away_f
            command[LEFT] -= into * away_l


@kernel
def _slacken(hand: int, away_f: float, away_l: float, pose: Floats, hands: Hands) -> None:
    """Keep a hand's target at most `_PRESS` metres ahead of the hand, in the direction of an obstacle.

    Otherwise, friction at the obstacle would hold the object, so that the hand could not slide past it.
    """
    target, velocity = hands.targets[hand], hands.velocities[hand]
    ahead = away_f * (target[0] - pose[4 + 3 * hand]) + away_l * (target[1] - pose[5 + 3 * hand])
    if ahead < -_PRESS:
        target[0] -= (ahead + _PRESS) * away_f
        target[1] -= (ahead + _PRESS) * away_l
    speed = away_f * velocity[0] + away_l * velocity[1]
    if speed < 0.0:
        velocity[0] -= speed * away_f
        velocity[1] -= speed * away_l
