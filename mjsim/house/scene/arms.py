"""The visible hands and sleeves of the person. They have no mass and collide with nothing.

The physics moves free hands in front of the body. In pictures, a sleeve joins each hand to its shoulder, and
a hand that is idle hangs at the person's side. Renderers call `arm_pose` for each picture.
"""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

# Positions forward, sideways and up, in metres, for a person of default eye height.
SHOULDER = (-0.05, 0.19, 1.34)
HANGING = (0.03, 0.26, 0.80)  # hand that is idle
WRIST = (-0.080, 0.012, 0.034)  # end of the sleeve, relative to the hand
HANGING_TILT = math.radians(70.0)  # angle by which the fingers of an idle hand point down
IDLE_RANGE = 0.12  # distance from the rest posture at which a hand counts as in use, in metres
SLEEVE = "sleeve"  # last part of the name of a sleeve's geom, after the prefix, the hand and `_`
_GLOVE = (0.93, 0.74, 0.22, 1.0)
_SLEEVE = (0.24, 0.34, 0.47, 1.0)
_SLEEVE_RADIUS = 0.036  # in metres
_VISUAL: dict[str, Any] = {"group": 2, "contype": 0, "conaffinity": 0, "mass": 0.0}


class ArmPose(NamedTuple):
    """An arm as it is drawn. Positions are in the frame of the body, in metres."""

    hand: NDArray[np.float64]
    tilt: float  # angle by which the fingers point down, in radians
    wrist: NDArray[np.float64]
    shoulder: NDArray[np.float64]


def arm_pose(hand: ArrayLike, rest: ArrayLike, scale: float) -> ArmPose:
    """Return the pose in which an arm is drawn.

    Args:
        hand: Position of the hand in the physics, in the frame of the body, in metres, shape (3,).
        rest: Rest posture of the hand, in the same frame, shape (3,).
        scale: Eye height of the person, divided by the default eye height.
    """
    place, idle_place = np.asarray(hand, dtype=np.float64), np.asarray(rest, dtype=np.float64)
    side = math.copysign(1.0, idle_place[1])
    idle = max(0.0, 1.0 - float(np.linalg.norm(place - idle_place)) / IDLE_RANGE)
    idle *= idle * (3.0 - 2.0 * idle)
    drawn = place + idle * (np.array(HANGING) * (1.0, side, scale) - idle_place)
    tilt = idle * HANGING_TILT
    wrist = drawn + tilted(tilt) @ (np.array(WRIST) * (1.0, side, 1.0))
    return ArmPose(drawn, tilt, wrist, np.array(SHOULDER) * (1.0, side, scale))


def tilted(angle: float) -> NDArray[np.float64]:
    """Return the matrix (3, 3) of a rotation that tilts the forward axis down by an angle in radians."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def draw_hand(node: Any, name: str, rest: tuple[float, float, float], scale: float) -> None:
    """Add the visible glove and sleeve of a hand with a rest posture. `scale` is that of `arm_pose`."""
    side = math.copysign(1.0, rest[1])

    def capsule(part: str, rgba: Sequence[float], radius: float, *ends: float) -> None:
        node.add_geom(
            name=f"{name}_{part}",
            type=mujoco.mjtGeom.mjGEOM_CAPSULE,
            size=[radius, 0, 0],
            fromto=list(ends),
            rgba=list(rgba),
            **_VISUAL,
        )

    node.add_geom(
        name=f"{name}_palm",
        type=mujoco.mjtGeom.mjGEOM_ELLIPSOID,
        size=[0.046, 0.040, 0.019],
        pos=[-0.012, 0, 0.030],
        rgba=list(_GLOVE),
        **_VISUAL,
    )
    for i in range(4):
        y = side * (0.030 - 0.020 * i)
        x = 0.052 - 0.006 * abs(i - 1)
        capsule(f"finger_{i}", _GLOVE, 0.0095, 0.02, y, 0.030, x, y, 0.008)
        capsule(f"tip_{i}", _GLOVE, 0.0088, x, y, 0.008, x - 0.004, y, -0.022)
    capsule("thumb", _GLOVE, 0.0105, -0.03, -side * 0.030, 0.024, 0.012, -side * 0.048, -0.012)
    wrist, shoulder = np.array(WRIST) * (1.0, side, 1.0), np.array(SHOULDER) * (1.0, side, scale)
    capsule("cuff", _GLOVE, 0.033, -0.045, 0, 0.034, *wrist)
    capsule(SLEEVE, _SLEEVE, _SLEEVE_RADIUS, *wrist, *(shoulder - rest))
