"""A controller for hands that carry objects, which keeps the objects away from walls and furniture.

An object that gets stuck slips out of the hand. It counts as stuck if its weld is stretched, if the hand lags far
behind its target position, or if the hand yields to furniture as far as it can for several seconds.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.scene import avatar
from mjsim.house.scene.avatar import LEFT, RIGHT
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel
from mjsim.values.motion_parameters import CarryingParameters
from mjsim.world.body.grips import site_gap
from mjsim.world.body.load_room import BodyMotion, drawn_in
from mjsim.world.body.person import Person
from mjsim.world.body.postures import Contacts, Hands, Holding, update_hands
from mjsim.world.body.slots import object_corners

Floats = NDArray[np.float64]

# Lag of a hand at which it counts as stuck, in metres. The servo reaches its force limit at 0.04 m.
MAX_SERVO_LAG = 0.25
# Strain of a hand in a control step in which it yields as far as it can, relative to that of a stretched weld
YIELDING = 0.04
_NO_GEOMS, _NO_FRAMES = np.zeros((0, 2), np.int32), np.zeros((0, 9))
_HOUSE, _PERSON = -1, -2  # owner numbers of geoms that do not belong to an object


@kernel
def count_strain(
    pose: Floats,
    targets: Floats,
    site_xpos: Floats,
    sites: NDArray[np.intp],
    held: tuple[bool, bool],
    yields: tuple[bool, bool],
    max_error: float,
    patience: float,
    strained: Floats,
) -> int:
    """Update `strained` (2,), the number of consecutive control steps in which each hand was strained.

    A hand is strained if its weld is stretched by more than `max_error` metres or it lags far behind its target. A
    step in which the hand only `yields` as far as it can counts as `YIELDING`. Returns a bit mask of the hands whose
    number exceeds `patience`: 1 for the left, 2 for the right.
    """
    slipping = 0
    for hand in range(2):
        if not held[hand]:
            strained[hand] = 0.0
            continue
        lag = 0.0
        for axis in range(3):
            lag += (pose[4 + 3 * hand + axis] - targets[hand, axis]) ** 2
        first, second = sites[hand, 0], sites[hand, 1]
        error = site_gap(site_xpos, first, second) if first >= 0 else 0.0
        tense = error > max_error or math.sqrt(lag) > MAX_SERVO_LAG
        strain = 1.0 if tense else YIELDING if yields[hand] else 0.0
        strained[hand] = strained[hand] + strain if strain > 0.0 else 0.0
        if strained[hand] > patience:
            slipping += 1 << hand
    return slipping


@dataclass(frozen=True, eq=False)
class CarryingState:
    """The state of a `Carrying` controller between control steps."""

    # Horizontal offset by which contacts have pushed each hand from its posture, in metres, shape (2, 2).
    compliance: NDArray[np.float64]
    strained: Floats  # number of consecutive control steps in which each hand was strained, shape (2,)


class Carrying:
    """A controller that keeps both hands in their postures. Each world has one controller."""

    def __init__(self, person: Person) -> None:
        scene, rig = person.scene, person.rig
        self._person = person
        # Horizontal radius and downward extent of each object from its grip, in metres, shape (n, 2).
        self.loads = np.array([_load(person, item) for item in range(len(scene.index.names))]).reshape(-1, 2)
        self._owners = _geom_owners(scene)
        self._no_contacts = (_NO_GEOMS, _NO_FRAMES, self._owners)
        eyes = person.parameters.eye_height
        postures = avatar.CARRY, avatar.TUCKED, avatar.ASIDE
        self._postures = {p: np.array(avatar.posture(LEFT, p, eyes)) for p in postures}
        self._compliance = np.zeros((2, 2))
        targets, rest = rig.hand_targets, np.array(avatar.posture(LEFT, avatar.REST, eyes))
        self._body = (rig.pose, rig.motion, tuple(person.clearance))
        self._hands = (
            targets, person.hand_velocities, self._compliance, np.zeros((2, 3)), rest, self.loads,
            person.posture_pace,
        )  # fmt: skip
        self._parameters = tuple(person.parameters.carrying)
        self._strained = np.zeros(2)

    def reset(self) -> None:
        self._compliance[:] = 0.0
        self._strained[:] = 0

    def get_state(self) -> CarryingState:
        return CarryingState(self._compliance.copy(), self._strained.copy())

    def set_state(self, state: CarryingState) -> None:
        self._compliance[:] = state.compliance
        self._strained[:] = state.strained

    def update(self, held_posture: tuple[float, float, float]) -> None:
        """Update the targets of hands that are not picking or placing. Cancel commands that push objects into walls."""
        person = self._person
        left, right = person.held
        left, right = -1 if left is None else left, -1 if right is None else right
        moving = -1 if person.moving_hand is None else person.moving_hand
        holding = (left, right, moving, self._postures[held_posture])
        contacts = self._contacts() if left >= 0 or right >= 0 else self._no_contacts
        _update_hands(self._body, self._hands, self._parameters, holding, contacts, person.dt)

    def carry_position(self, hand: int, item: int, body: BodyMotion | None = None) -> NDArray[np.float64]:
        """Return the hand position (3,), in the body frame, for carrying an object without collisions."""
        radius, height = self.loads[item].tolist()
        forward, left, up = avatar.posture(hand, avatar.CARRY, self._person.parameters.eye_height)
        rig, carrying = self._person.rig, self._person.parameters.carrying
        body = body or BodyMotion(rig.pose, rig.motion, self._person.clearance)
        point = drawn_in(forward, left, radius, body, carrying)
        return np.array([*point, max(up, carrying.least_height + height)])

    def _contacts(self) -> tuple[Any, ...]:
        data = self._person.data
        if not data.ncon:
            return self._no_contacts
        contact = data.contact
        # Kernels are compiled once per memory layout, so make the arrays contiguous.
        return np.ascontiguousarray(contact.geom), np.ascontiguousarray(contact.frame), self._owners

    def slipped(self) -> tuple[int, ...]:
        """Update the strain of both hands. Return the hands that have been strained for too long."""
        person, options = self._person, self._person.options
        left, right = person.held
        if left is None and right is None:
            self._strained[:] = 0
            return ()
        most = 0.99 * person.parameters.carrying.most_compliance
        left_yields, right_yields = (np.hypot(*self._compliance.T) > most).tolist()
        found = count_strain(
            person.rig.pose,
            person.rig.hand_targets,
            person.data.site_xpos,
            person.grips.sites,
            (left is not None, right is not None),
            (left_yields, right_yields),
            options.grip_error,
            options.grip_patience / person.dt,
            self._strained,
        )
        return tuple(hand for hand in (LEFT, RIGHT) if found & (1 << hand)) if found else ()


@kernel
def _update_hands(body: Any, hands: Any, carrying: Any, holding: Any, contacts: Any, dt: float) -> None:
    """Call `update_hands`. Arguments are plain tuples, which Numba unpacks twice as fast as named tuples."""
    pose, command, clearance = body
    motion = BodyMotion(pose, command, ClearanceField(*clearance))
    update_hands(
        motion, Hands(*hands), CarryingParameters(*carrying), Holding(*holding), Contacts(*contacts), dt
    )


def _load(person: Person, item: int) -> tuple[float, float]:
    index = person.scene.index
    corners = object_corners(person.scene.model, index.geoms(index.names[item]))
    grip = person.scene.model.site(f"{index.names[item]}/grip_0").pos
    about = corners - grip
    return float(np.hypot(about[:, 0], about[:, 1]).max()), float(-about[:, 2].min())


def _geom_owners(scene: Scene) -> NDArray[np.int32]:
    model, owner = scene.model, scene.index.geom_owner
    static = model.body_weldid[model.geom_bodyid] == 0
    return np.where(owner >= 0, owner, np.where(static, _HOUSE, _PERSON)).astype(np.int32)
