"""Meshes of toys."""

import math

import numpy as np
from shapely.geometry import Polygon, box

from tools.authoring.mesh_tools import LabelledMesh, lathe, mm, side


def meshes() -> dict[str, LabelledMesh]:
    return {**_car(), **_ball(), **_rings(), **_duck()}


def _car() -> dict[str, LabelledMesh]:
    """A car, drawn from the side, with its nose at + and its tail at -."""
    hull = Polygon(mm("-110 22, 110 22, 112 45, 100 56, 55 62, -105 64, -112 50"))
    cabin = Polygon(mm("-85 60, 60 60, 25 97, 15 100, -55 100, -65 97"))
    panes = Polygon(mm("-72 64, 46 64, 18 91, -58 91")).difference(box(-0.016, 0.06, -0.006, 0.1))
    screens = Polygon(mm("57.5 66, 60 67, 30 96.5, 26.5 94.5"))
    return {
        "car_body": side(hull.buffer(0.003, quad_segs=3), 0.11),
        "car_cabin": side(cabin, 0.088),
        "car_panes": side(panes, 0.09),
        "car_screen": side(screens, 0.074),
    }


def _ball() -> dict[str, LabelledMesh]:
    """The six gores of a ball, tilted so that its stripes show from above."""
    t = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 11)
    line = np.column_stack([0.08 * np.cos(t), 0.08 * np.sin(t)])
    sixth = math.pi / 3
    gores = {f"ball_gore_{k}": lathe(line, 4, k * sixth, (k + 1) * sixth) for k in range(6)}
    tilt = math.radians(40)
    c, s = math.cos(tilt), math.sin(tilt)
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    return {name: gore.bent(lambda v: v @ turn + [0, 0, 0.08]) for name, gore in gores.items()}


def _rings() -> dict[str, LabelledMesh]:
    rings = {}
    for k, (major, minor, height) in enumerate(
        [(0.048, 0.02, 0.03), (0.041, 0.018, 0.064), (0.034, 0.016, 0.095), (0.027, 0.014, 0.122)]
    ):
        t = np.linspace(-math.pi, math.pi, 10)
        rings[f"ring_{k}"] = lathe(
            np.column_stack([major + minor * np.cos(t), height + minor * np.sin(t)]), 22
        )
    return rings


def _duck() -> dict[str, LabelledMesh]:
    body = lathe(mm("0 -52, 40 -50, 58 -20, 60 5, 45 35, 20 47, 0 50"), 22)

    def stretch(v: np.ndarray) -> np.ndarray:
        # a long body with a lifted tail (-y)
        y = v[:, 1] * 1.35
        lift = 0.03 * np.clip(-y / 0.08, 0, None) ** 2
        return np.column_stack(
            [v[:, 0] * (1 + 3 * np.minimum(y, 0)), y, v[:, 2] + 0.052 + lift * (v[:, 2] > -0.03)]
        )

    return {"duck_body": body.bent(stretch)}
