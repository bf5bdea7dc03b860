"""Hands hold objects by welds between a hand's site and a grip site of the object."""

import math

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.errors import AssetError
from mjsim.kernels import kernel
from mjsim.model import avatar
from mjsim.model.scene import Scene
from mjsim.person.rig import Rig

AWAKE = -11  # in `MjData.tree_asleep`: for ten steps of the physics at least


GripState = tuple[tuple[int, int] | None, tuple[int, int] | None]  # object and grip, per hand


class Grips:
    """Closes, opens and watches the welds of the pool that `avatar.attach_avatar` declared."""

    def __init__(self, scene: Scene, data: mujoco.MjData, rig: Rig) -> None:
        self._data = data
        self._trees = scene.index.trees
        self._hand_sites = rig.grip_sites
        names = scene.index.names
        self._sites = np.array(
            [
                [_id(scene.model, mujoco.mjtObj.mjOBJ_SITE, f"{n}/grip_{k}") for k in avatar.GRIPS]
                for n in names
            ],
            np.intp,
        )
        self._welds = np.array(
            [
                [
                    [
                        [
                            _id(scene.model, mujoco.mjtObj.mjOBJ_EQUALITY, avatar.grip_name(h, n, k, kind))
                            for kind in (avatar.GENTLE, avatar.FIRM)
                        ]
                        for k in avatar.GRIPS
                    ]
                    for n in names
                ]
                for h in avatar.HANDS
            ],
            np.intp,
        )
        self._closed: list[tuple[int, int] | None] = [None, None]
        self.pairs = np.full((2, 2), -1, np.intp)
        self.reset()

    def nearest_grip(self, hand: int, item: int) -> int:
        """Grip of object `item` that has to be turned least to align with a hand: 0 or 1."""
        return self.grip_along(item, self._data.site_xmat[self._hand_sites[hand], 0::3])

    def grip_along(self, item: int, forward: NDArray[np.float64]) -> int:
        """Grip of object `item` whose x axis is nearest to a direction (3,): 0 or 1."""
        agreement = [float(self._data.site_xmat[site, 0::3] @ forward) for site in self._sites[item]]
        return int(np.argmax(agreement))

    def point(self, item: int, grip: int) -> NDArray[np.float64]:
        """Position of a grip site, m, shape (3,)."""
        return np.array(self._data.site_xpos[self._sites[item, grip]])

    def gap(self, hand: int, item: int, grip: int) -> float:
        """Distance between a hand and a grip site, m."""
        return site_gap(self._data.site_xpos, self._hand_sites[hand], self._sites[item, grip])

    def close(self, hand: int, item: int, grip: int, *, gently: bool = False) -> None:
        """Weld object `item` to a hand, firmly or at first gently; a sleeping object wakes."""
        self._data.eq_active[self._welds[hand, item, grip]] = (gently, not gently)
        self._closed[hand] = (item, grip)
        self._note()

    def open(self, hand: int) -> None:
        """Let go of what a hand holds, if anything."""
        closed = self._closed[hand]
        if closed is not None:
            self._data.eq_active[self._welds[hand, closed[0], closed[1]]] = 0
            # Falls begin slowly: what was held still would fall asleep in the air.
            self._data.tree_asleep[self._trees[closed[0]]] = AWAKE
            self._closed[hand] = None
            self._note()

    def error(self, hand: int) -> float:
        """How far the weld of a hand is stretched, m; 0 when it holds nothing."""
        closed = self._closed[hand]
        return 0.0 if closed is None else self.gap(hand, *closed)

    def get_state(self) -> GripState:
        """Object and grip that each hand holds; the welds themselves are part of the physics."""
        left, right = self._closed
        return left, right

    def set_state(self, state: GripState) -> None:
        """Go on from what `get_state` gave."""
        self._closed = list(state)
        self._note()

    def reset(self) -> None:
        """Forget what was held; the state's welds are reset with the state."""
        self._closed = [None, None]
        self._note()

    def _note(self) -> None:
        self.gripped = tuple(closed[0] for closed in self._closed if closed is not None)
        for hand, closed in enumerate(self._closed):
            self.pairs[hand] = (-1, -1) if closed is None else (self._hand_sites[hand], self._sites[closed])


@kernel
def site_gap(site_xpos: NDArray[np.float64], first: int, second: int) -> float:
    """Distance between two sites, m."""
    total = 0.0
    for axis in range(3):
        total += (site_xpos[first, axis] - site_xpos[second, axis]) ** 2
    return math.sqrt(total)


@kernel
def site_angle(site_xmat: NDArray[np.float64], first: int, second: int) -> float:
    """Angle between two sites' frames, rad."""
    trace = 0.0  # of the rotation from one to the other: 1 + 2 cos(angle)
    for k in range(9):
        trace += site_xmat[first, k] * site_xmat[second, k]
    return math.acos(min(1.0, max(-1.0, 0.5 * (trace - 1.0))))


def _id(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    found = int(mujoco.mj_name2id(model, kind, name))
    if found < 0:
        raise AssetError(f"the model has no {kind.name} {name!r}; compose the scene with avatar=True")
    return found
