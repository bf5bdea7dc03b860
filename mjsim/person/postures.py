"""One control step of the hands' postures, as numba kernels: where a load has room, and how a target moves there.

A person draws a box in when passing a door frame. A hand looks up the clearance around the place where it is about to
be and moves away from what is too near. Should its load touch something static all the same, the hand gives way along
the contact's normal, and where it cannot any further, the body does not walk or turn into the contact.

All arrays are those of the `Rig` and of `Carrying`, and are changed in place.
"""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel
from mjsim.model.clearance import clearance_at
from mjsim.person.grips import site_gap

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# Layout of `Rig.pose` and of `Rig.motion`.
X, Y, HEADING = 0, 1, 2
FORWARD, LEFT, TURN = 0, 1, 2

LOWEST = 0.97  # m, for the underside of what is carried: above counters
MARGIN = 0.03  # m
NEAR, FAR = 0.15, 0.3  # s, how far ahead a hand looks
ROUNDS = 3
MOST_SHIFT = 0.2  # m
EXTENSIONS = (0.0, 0.15, 0.3, 0.45, 0.6, 0.7, 0.8, 0.9, 1.0)  # of the way from the body's axis to the posture
OVER_GAP = 0.04  # m, between two held things one above the other
PASSING = 0.10  # m of approach over which one is raised above the other
PUSH_BACK = 0.25  # m/s beyond the speed of approach
RELAX = 0.9  # 1/s
MOST_YIELD = 0.15  # m
UPRIGHT = 0.3  # horizontal share below which a contact is a surface underneath, not an obstacle

MOST_HELD_BACK = 0.25  # m; the servo saturates at 0.04 m, from there on the hand is dragged behind

POSTURE_GAIN = 7.0  # 1/s
POSTURE_SPEED = 1.5  # m/s
POSTURE_ACCELERATION = 8.0  # m/s^2
_ARRIVED = 0.0005  # m


@kernel
def update_hands(
    pose: Floats, motion: Floats, targets: Floats, velocities: Floats, yields: Floats, goals: Floats,
    item_0: int, item_1: int, moving: int, posture: Floats, rest: Floats, loads: Floats,
    distance: Floats, gradient: Floats, frame: Floats, geoms: Ints, frames: Floats, bearer: Ints, dt: float,
) -> None:  # fmt: skip
    """Set the targets of the hands that no motion moves, and guard the walking command.

    Args:
        pose: x, y, heading and more, m and rad, (10,).
        motion: Commanded velocity in the body frame, m/s, and yaw rate, rad/s, (4,); changed.
        targets: The hands' targets, body frame, m, (2, 3); changed.
        velocities: How fast these move, m/s, (2, 3); changed.
        yields: How far each hand has given way, m, (2, 2); changed.
        goals: Where the hands belong, m, (2, 3); overwritten.
        item_0: Object in the left hand, or -1.
        item_1: Object in the right hand, or -1.
        moving: Hand that a motion moves, or -1.
        posture: Where a left hand that holds something belongs, m, (3,).
        rest: Where an empty left hand belongs, m, (3,).
        loads: How far each object reaches sideways and down about its grip, m, (n, 2).
        distance: `ClearanceField.distance`.
        gradient: `ClearanceField.gradient`.
        frame: `ClearanceField.frame`.
        geoms: Geoms of each contact, (k, 2).
        frames: Frame of each contact, (k, 9).
        bearer: Object of each geom, -1 for the house, -2 for the person, (ngeom,).
        dt: Control step, s.
    """
    for hand in range(2):
        side = 1.0 - 2.0 * hand
        yields[hand, 0] *= 1.0 - RELAX * dt
        yields[hand, 1] *= 1.0 - RELAX * dt
        goals[hand, 0], goals[hand, 1], goals[hand, 2] = rest[0], side * rest[1], rest[2]
        item = item_0 if hand == 0 else item_1
        if item < 0 or hand == moving:
            continue
        _yield_to_contacts(hand, item, pose, motion, targets, yields, geoms, frames, bearer, dt)
        radius, height = loads[item, 0], loads[item, 1]
        forward, left = drawn_in(
            posture[0], side * posture[1], radius, pose, motion, distance, gradient, frame
        )
        goals[hand, 0] = forward + yields[hand, 0]
        goals[hand, 1] = left + yields[hand, 1]
        goals[hand, 2] = max(posture[2], LOWEST + height)
    if item_0 >= 0 and item_1 >= 0 and moving < 0:
        _raise_right(goals, loads[item_0, 0] + loads[item_1, 0], loads[item_1, 1])
    for hand in range(2):
        if hand != moving:
            move_hand(targets, velocities, hand, goals[hand, 0], goals[hand, 1], goals[hand, 2], dt)


