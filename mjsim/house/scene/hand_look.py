"""How the person's hands look."""

from collections.abc import Sequence
from typing import Any

import mujoco

_VISUAL: dict[str, Any] = {"group": 2, "contype": 0, "conaffinity": 0, "mass": 0.0}
_GLOVE = (0.93, 0.74, 0.22, 1.0)
_SLEEVE = (0.24, 0.34, 0.47, 1.0)


def draw_hand(node: Any, name: str, side: float) -> None:
    """A cleaning glove and a sleeve, which collide with nothing; `side` is 1 for the left, -1 for the right hand."""

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
    capsule("cuff", _GLOVE, 0.033, -0.045, 0, 0.034, -0.080, side * 0.012, 0.034)
    capsule("sleeve", _SLEEVE, 0.036, -0.080, side * 0.012, 0.034, -0.150, side * 0.040, 0.030)
