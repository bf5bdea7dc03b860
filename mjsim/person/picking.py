"""Picking as a motion: stand, turn, reach, weld gently, lift into the carrying posture, close firmly."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mjsim.person.person import Motion, Person, Steps, minimum_jerk

REACH_TIME = 0.44
APPROACH_TIME = 0.4  # longest wait for the hand to arrive after the reach
ALIGN_TIME = 0.12
LIFT_TIME = 0.64
SEAT_TIME = 0.2  # longest wait for a load to sit in the hand
_SHIFT = 0.2  # share of a movement by which one of its two parts leads the other
_CLOSE_ENOUGH = 0.012


def pick(
    person: Person,
    hand: int,
    item: int,
    place_for: Callable[[int, int], NDArray[np.float64]],
    pitch: float,
) -> Motion:
    """Reach for object `item` and lift it.

    Args:
        person: Who picks.
        hand: Hand that reaches.
        item: Object.
        place_for: Where a hand holds an object clear of the house, body frame, m, (3,).
        pitch: Where the head looks afterwards, rad.

    Returns:
        Whether the hand holds the object in the carrying posture. If not, the hand is open.
    """
    rig, grips = person.rig, person.grips
    yield from person.face(person.center(item))
    person.moving_hand = hand
    grip = grips.nearest_grip(hand, item)
    yield from _reach(person, hand, item, grip)
    for _ in range(person.steps(APPROACH_TIME)):
        if grips.gap(hand, item, grip) < _CLOSE_ENOUGH:
            break
        rig.hand_targets[hand] = rig.to_body(grips.point(item, grip))
        yield
    success = yield from take(person, hand, item, place_for, pitch)
    return success


def take(
    person: Person,
    hand: int,
    item: int,
    place_for: Callable[[int, int], NDArray[np.float64]],
    pitch: float,
) -> Motion:
    """Lift object `item`, which the hand has reached; the rest is as in `pick`."""
    grips = person.grips
    person.moving_hand = hand
    grip = grips.nearest_grip(hand, item)
    if grips.gap(hand, item, grip) > person.options.grip_distance:
        return False
    grips.close(hand, item, grip, gently=True)
    yield from _lift(person, hand, place_for(hand, item), pitch)
    # Held gently, a load hangs 2 cm off the hand: only now, clear of its neighbours, is it drawn in.
    grips.close(hand, item, grip)
    yield from _seat(person, hand)
    if grips.error(hand) > person.options.grip_error:
        grips.open(hand)
        return False
    return True


def _reach(person: Person, hand: int, item: int, grip: int) -> Steps:
    """Over the object first, then down to it; the goal is followed while it moves."""
    rig = person.rig
    start = rig.hand_targets[hand].copy()
    count = person.steps(REACH_TIME)
    for k in range(1, count + 1):
        goal = rig.to_body(person.grips.point(item, grip))
        rig.hand_targets[hand] = lead_blend(start, goal, k / count, leading="across")
        person.glance(person.center(item))
        yield


def _lift(person: Person, hand: int, goal: NDArray[np.float64], pitch: float) -> Steps:
    """Straight up first, so that nothing low is brushed, then back to the body."""
    rig = person.rig
    start = rig.hand_targets[hand].copy()
    for _ in range(person.steps(ALIGN_TIME)):
        yield
    count = person.steps(LIFT_TIME)
    for k in range(1, count + 1):
        rig.hand_targets[hand] = lead_blend(start, goal, k / count, leading="up")
        person.look_towards(pitch)
        yield


def _seat(person: Person, hand: int) -> Steps:
    """Until the load sits in the hand."""
    for _ in range(person.steps(SEAT_TIME)):
        if person.grips.error(hand) < 0.5 * person.options.grip_error:
            break
        yield


def lead_blend(
    start: NDArray[np.float64], goal: NDArray[np.float64], phase: float, *, leading: str
) -> NDArray[np.float64]:
    """A point between two positions (3,) where height leads (`up`) or follows (`across`) the horizontal."""
    early = minimum_jerk(phase / (1.0 - _SHIFT))
    late = minimum_jerk((phase - _SHIFT) / (1.0 - _SHIFT))
    across, up = (late, early) if leading == "up" else (early, late)
    share = np.array([across, across, up])
    return start + share * (goal - start)
