"""Grips, which are MuJoCo welds between a hand and a grip site of an object."""

import itertools
import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene, find_id
from mjsim.support.kernels import kernel
from mjsim.world.body.rig import Rig

AWAKE = -11  # value of `MjData.tree_asleep` that keeps a tree awake for at least ten physics steps


GripState = tuple[tuple[int, int] | None, tuple[int, int] | None]  # object and grip index for each hand


class Grips:
    """The welds between hands and objects that `avatar.attach_avatar` has added to a model."""

    def __init__(self, scene: Scene, data: mujoco.MjData, rig: Rig) -> None:
        self._data = data
        self._trees = scene.index.trees
        self._hand_sites = rig.grip_sites
        model, names, kinds = scene.model, scene.index.names, (avatar.GENTLE, avatar.FIRM)
        sites = [
            find_id(model, mujoco.mjtObj.mjOBJ_SITE, f"{name}/grip_{grip}")
            for name, grip in itertools.product(names, avatar.GRIPS)
        ]
        welds = [
            find_id(model, mujoco.mjtObj.mjOBJ_EQUALITY, avatar.grip_name(*key))
            for key in itertools.product(avatar.HANDS, names, avatar.GRIPS, kinds)
        ]
        self._grip_sites = np.array(sites, np.intp).reshape(len(names), len(avatar.GRIPS))
        self._welds = np.array(welds, np.intp).reshape(2, len(names), len(avatar.GRIPS), 2)
        self.sites = np.full((2, 2), -1, np.intp)  # site of each loaded hand and of its object's grip, or -1
        self.reset()

    def nearest_grip(self, hand: int, item: int) -> int:
        """Return the grip of an object, 0 or 1, for which the hand has to turn less."""
        return self.grip_along(item, self._data.site_xmat[self._hand_sites[hand], 0::3])

    def grip_along(self, item: int, forward: NDArray[np.float64]) -> int:
        """Return the grip of an object (0 or 1) whose x axis is best aligned with a direction (3,)."""
        agreement = [float(self._data.site_xmat[site, 0::3] @ forward) for site in self._grip_sites[item]]
        return int(np.argmax(agreement))

    def point(self, item: int, grip: int) -> NDArray[np.float64]:
        """Return the position (3,) of a grip site in metres."""
        return np.array(self._data.site_xpos[self._grip_sites[item, grip]])

    def gap(self, hand: int, item: int, grip: int) -> float:
        return site_gap(self._data.site_xpos, self._hand_sites[hand], self._grip_sites[item, grip])

    def close(self, hand: int, item: int, grip: int, *, gently: bool = False) -> None:
        """Weld an object to a hand, with a soft weld if `gently` is True. A sleeping object wakes up."""
        self._data.eq_active[self._welds[hand, item, grip]] = (gently, not gently)
        self._held[hand] = (item, grip)
        self._update()

    def open(self, hand: int) -> None:
        held = self._held[hand]
        if held is not None:
            self._data.eq_active[self._welds[hand, held[0], held[1]]] = 0
            # Otherwise, MuJoCo would put the object to sleep in the air, because it starts to fall slowly.
            self._data.tree_asleep[self._trees[held[0]]] = AWAKE
            self._held[hand] = None
            self._update()

    def is_firm(self, hand: int) -> bool:
        """Return True if a firm weld holds the object in a hand. Return False for a soft weld or an empty hand."""
        held = self._held[hand]
        return held is not None and bool(self._data.eq_active[self._welds[hand, held[0], held[1], 1]])

    def error(self, hand: int) -> float:
        """Return the distance in metres by which the weld of a hand is stretched, or 0 for an empty hand."""
        held = self._held[hand]
        return 0.0 if held is None else self.gap(hand, *held)

    def get_state(self) -> GripState:
        """Return the object and grip in each hand. The welds themselves are part of the physics state."""
        left, right = self._held
        return left, right

    def set_state(self, state: GripState) -> None:
        self._held = list(state)
        self._update()

    def reset(self) -> None:
        self._held = [None, None]
        self._update()

    def _update(self) -> None:
        self.gripped = tuple(held[0] for held in self._held if held is not None)
        for hand, held in enumerate(self._held):
            self.sites[hand] = (-1, -1) if held is None else (self._hand_sites[hand], self._grip_sites[held])


@kernel
def site_gap(site_xpos: NDArray[np.float64], first: int, second: int) -> float:
    """Return the distance between two sites in metres. `site_xpos` (nsite, 3) is an array of `MjData`."""
    total = 0.0
    for axis in range(3):
        total += (site_xpos[first, axis] - site_xpos[second, axis]) ** 2
    return math.sqrt(total)


@kernel
def site_angle(site_xmat: NDArray[np.float64], first: int, second: int) -> float:
    """Return the angle between two site frames in radians. `site_xmat` (nsite, 9) is an array of `MjData`."""
    trace = 0.0  # The trace of the rotation between the frames is 1 + 2 cos(angle).
    for k in range(9):
        trace += site_xmat[first, k] * site_xmat[second, k]
    return math.acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))
