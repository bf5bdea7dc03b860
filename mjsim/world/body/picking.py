"""Picking as a motion: stand, turn, reach, weld gently, lift into the carrying posture, close firmly."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from mjsim.world.body.hand_path import ACROSS_FIRST, UP_FIRST
from mjsim.world.body.person import Motion, Person, Steps

_ARRIVAL_TIMEOUT = 0.4  # s, longest wait for the hand to arrive after the reach
_GRIP_TIMEOUT = 0.2  # s, longest wait for the firm grip to draw the load in
_CLOSE_ENOUGH = 0.012  # m


def pick(
    person: Person,
    hand: int,
    item: int,
    carry_position: Callable[[int, int], NDArray[np.float64]],
    pitch: float,
) -> Motion:
    """Reach for object `item`, lift it and look to `pitch`, rad; whether the hand then carries it."""
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
    # Held gently, a load hangs 2 cm off the hand: only now, clear of its neighbours, is it drawn in.
    grips.close(hand, item, grip)
    yield from _draw_in(person, hand)
    if grips.error(hand) > person.options.grip_error:
        grips.open(hand)
        return False
    return True


def _reach(person: Person, hand: int, item: int, grip: int) -> Steps:
    """Over the object first, then down to it; the goal is followed while it moves."""
    steps = person.steps(person.motion.reach_time)
    for _ in person.swing(
        hand, lambda: person.rig.to_body(person.grips.point(item, grip)), steps, ACROSS_FIRST
    ):
        person.glance(person.center(item))
        yield


def _lift(person: Person, hand: int, goal: NDArray[np.float64], pitch: float) -> Steps:
    """Straight up first, so that nothing low is brushed, then back to the body."""
    for _ in range(person.steps(person.motion.align_time)):
        yield
    for _ in person.swing(hand, lambda: goal, person.steps(person.motion.lift_time), UP_FIRST):
        person.look_towards(pitch)
        yield


def _draw_in(person: Person, hand: int) -> Steps:
    """Wait until the firm grip has drawn the load into the hand."""
    for _ in range(person.steps(_GRIP_TIMEOUT)):
        if person.grips.error(hand) < 0.5 * person.options.grip_error:
            break
        yield
