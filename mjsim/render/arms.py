"""Draw the person's arms: sleeves from the hands to the shoulders, and the posture of empty hands."""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.arms import SLEEVE, arm_pose, tilted
from mjsim.values.person_parameters import PersonParameters


class _Arm(NamedTuple):
    hand: int  # body of the hand
    geoms: NDArray[np.intp]  # visible geoms of the hand without the sleeve
    sleeve: int
    rest: tuple[float, float, float]  # position of the hand at rest, in metres


class Arms:
    """The arms in a model. A model without a person has none."""

    def __init__(self, model: Any) -> None:
        self._body = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, avatar.BODY)
        self._scale = 1.0
        self._arms: list[_Arm] = []
        self._places: dict[int, int] = {}  # index in the MuJoCo scene of each geom that `place` moves
        sleeves = [
            mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_GEOM, f"{avatar.PREFIX}{hand}_{SLEEVE}")
            for hand in avatar.HANDS
        ]
        if self._body < 0 or min(sleeves) < 0:
            return
        eye_height = float(model.body(avatar.HEAD).pos[2])
        self._scale = eye_height / PersonParameters.eye_height
        for number, sleeve in enumerate(sleeves):
            hand = int(model.geom_bodyid[sleeve])
            geoms = np.setdiff1d(np.flatnonzero(model.geom_bodyid == hand), [sleeve])
            rest = avatar.posture(number, avatar.REST, eye_height)
            self._arms.append(_Arm(hand, geoms, sleeve, rest))

    @property
    def sleeves(self) -> list[int]:
        """The geoms whose lengths differ between frames."""
        return [arm.sleeve for arm in self._arms]

    def pose(
        self, data: Any, positions: NDArray[np.float64], rotations: NDArray[np.float64]
    ) -> dict[int, float]:
        """Change the `positions` (ngeom, 3) and `rotations` (ngeom, 3, 3) of the arms' geoms in place.

        Return half the length of each sleeve in metres, by geom.
        """
        lengths = {}
        for arm in self._arms:
            body, turn = data.xpos[self._body], data.xmat[self._body].reshape(3, 3)
            hand = data.xpos[arm.hand]
            pose = arm_pose(turn.T @ (hand - body), arm.rest, self._scale)
            tilt = turn @ tilted(pose.tilt) @ turn.T
            positions[arm.geoms] = body + turn @ pose.hand + (positions[arm.geoms] - hand) @ tilt.T
            rotations[arm.geoms] = tilt @ rotations[arm.geoms]
            wrist, shoulder = body + turn @ pose.wrist, body + turn @ pose.shoulder
            positions[arm.sleeve] = (wrist + shoulder) / 2.0
            rotations[arm.sleeve] = _upright(shoulder - wrist)
            lengths[arm.sleeve] = float(np.linalg.norm(shoulder - wrist)) / 2.0
        return lengths

    def place(
        self,
        scene: Any,
        positions: NDArray[np.float64],
        rotations: NDArray[np.float64],
        lengths: dict[int, float],
    ) -> None:
        """Move the arms' geoms of a MuJoCo scene to the result of `pose`."""
        moved = {int(geom) for arm in self._arms for geom in (*arm.geoms, arm.sleeve)}
        if not moved:
            return
        geoms = scene.geoms
        if any(geoms[index].objid != geom for geom, index in self._places.items()) or not self._places:
            kind = mujoco.mjtObj.mjOBJ_GEOM
            shown = enumerate(geoms[: scene.ngeom])
            self._places = {g.objid: i for i, g in shown if g.objtype == kind and g.objid in moved}
        for geom, index in self._places.items():
            drawn = geoms[index]
            drawn.pos, drawn.mat = positions[geom], rotations[geom]
            if geom in lengths:
                drawn.size = (*drawn.size[:2], lengths[geom])


def _upright(along: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a rotation (3, 3) that turns the z axis to a direction."""
    quaternion, matrix = np.zeros(4), np.zeros(9)
    mujoco.mju_quatZ2Vec(quaternion, along)
    mujoco.mju_quat2Mat(matrix, quaternion)
    return matrix.reshape(3, 3)