@kernel
def move_hand(
    targets: Floats, velocities: Floats, hand: int, x: float, y: float, z: float, dt: float
) -> None:
    """Move a hand's target towards a place in the body frame, m, slower as it comes near."""
    dx, dy, dz = x - targets[hand, 0], y - targets[hand, 1], z - targets[hand, 2]
    gap = math.sqrt(dx * dx + dy * dy + dz * dz)
    if gap < _ARRIVED:
        velocities[hand, 0] = velocities[hand, 1] = velocities[hand, 2] = 0.0
        return
    pace = min(POSTURE_GAIN * gap, POSTURE_SPEED) / gap
    cx = dx * pace - velocities[hand, 0]
    cy = dy * pace - velocities[hand, 1]
    cz = dz * pace - velocities[hand, 2]
    size = math.sqrt(cx * cx + cy * cy + cz * cz)
    share = min(1.0, POSTURE_ACCELERATION * dt / size) if size > 0.0 else 0.0
    velocities[hand, 0] += cx * share
    velocities[hand, 1] += cy * share
    velocities[hand, 2] += cz * share
    for axis in range(3):
        targets[hand, axis] += velocities[hand, axis] * dt


@kernel
def drawn_in(
    forward: float, left: float, radius: float, pose: Floats, motion: Floats,
    distance: Floats, gradient: Floats, frame: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Place nearest to a posture (forward, left) where a load is clear of the house, now and shortly.

    Sideways first, as past a door frame; then as far out from the body's axis as nothing is in between: the far side
    of a wall is clear, but out of the question.
    """
    shift_f, shift_l = _sideways(forward, left, radius + MARGIN, pose, motion, distance, gradient, frame)
    forward, left = forward + shift_f, left + shift_l
    if _clear_throughout(forward, left, radius + MARGIN, pose, motion, distance, gradient, frame):
        return forward, left
    best_f, best_l, best_room, before = 0.0, 0.0, -math.inf, -math.inf
    for share in EXTENSIONS:
        at_f, at_l = share * forward, share * left
        room = math.inf
        for horizon in (0.0, NEAR, FAR):
            there, _, _ = _room(at_f, at_l, horizon, pose, motion, distance, gradient, frame)
            room = min(room, there)
        room -= radius
        clear = room >= 0.5 * MARGIN
        if not clear and room < before:
            break
        if clear or room > best_room:
            best_f, best_l, best_room = at_f, at_l, room
        before = room
    return best_f, best_l


@kernel
def _clear_throughout(
    forward: float, left: float, needed: float, pose: Floats, motion: Floats,
    distance: Floats, gradient: Floats, frame: Floats,
) -> bool:  # fmt: skip
    """Whether the ends alone tell that a load is clear all the way: clearance changes by no more than the distance."""
    length = math.sqrt(forward * forward + left * left)
    for horizon in (0.0, NEAR, FAR):
        axis, _, _ = _room(0.0, 0.0, horizon, pose, motion, distance, gradient, frame)
        there, _, _ = _room(forward, left, horizon, pose, motion, distance, gradient, frame)
        if min(axis, there, 0.5 * (axis + there - length)) < needed:
            return False
    return True


@kernel
def _sideways(
    forward: float, left: float, needed: float, pose: Floats, motion: Floats,
    distance: Floats, gradient: Floats, frame: Floats,
) -> tuple[float, float]:  # fmt: skip
    """Shift in the body frame, away from what is too near."""
    shift_f, shift_l = 0.0, 0.0
    for horizon in (0.0, NEAR, FAR):
        for _ in range(ROUNDS):
            room, away_f, away_l = _room(
                forward + shift_f, left + shift_l, horizon, pose, motion, distance, gradient, frame
            )
            if room >= needed:
                break
            shift_f += (needed - room) * away_f
            shift_l += (needed - room) * away_l
    size = math.hypot(shift_f, shift_l)
    limit = min(1.0, MOST_SHIFT / size) if size > 0.0 else 1.0
    return shift_f * limit, shift_l * limit


@kernel
def _room(
    forward: float, left: float, horizon: float, pose: Floats, motion: Floats,
    distance: Floats, gradient: Floats, frame: Floats,
) -> tuple[float, float, float]:  # fmt: skip
    """Clearance in `horizon` seconds at a place of the body frame, and the way out, in that frame."""
    forward += motion[FORWARD] * horizon
    left += motion[LEFT] * horizon
    heading = pose[HEADING] + motion[TURN] * horizon
    c, s = math.cos(heading), math.sin(heading)
    x, y = pose[X] + c * forward - s * left, pose[Y] + s * forward + c * left
    room, away_x, away_y = clearance_at(x, y, distance, gradient, frame)
    return room, c * away_x + s * away_y, c * away_y - s * away_x


@kernel
def _raise_right(goals: Floats, radii: float, height: float) -> None:
    """Where two held things would meet, pass the right one over the left one."""
    apart = math.hypot(goals[1, 0] - goals[0, 0], goals[1, 1] - goals[0, 1])
    near = (radii + PASSING - apart) / PASSING
    over = goals[0, 2] + height + OVER_GAP - goals[1, 2]
    goals[1, 2] += min(1.0, max(0.0, near)) * max(0.0, over)


@kernel
def _yield_to_contacts(
    hand: int, item: int, pose: Floats, motion: Floats, targets: Floats, yields: Floats,
    geoms: Ints, frames: Floats, bearer: Ints, dt: float,
) -> None:  # fmt: skip
    """Give way to everything static that a held object touches from the side."""
    for contact in range(len(geoms)):
        first, second = bearer[geoms[contact, 0]], bearer[geoms[contact, 1]]
        if first == item and second == -1:
            sign = -1.0
        elif second == item and first == -1:
            sign = 1.0
        else:
            continue
        nx, ny = sign * frames[contact, 0], sign * frames[contact, 1]
        size = math.sqrt(nx * nx + ny * ny)
        if size > UPRIGHT:
            _give_way(hand, nx / size, ny / size, pose, motion, targets, yields, dt)


@kernel
def _give_way(
    hand: int, nx: float, ny: float, pose: Floats, motion: Floats, targets: Floats, yields: Floats, dt: float
) -> None:
    c, s = math.cos(pose[HEADING]), math.sin(pose[HEADING])
    away_f, away_l = c * nx + s * ny, c * ny - s * nx
    swing = (away_l * targets[hand, 0] - away_f * targets[hand, 1]) * motion[TURN]
    approach = -(away_f * motion[FORWARD] + away_l * motion[LEFT] + swing)
    push = (max(approach, 0.0) + PUSH_BACK) * dt
    yields[hand, 0] += away_f * push
    yields[hand, 1] += away_l * push
    size = math.sqrt(yields[hand, 0] ** 2 + yields[hand, 1] ** 2)
    if size > MOST_YIELD:
        yields[hand, 0] *= MOST_YIELD / size
        yields[hand, 1] *= MOST_YIELD / size
        if swing < 0.0:
            motion[TURN] = 0.0
        into = away_f * motion[FORWARD] + away_l * motion[LEFT]
        if into < 0.0:
            motion[FORWARD] -= into * away_f
            motion[LEFT] -= into * away_l


@kernel
def count_strain(
    pose: Floats, targets: Floats, site_xpos: Floats, pairs: NDArray[np.intp], left: bool, right: bool,
    most_error: float, patience: float, strained: NDArray[np.int64],
) -> int:  # fmt: skip
    """Count for how many control steps each hand has been strained.

    Args:
        pose: `Rig.pose`.
        targets: `Rig.hand_targets`.
        site_xpos: Positions of all sites, m, (nsite, 3).
        pairs: `Grips.pairs`.
        left: Whether the left hand carries something.
        right: Whether the right one does.
        most_error: A weld stretched farther than this is strained, m.
        patience: Control steps after which a load slips.
        strained: Steps per hand, (2,); changed.

    Returns:
        Hands whose load slips: 1 for the left one, 2 for the right one, or their sum.
    """
    slipping = 0
    for hand in range(2):
        if not (left if hand == 0 else right):
            strained[hand] = 0
            continue
        back = 0.0
        for axis in range(3):
            back += (pose[4 + 3 * hand + axis] - targets[hand, axis]) ** 2
        first, second = pairs[hand, 0], pairs[hand, 1]
        error = site_gap(site_xpos, first, second) if first >= 0 else 0.0
        tense = error > most_error or math.sqrt(back) > MOST_HELD_BACK
        strained[hand] = strained[hand] + 1 if tense else 0
        if strained[hand] > patience:
            slipping += 1 << hand
    return slipping
