"""Hand motions that pick up and place objects.

In a pick, the person stops, turns to the object and reaches for it. A soft weld connects the object to the
hand while it is lifted into the carrying posture. Then a firm weld replaces it. In a place, the hand moves
over a slot, lowers the object to the measured fill height, opens, and waits until the object rests.
"""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.support.kernels import kernel
from mjsim.values.options import REST_STEPS
from mjsim.world.body.motion_profiles import ACROSS_FIRST, STRAIGHT, UP_FIRST
from mjsim.world.body.person import Motion, Person, Steps, wrap
from mjsim.world.body.slots import Slot, best_slot, load_extent, object_corners

_ARRIVAL_TIMEOUT = 0.4  # maximum time to wait for the hand to arrive after a reach, in seconds
_GRIP_TIMEOUT = 0.2  # maximum time to wait until the firm weld has pulled the object in, in seconds
_CLOSE_ENOUGH = 0.012  # distance to a grip at which the hand counts as arrived, in metres
Vector = NDArray[np.float64]
_TOUCH = 0.0005  # overlap with other geoms at which an object is no longer lowered, in metres
_OVERLAP = 0.001  # overlap with other geoms below which the hand opens, in metres
_RAISE = 0.003  # distance by which an overlapping object is raised per control step, in metres
_RAISE_TIMEOUT = 0.6  # time limit for raising an overlapping object, in seconds
# Maximum angle to a receptacle on the side of the other hand if that hand holds a load, in radians
_MAX_ACROSS = math.pi / 6


def pick(
    person: Person,
    hand: int,
    item: int,
    carry_position: Callable[[int, int], NDArray[np.float64]],
    pitch: float,
) -> Motion:
    """Reach for an object and lift it, while the head returns to `pitch` radians. Return True on success."""
    rig, grips = person.rig, person.grips
    yield from person.face(person.center(item), person.motion.object_tolerance)
    person.moving_hand = hand
    grip = grips.nearest_grip(hand, item)
    yield from _reach(person, hand, item, grip)
    for _ in range(person.steps(_ARRIVAL_TIMEOUT)):
        if grips.gap(hand, item, grip) < _CLOSE_ENOUGH:
            break
        rig.hand_targets[hand] = rig.to_body(grips.point(item, grip))
        yield
    grip = grips.nearest_grip(hand, item)
    if grips.gap(hand, item, grip) > person.options.grip_distance:
        return False
    grips.close(hand, item, grip, gently=True)
    yield from _lift(person, hand, carry_position(hand, item), pitch)
    # The object hangs 2 cm below the hand. It is now clear of its neighbours, so a firm weld can pull it in.
    grips.close(hand, item, grip)
    yield from _draw_in(person, hand)
    if grips.error(hand) > person.options.grip_error:
        grips.open(hand)
        return False
    return True


def _reach(person: Person, hand: int, item: int, grip: int) -> Steps:
    steps = person.steps(person.motion.reach_time)
    for _ in person.swing(
        hand, lambda: person.rig.to_body(person.grips.point(item, grip)), steps, ACROSS_FIRST
    ):
        person.glance(person.center(item))
        yield


def _lift(person: Person, hand: int, goal: NDArray[np.float64], pitch: float) -> Steps:
    for _ in range(person.steps(person.motion.align_time)):
        yield
    # An object on a high shelf leaves the shelf before it moves down.
    order = UP_FIRST if goal[2] > person.rig.hand_targets[hand, 2] else ACROSS_FIRST
    for _ in person.swing(hand, lambda: goal, person.steps(person.motion.lift_time), order):
        person.look_towards(pitch)
        yield


def _draw_in(person: Person, hand: int) -> Steps:
    for _ in range(person.steps(_GRIP_TIMEOUT)):
        if person.grips.error(hand) < 0.5 * person.options.grip_error:
            break
        yield


