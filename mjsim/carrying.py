"""Carrying: the posture of the hands, and how they keep what they hold off the house.

A person draws a box in when passing a door frame. Here a hand looks up the clearance around the place where it
is about to be and moves away from what is too near. Should the object touch something static all the same, the
hand gives way along the contact's normal, and where it cannot any further, the body does not walk or turn into
the contact. What still gets caught, by a blow or from above, slips out of the hand.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjsim import avatar
from mjsim.clearance import ClearanceField
from mjsim.inventory import LEFT, RIGHT
from mjsim.person import Person
from mjsim.placing import object_corners

CARRY_BAND = (0.93, 1.60)  # heights that carried things take up, m
_LOWEST = 0.97  # m, for the underside of what is carried: above counters
_MARGIN = 0.03  # m
_HORIZONS = (0.0, 0.15, 0.3)  # s, how far ahead a hand looks
_ROUNDS = 3
_MOST_SHIFT = 0.2  # m
_EXTENSIONS = (
    0.0,
    0.15,
    0.3,
    0.45,
    0.6,
    0.7,
    0.8,
    0.9,
    1.0,
)  # of the way from the body's axis to the posture
_OVER_GAP = 0.04  # m, between two held things one above the other
_PASSING = 0.10  # m of approach over which one is raised above the other
_PUSH_BACK = 0.25  # m/s beyond the speed of approach
_RELAX = 0.9  # 1/s
_MOST_YIELD = 0.15  # m
_MOST_HELD_BACK = 0.25  # m; the servo saturates at 0.04 m, from there on the hand is dragged behind
_UPRIGHT = 0.3  # horizontal share below which a contact is a surface underneath, not an obstacle


@dataclass(frozen=True)
class _Load:
    """Size of an object about its grip: how far it reaches sideways and down, m."""

    radius: float
    height: float


class Carrying:
    """Keeps both hands in posture; one instance per world."""

    def __init__(self, person: Person) -> None:
        scene = person.scene
        low, high = CARRY_BAND
        self._person = person
        self._clearance = ClearanceField.from_model(scene.model, low=low, high=high)
        self._loads = [_load(person, item) for item in range(len(scene.index.names))]
        self._yield = np.zeros((2, 2))
        self._strained = [0, 0]

    def reset(self) -> None:
        """Forget all contacts."""
        self._yield[:] = 0.0
        self._strained = [0, 0]

    def memory(self) -> dict[str, Any]:
        """How far the hands have given way and for how long they are strained, JSON-ready."""
        return {"yield": self._yield.tolist(), "strained": list(self._strained)}

    def recall(self, memory: dict[str, Any]) -> None:
        """Take over what `memory` gave."""
        self._yield = np.array(memory["yield"])
        self._strained = list(memory["strained"])

    def update(self, held_posture: tuple[float, float, float]) -> None:
        """Set the targets of the hands that no motion moves, and guard the walking command.

        Args:
            held_posture: Where a hand that holds something belongs, such as `avatar.CARRY`.
        """
        person = self._person
        self._yield *= 1.0 - _RELAX * person.dt
        goals = [np.array(avatar.posture(hand, avatar.REST)) for hand in (LEFT, RIGHT)]
        for hand, item in enumerate(person.held):
            if item is None or hand == person.moving_hand:
                continue
            for normal in self._obstacle_normals(item):
                self._give_way(hand, normal)
            goals[hand] = self.place_for(hand, item, held_posture)
            goals[hand][:2] += self._yield[hand]
        if None not in person.held and person.moving_hand is None:
            self._raise_right(goals)
        for hand, goal in enumerate(goals):
            if hand != person.moving_hand:
                person.move_hand(hand, goal)

    def place_for(
        self, hand: int, item: int, held_posture: tuple[float, float, float] = avatar.CARRY
    ) -> NDArray[np.float64]:
        """Where a hand best holds object `item` now, clear of the house: body frame, m, (3,)."""
        load = self._loads[item]
        forward, side, up = avatar.posture(hand, held_posture)
        return np.array([*self._drawn_in(forward, side, load.radius), max(up, _LOWEST + load.height)])

    def _raise_right(self, goals: list[NDArray[np.float64]]) -> None:
        """Where two held things would meet, pass the right one over the left one."""
        left, right = (self._loads[item] for item in self._person.held if item is not None)
        apart = math.hypot(*(goals[RIGHT] - goals[LEFT])[:2])
        near = (left.radius + right.radius + _PASSING - apart) / _PASSING
        over = goals[LEFT][2] + right.height + _OVER_GAP - goals[RIGHT][2]
        goals[RIGHT][2] += min(1.0, max(0.0, near)) * max(0.0, over)

    def slipped(self, hand: int) -> bool:
        """Whether a hand has for too long been stretched off its load, or held back by it; counts this step."""
        person = self._person
        error = person.grips.error(hand)
        held_back = float(np.linalg.norm(person.rig.hands[hand] - person.rig.hand_targets[hand]))
        strained = error > person.options.grip_error or held_back > _MOST_HELD_BACK
        self._strained[hand] = self._strained[hand] + 1 if strained else 0
        return self._strained[hand] * person.dt > person.options.grip_patience

    def _drawn_in(self, forward: float, left: float, radius: float) -> tuple[float, float]:
        """Place nearest to a posture (forward, left) where a load is clear of the house, now and shortly.

        Sideways first, as past a door frame; then as far out from the body's axis as nothing is in between: the
        far side of a wall is clear, but out of the question.
        """
        shift_f, shift_l = self._sideways(forward, left, radius + _MARGIN)
        forward, left = forward + shift_f, left + shift_l
        best, best_room, before = (0.0, 0.0), -math.inf, -math.inf
        for share in _EXTENSIONS:
            place = (share * forward, share * left)
            room = min(self._room(*place, horizon)[0] for horizon in _HORIZONS) - radius
            clear = room >= 0.5 * _MARGIN
            if not clear and room < before:
                break
            if clear or room > best_room:
                best, best_room = place, room
            before = room
        return best

    def _sideways(self, forward: float, left: float, needed: float) -> tuple[float, float]:
        """Shift in the body frame, away from what is too near."""
        shift_f, shift_l = 0.0, 0.0
        for horizon in _HORIZONS:
            for _ in range(_ROUNDS):
                room, away_f, away_l = self._room(forward + shift_f, left + shift_l, horizon)
                if room >= needed:
                    break
                shift_f += (needed - room) * away_f
                shift_l += (needed - room) * away_l
        size = math.hypot(shift_f, shift_l)
        limit = min(1.0, _MOST_SHIFT / size) if size else 1.0
        return shift_f * limit, shift_l * limit

    def _room(self, forward: float, left: float, horizon: float) -> tuple[float, float, float]:
        """Clearance in `horizon` seconds at a place of the body frame, and the way out, in that frame."""
        rig = self._person.rig
        forward += float(rig.velocity[0]) * horizon
        left += float(rig.velocity[1]) * horizon
        heading = rig.heading + rig.turn * horizon
        x, y = rig.position.tolist()
        c, s = math.cos(heading), math.sin(heading)
        room, away_x, away_y = self._clearance.at(x + c * forward - s * left, y + s * forward + c * left)
        return room, c * away_x + s * away_y, c * away_y - s * away_x

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
        rig = self._person.rig
        c, s = np.cos(rig.heading), np.sin(rig.heading)
        away = np.array([c * normal[0] + s * normal[1], c * normal[1] - s * normal[0]])
        x, y = rig.hand_targets[hand, :2]
        swing = float(away @ np.array([-y, x])) * rig.turn
        approach = -(float(away @ rig.velocity) + swing)
        self._yield[hand] += away * ((max(approach, 0.0) + _PUSH_BACK) * self._person.dt)
        size = float(np.linalg.norm(self._yield[hand]))
        if size > _MOST_YIELD:
            self._yield[hand] *= _MOST_YIELD / size
            if swing < 0.0:
                rig.turn = 0.0
            into = float(away @ rig.velocity)
            if into < 0.0:
                rig.velocity = rig.velocity - into * away


def _load(person: Person, item: int) -> _Load:
    index = person.scene.index
    corners = object_corners(person.scene.model, index.geoms(index.names[item]))
    grip = person.scene.model.site(f"{index.names[item]}/grip_0").pos
    about = corners - grip
    return _Load(radius=float(np.hypot(about[:, 0], about[:, 1]).max()), height=float(-about[:, 2].min()))
