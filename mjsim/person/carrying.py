"""Carrying: the posture of the hands, and how they keep what they hold off the house.

How a hand does that is in `postures`. What still gets caught, by a blow or from above, slips out of the hand.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.inventory import LEFT, RIGHT
from mjsim.model import avatar
from mjsim.model.clearance import carry_clearance
from mjsim.model.scene import Scene
from mjsim.person.person import Person
from mjsim.person.postures import LOWEST, count_strain, drawn_in, update_hands
from mjsim.person.slots import object_corners

_NO_CONTACTS = (np.zeros((0, 2), np.int32), np.zeros((0, 9)))
_HOUSE, _PERSON = -1, -2  # who bears a geom, where no object does


@dataclass(frozen=True, eq=False)
class CarryingState:
    """What carrying remembers between control steps.

    Attributes:
        compliance: How far contact has pushed each hand off its posture, m, shape (2, 2).
        strained: Control steps for which each hand has been strained, shape (2,).
    """

    compliance: NDArray[np.float64]
    strained: NDArray[np.int64]


class Carrying:
    """Keeps both hands in posture; one instance per world.

    Attributes:
        loads: How far each object reaches sideways and down about its grip, m, shape (n, 2).
        field: Clearance at the heights of what is carried: arrays of a `ClearanceField`, for kernels.
    """

    def __init__(self, person: Person) -> None:
        scene = person.scene
        self._person = person
        self.field = carry_clearance(scene).arrays
        self.loads = np.array([_load(person, item) for item in range(len(scene.index.names))]).reshape(-1, 2)
        self._bearer = _bearers(scene)
        self._rest = np.array(avatar.REST)
        self._postures = {p: np.array(p) for p in (avatar.CARRY, avatar.TUCKED, avatar.ASIDE)}
        self._goals = np.zeros((2, 3))
        self._compliance = np.zeros((2, 2))
        self._strained = np.zeros(2, np.int64)

    def reset(self) -> None:
        """Forget all contacts."""
        self._compliance[:] = 0.0
        self._strained[:] = 0

    def get_state(self) -> CarryingState:
        """Compliance offsets and strain of the hands as a value."""
        return CarryingState(self._compliance.copy(), self._strained.copy())

    def set_state(self, state: CarryingState) -> None:
        """Go on from what `get_state` gave."""
        self._compliance[:] = state.compliance
        self._strained[:] = state.strained

    def update(self, held_posture: tuple[float, float, float]) -> None:
        """Set the targets of the hands that no motion moves, and guard the walking command.

        Args:
            held_posture: Where a hand that holds something belongs, such as `avatar.CARRY`.
        """
        person, rig = self._person, self._person.rig
        left, right = (-1 if item is None else item for item in person.held)
        moving = -1 if person.moving_hand is None else person.moving_hand
        geoms, frames = self._contacts() if left >= 0 or right >= 0 else _NO_CONTACTS
        posture = self._postures[held_posture]
        update_hands(
            rig.pose, rig.motion, rig.hand_targets, person.hand_velocities, self._compliance, self._goals,
            left, right, moving, posture, self._rest, self.loads, *self.field,
            geoms, frames, self._bearer, person.dt,
        )  # fmt: skip

    def place_for(
        self, hand: int, item: int, held_posture: tuple[float, float, float] = avatar.CARRY
    ) -> NDArray[np.float64]:
        """Where a hand best holds object `item` now, clear of the house: body frame, m, (3,)."""
        radius, height = self.loads[item].tolist()
        forward, side, up = avatar.posture(hand, held_posture)
        rig = self._person.rig
        return np.array(
            [*drawn_in(forward, side, radius, rig.pose, rig.motion, *self.field), max(up, LOWEST + height)]
        )

    def _contacts(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        """Geoms (k, 2) and frames (k, 9) of all contacts."""
        contact = self._person.data.contact
        # Strides differ with the number of contacts, and kernels with the strides.
        return np.ascontiguousarray(contact.geom), np.ascontiguousarray(contact.frame)

    def slipped(self) -> tuple[int, ...]:
        """Hands that have for too long been stretched off their loads, or held back by them; counts this step."""
        person, rig, options = self._person, self._person.rig, self._person.options
        left, right = person.held
        if left is None and right is None:
            self._strained[:] = 0
            return ()
        patience = options.grip_patience / person.dt
        found = count_strain(
            rig.pose, rig.hand_targets, person.data.site_xpos, person.grips.pairs, left is not None,
            right is not None, options.grip_error, patience, self._strained,
        )  # fmt: skip
        return tuple(hand for hand in (LEFT, RIGHT) if found & (1 << hand))


def _load(person: Person, item: int) -> tuple[float, float]:
    """How far an object reaches sideways and down about its grip, m."""
    index = person.scene.index
    corners = object_corners(person.scene.model, index.geoms(index.names[item]))
    grip = person.scene.model.site(f"{index.names[item]}/grip_0").pos
    about = corners - grip
    return float(np.hypot(about[:, 0], about[:, 1]).max()), float(-about[:, 2].min())


def _bearers(scene: Scene) -> NDArray[np.int32]:
    """Object that each geom belongs to, `_HOUSE` or `_PERSON`, shape (ngeom,)."""
    model, owner = scene.model, scene.index.geom_owner
    static = model.body_weldid[model.geom_bodyid] == 0
    return np.where(owner >= 0, owner, np.where(static, _HOUSE, _PERSON)).astype(np.int32)