def place(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    """Put an object into its receptacle, then turn the head to `pitch` radians. Return True on success."""
    heading = square_heading(person, hand, receptacle)
    yield from person.face(receptacle.center, person.motion.receptacle_tolerance, heading)
    person.moving_hand = hand
    corners = object_corners(person.scene.model, person.scene.index.geoms(person.scene.index.names[item]))
    extent = load_extent(person, hand, item, receptacle, corners)
    slot = best_slot(person, item, receptacle, extent)
    hover = hover_height(person, receptacle, slot) - extent.low[2]
    yield from _travel(person, hand, receptacle, np.array([*slot.hand, hover]))
    low = float(load_extent(person, hand, item, receptacle, corners).low[2])
    yield from _descend(person, hand, item, receptacle, slot, low)
    person.grips.open(hand)
    success = yield from _settle(person, hand, item, receptacle, pitch)
    return success


def square_heading(person: Person, hand: int, receptacle: ReceptacleGeometry) -> float:
    """Return a heading parallel to a side of the receptacle.

    The person faces the receptacle as directly as possible, or stands with the placing hand next to it if the hand
    would otherwise have to reach across a load in the other hand.
    """
    rig = person.rig
    towards = rig.heading + rig.bearing(receptacle.center)
    side = math.atan2(receptacle.rotation[1, 0], receptacle.rotation[0, 0])
    quarter = math.pi / 2
    quarters = round(wrap(towards - side) / quarter)
    sign = 1.0 - 2.0 * hand
    left = wrap(towards - side - quarter * quarters)  # angle to the receptacle, positive to the left
    if -sign * left > _MAX_ACROSS and person.held[1 - hand] is not None:
        quarters -= round(sign)
    return rig.heading + wrap(side + quarter * quarters - rig.heading)


def hover_height(person: Person, receptacle: ReceptacleGeometry, slot: Slot) -> float:
    """Return the height above the volume's centre at which the bottom of an object hovers before release."""
    return max(float(receptacle.half_size[2]), slot.top) + person.motion.hover_gap


def _hand_in_body(person: Person, receptacle: ReceptacleGeometry, local: Vector) -> Vector:
    return person.rig.to_body(receptacle.center + receptacle.rotation @ local)


def _travel(person: Person, hand: int, receptacle: ReceptacleGeometry, hover: Vector) -> Steps:
    """Move a hand up and sideways until it is in front of `hover`, then forward over the receptacle.

    On a straight line, a load would hit furniture beside the receptacle.
    """
    target = person.rig.hand_targets[hand]
    start = target.copy()

    def above() -> Vector:
        return _hand_in_body(person, receptacle, hover)

    def before() -> Vector:
        _, left, up = above()
        return np.array([start[0], left, max(start[2], up)])

    for goal, order in ((before, UP_FIRST), (above, STRAIGHT)):
        steps = person.travel_steps(float(np.linalg.norm(goal() - target)))
        for _ in person.swing(hand, goal, steps, order):
            person.glance(receptacle.center)
            yield
    for _ in range(person.steps(person.motion.hover_time)):
        yield


def _descend(
    person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, slot: Slot, low: float
) -> Steps:
    """Lower an object until its lowest point, `low` relative to the hand, is just above the fill height.

    If the object touches anything on the way down, it is raised until the overlap is small.
    """
    rig = person.rig
    release = slot.fill + person.motion.release_gap - low
    goal = _hand_in_body(person, receptacle, np.array([*slot.hand, release]))
    steps = person.descent_steps(abs(goal[2] - rig.hand_targets[hand, 2]))
    for _ in person.swing(hand, lambda: goal, steps, STRAIGHT):
        yield
        if overlap(person, item) > _TOUCH:
            rig.hand_targets[hand] = rig.hands[hand]
            break
    for _ in range(person.steps(_RAISE_TIMEOUT)):
        yield
        if overlap(person, item) < _OVERLAP:
            break
        rig.hand_targets[hand, 2] += _RAISE


def overlap(person: Person, item: int) -> float:
    data = person.data
    if not data.ncon:
        return 0.0
    geoms, distances = map(np.ascontiguousarray, (data.contact.geom, data.contact.dist))
    return deepest_overlap(geoms, distances, person.scene.index.geom_owner, item, person.rig.foot)


@kernel
def deepest_overlap(
    geoms: NDArray[np.int32], distances: Vector, owner: NDArray[np.int32], item: int, foot: int
) -> float:
    """Return an object's deepest overlap in metres with geoms other than the foot. `geoms` is (k, 2)."""
    deepest = 0.0
    for c in range(len(distances)):
        first, second = geoms[c, 0], geoms[c, 1]
        if (owner[first] == item or owner[second] == item) and first != foot and second != foot:
            deepest = max(deepest, -distances[c])
    return deepest


def _settle(person: Person, hand: int, item: int, receptacle: ReceptacleGeometry, pitch: float) -> Motion:
    options, motion = person.options, person.motion
    still = 0
    for step in range(person.steps(options.settle_time)):
        if step < motion.withdraw_steps:
            person.rig.hand_targets[hand, 2] += motion.withdraw_step
        else:
            person.move_hand_to_rest(hand)
        person.look_towards(pitch)
        yield
        quiet = person.speed(item) < options.settle_speed or person.asleep(item)
        still = still + 1 if quiet else 0
        if still >= REST_STEPS:
            return receptacle.contains(person.center(item), options.volume_margin)
    return False
