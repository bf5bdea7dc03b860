"""Placing as a motion: over a slot of the receptacle, down to the measured fill, release, wait for rest."""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.options import REST_STEPS
from mjsim.person.person import Motion, Person, Steps, minimum_jerk, wrap
from mjsim.person.slots import Footprint, Slot, best_slot, held_footprint, object_corners

Vector = NDArray[np.float64]

HOVER_GAP = 0.03
RELEASE_GAP = 0.002
STILL_TIME = 0.08  # s over the slot before the way down
HAND_SPEED = 0.9
DESCENT_SPEED = 0.65
_TOUCH = 0.0005
_OVERLAP = 0.001
_RAISE = 0.003


def place(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    """Put the object that `hand` holds into its receptacle and wait until it rests; look to `pitch`, rad, then.

    Returns:
        Whether the object's centre rests inside the receptacle's volume.
    """
    yield from person.face(receptacle.center, heading=square_heading(person, receptacle), tolerance=0.04)
    person.moving_hand = hand
    corners = object_corners(person.scene.model, person.scene.index.geoms(person.scene.index.names[item]))
    footprint = held_footprint(person, hand, item, receptacle, corners)
    slot = best_slot(person, item, receptacle, footprint)
    hover = hover_height(receptacle, slot) - footprint.low[2]
    yield from _travel(person, hand, receptacle, np.array([*slot.hand, hover]))
    footprint = held_footprint(person, hand, item, receptacle, corners)
    yield from _descend(person, hand, item, receptacle, slot, footprint)
    person.grips.open(hand)
    success = yield from _settle(person, hand, item, receptacle, pitch)
    return success


def square_heading(person: Person, receptacle: ReceptacleGeometry) -> float:
    """Heading along a side of the receptacle that is nearest to looking at it: held things fit in squarely."""
    rig = person.rig
    towards = rig.heading + rig.bearing(receptacle.center)
    side = math.atan2(receptacle.rotation[1, 0], receptacle.rotation[0, 0])
    quarter = math.pi / 2
    return rig.heading + wrap(side + quarter * round(wrap(towards - side) / quarter) - rig.heading)


def hover_height(receptacle: ReceptacleGeometry, slot: Slot) -> float:
    """How high an object's lowest point crosses the receptacle, m above the centre of its volume."""
    return max(float(receptacle.half_size[2]), slot.top) + HOVER_GAP


def _hand_in_body(person: Person, receptacle: ReceptacleGeometry, local: Vector) -> Vector:
    return person.rig.to_body(receptacle.center + receptacle.rotation @ local)


def _travel(person: Person, hand: int, receptacle: ReceptacleGeometry, hover: Vector) -> Steps:
    """Up to the hover height, then across to the hover position (3,) in the receptacle's axes."""
    rig = person.rig
    for up_first in (True, False):
        start = rig.hand_targets[hand].copy()
        goal = _hand_in_body(person, receptacle, hover)
        if up_first:
            goal = np.array([start[0], start[1], max(start[2], goal[2])])
        distance = float(np.linalg.norm(goal - start))
        count = 0 if distance < 0.005 else person.steps(0.12 + distance / HAND_SPEED)
        for k in range(1, count + 1):
            if not up_first:
                goal = _hand_in_body(person, receptacle, hover)
            rig.hand_targets[hand] = start + minimum_jerk(k / count) * (goal - start)
            person.glance(receptacle.center)
            yield
    for _ in range(person.steps(STILL_TIME)):
        yield


def _descend(
    person: Person,
    hand: int,
    item: int,
    receptacle: ReceptacleGeometry,
    slot: Slot,
    footprint: Footprint,
) -> Steps:
    """Down to just above the fill; on touching anything, stop and raise until the overlap is small."""
    rig = person.rig
    start = rig.hand_targets[hand].copy()
    goal = _hand_in_body(
        person, receptacle, np.array([*slot.hand, slot.fill + RELEASE_GAP - footprint.low[2]])
    )
    count = person.steps(0.12 + abs(goal[2] - start[2]) / DESCENT_SPEED)
    for k in range(1, count + 1):
        rig.hand_targets[hand] = start + minimum_jerk(k / count) * (goal - start)
        yield
        if overlap(person, item) > _TOUCH:
            rig.hand_targets[hand] = rig.hands[hand]
            break
    for _ in range(person.steps(0.6)):
        yield
        if overlap(person, item) < _OVERLAP:
            break
        rig.hand_targets[hand, 2] += _RAISE


def overlap(person: Person, item: int) -> float:
    """Deepest overlap of object `item` with anything but the person, m."""
    data, owner = person.data, person.scene.index.geom_owner
    if not data.ncon:
        return 0.0
    geoms = data.contact.geom
    mine = (owner[geoms] == item).any(axis=1) & (geoms != person.rig.foot).all(axis=1)
    return float(max(0.0, -data.contact.dist[mine].min())) if mine.any() else 0.0


def _settle(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    """Withdraw the hand upwards and wait until the object rests."""
    rig, options = person.rig, person.options
    still, lifted = 0, 0
    for _ in range(person.steps(options.settle_time)):
        if lifted < 4:
            rig.hand_targets[hand, 2] += 0.035
            lifted += 1
        else:
            person.retire(hand)
        person.look_towards(pitch)
        yield
        quiet = person.speed(item) < options.settle_speed or person.asleep(item)
        still = still + 1 if quiet else 0
        if still >= REST_STEPS:
            return receptacle.contains(person.center(item), options.volume_margin)
    return False
