"""Carrying: the posture of the hands, and how they give way when what they hold touches the house.

A held object that touches something static is not dragged on until the grip breaks. The hand gives way along
the contact's normal, as an arm would; where it cannot any further, the body does not walk or turn into the
contact. What still gets caught, by a blow or from above, slips out of the hand.
"""

import numpy as np
from numpy.typing import NDArray

from mjsim import avatar
from mjsim.person import Person

_PUSH_BACK = 0.25  # m/s beyond the speed of approach
_RELAX = 0.9  # 1/s
_MOST_YIELD = 0.2  # m
_UPRIGHT = 0.3  # horizontal share below which a contact is a surface underneath, not an obstacle


class Carrying:
    """Keeps both hands in posture; one instance per world."""

    def __init__(self, person: Person) -> None:
        self._person = person
        self._yield = np.zeros((2, 2))
        self._stretched = [0, 0]

    def reset(self) -> None:
        """Forget all contacts."""
        self._yield[:] = 0.0
        self._stretched = [0, 0]

    def update(self, held_posture: tuple[float, float, float]) -> None:
        """Set the targets of the hands that no motion moves, and guard the walking command.

        Args:
            held_posture: Where a hand that holds something belongs, such as `avatar.CARRY`.
        """
        person = self._person
        self._yield *= 1.0 - _RELAX * person.dt
        for hand, item in enumerate(person.held):
            if hand == person.moving_hand:
                continue
            if item is None:
                person.retire(hand)
                continue
            for normal in self._obstacle_normals(item):
                self._give_way(hand, normal)
            goal = np.array(avatar.posture(hand, held_posture))
            goal[:2] += self._yield[hand]
            person.move_hand(hand, goal)

    def slipped(self, hand: int) -> bool:
        """Whether the weld of a hand has been stretched for longer than the grip holds; counts this step."""
        person = self._person
        error = person.grips.error(hand)
        person.monitor.max_weld_error = max(person.monitor.max_weld_error, error)
        stretched = error > person.options.grip_error
        self._stretched[hand] = self._stretched[hand] + 1 if stretched else 0
        return self._stretched[hand] * person.dt > person.options.grip_patience

    def _obstacle_normals(self, item: int) -> NDArray[np.float64]:
        """Horizontal normals, away from static geoms that object `item` touches, house frame, (k, 2)."""
        person = self._person
        data = person.data
        if not data.ncon:
            return np.zeros((0, 2))
        model, owner = person.scene.model, person.scene.index.geom_owner
        geoms = data.contact.geom
        first, second = owner[geoms[:, 0]] == item, owner[geoms[:, 1]] == item
        other = np.where(first, geoms[:, 1], geoms[:, 0])
        rows = np.flatnonzero((first | second) & (model.body_weldid[model.geom_bodyid[other]] == 0))
        normals = data.contact.frame[rows, :2] * np.where(first[rows], -1.0, 1.0)[:, None]
        sizes = np.linalg.norm(normals, axis=1)
        keep = sizes > _UPRIGHT
        return np.asarray(normals[keep] / sizes[keep, None])

    def _give_way(self, hand: int, normal: NDArray[np.float64]) -> None:
        person, rig = self._person, self._person.rig
        c, s = np.cos(rig.heading), np.sin(rig.heading)
        away = np.array([c * normal[0] + s * normal[1], c * normal[1] - s * normal[0]])
        x, y = rig.hand_targets[hand, :2]
        swing = float(away @ np.array([-y, x])) * rig.turn
        approach = -(float(away @ rig.velocity) + swing)
        self._yield[hand] += away * ((max(approach, 0.0) + _PUSH_BACK) * person.dt)
        size = float(np.linalg.norm(self._yield[hand]))
        if size > _MOST_YIELD:
            self._yield[hand] *= _MOST_YIELD / size
            if swing < 0.0:
                rig.turn = 0.0
            into = float(away @ rig.velocity)
            if into < 0.0:
                rig.velocity = rig.velocity - into * away
