"""The fall of a released object, where everything else is without physics."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import EventKind
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_world import KinematicWorld
from mjsim.fidelity.transitions import enter
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.options import REST_STEPS

_SETTLING_TIME = 1.0  # s, for other objects that still move when the released one has come to rest


@dataclass(frozen=True, eq=False)
class Fall:
    """The fall of a released object.

    Attributes:
        poses: Of all objects after each control step until it was at rest, or time was up, m and wxyz, shape (k, n, 7).
        rest: Where everything came to rest, shape (n, 7).
        success: Whether it rests in its receptacle.
        incidents: Other events: control step, kind and object.
    """

    poses: NDArray[np.float64]
    rest: NDArray[np.float64]
    success: bool
    incidents: tuple[tuple[int, EventKind, int], ...]


def drop(full: Full, kinematic: KinematicWorld, hand: int, item: int, receptacle: ReceptacleGeometry) -> Fall:
    """Release object `item` in physics, while the person stands; sleeping objects sleep on unless they are touched.

    Leaves the kinematic world with an empty hand and the new sleep states.
    """
    person = full.person
    options = person.options
    enter(full, kinematic)
    full.monitor.check(person.held)  # it is in the hand, for the last time
    person.grips.open(hand)
    kinematic.release(hand)
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
    for _ in range(person.steps(_SETTLING_TIME)):
        if full.is_settled(0.0):
            break
        incidents += [(len(poses), kind, which) for kind, which in _advance(full, held)]
    kinematic.asleep[:] = full.data.tree_asleep
    return Fall(np.array(poses), full.poses(), success, tuple(incidents))


def _advance(full: Full, held: Sequence[int | None]) -> list[tuple[EventKind, int]]:
    """Events of one control step, without physics if every object sleeps that no hand holds."""
    if not full.is_settled(0.0):
        full.person.rig.advance()
    events = list(full.monitor.check(held))
    return events + [(EventKind.DISLODGED, item) for item in full.dislodged()]
