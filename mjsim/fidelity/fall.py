"""The fall of what a hand lets go of, where all else is without physics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import EventKind
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import HOLDS
from mjsim.fidelity.kinematic_world import Walker
from mjsim.fidelity.transitions import enter
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.options import REST_STEPS

_COMING_TO_REST = 1.0  # s, for what still moves when the object has been found at rest


@dataclass(frozen=True, eq=False)
class Fall:
    """What became of an object that was let go of.

    Attributes:
        poses: Of all objects after each control step until it was at rest, or time was up, shape (k, n, 7).
        rest: Where everything came to rest, shape (n, 7).
        success: Whether it rests in its receptacle.
        incidents: What happened besides: control step, kind and object.
    """

    poses: NDArray[np.float64]
    rest: NDArray[np.float64]
    success: bool
    incidents: tuple[tuple[int, EventKind, int], ...]


def drop(full: Full, walker: Walker, hand: int, item: int, receptacle: ReceptacleGeometry) -> Fall:
    """Let go of object `item` in physics; what sleeps goes on sleeping unless it is touched, the person stands.

    Leaves the walk with an empty hand, and with what sleeps then.
    """
    person = full.person
    options = person.options
    enter(full, walker)
    full.monitor.check(person.held)  # it is in the hand, for the last time
    person.grips.open(hand)
    walker.live[HOLDS + hand] = -1
    held = [None if other == item else other for other in person.held]
    poses: list[NDArray[np.float64]] = []
    incidents: list[tuple[int, EventKind, int]] = []
    still, success = 0, False
    for step in range(person.steps(options.settle_time)):
        incidents += [(step, kind, which) for kind, which in _advance(full, held)]
        poses.append(full.poses())
        quiet = person.asleep(item) or person.speed(item) < options.settle_speed
        still = still + 1 if quiet else 0
        if still >= REST_STEPS:
            success = receptacle.contains(person.center(item), options.volume_margin)
            break
    for _ in range(person.steps(_COMING_TO_REST)):
        if full.calm(0.0):
            break
        incidents += [(len(poses), kind, which) for kind, which in _advance(full, held)]
    walker.asleep[:] = full.data.tree_asleep
    return Fall(np.array(poses), full.poses(), success, tuple(incidents))


def _advance(full: Full, held: Sequence[int | None]) -> list[tuple[EventKind, int]]:
    """One control step, without physics if all sleeps that nobody holds; what happened."""
    if not full.calm(0.0):
        full.person.rig.advance()
    happened = list(full.monitor.check(held))
    return happened + [(EventKind.DISLODGED, item) for item in full.dislodged()]
