"""Meshes of the toys."""

import math

import numpy as np
from shapely.geometry import Polygon, box

from authoring.mesh_tools import Surface, extrude, lathe


def meshes() -> dict[str, Surface]:
    """Mesh name -> surface."""
    return {**_car(), **_ball(), **_rings(), **_duck()}


def _car() -> dict[str, Surface]:
    """Drawn from the side: nose at +, tail at -."""
    hull = Polygon(
        [
            (-0.11, 0.022),
            (0.11, 0.022),
            (0.112, 0.045),
            (0.1, 0.056),
            (0.055, 0.062),
            (-0.105, 0.064),
            (-0.112, 0.05),
        ]
    )
    cabin = Polygon(
        [(-0.085, 0.06), (0.06, 0.06), (0.025, 0.097), (0.015, 0.1), (-0.055, 0.1), (-0.065, 0.097)]
    )
    panes = Polygon([(-0.072, 0.064), (0.046, 0.064), (0.018, 0.091), (-0.058, 0.091)]).difference(
        box(-0.016, 0.06, -0.006, 0.1)
    )
    screens = Polygon([(0.0575, 0.066), (0.06, 0.067), (0.03, 0.0965), (0.0265, 0.0945)])
    return {
        "car_body": extrude(hull.buffer(0.003, quad_segs=3), 0.11).moved((0, 0, -0.055)).lengthwise(),
        "car_cabin": extrude(cabin, 0.088).moved((0, 0, -0.044)).lengthwise(),
        "car_panes": extrude(panes, 0.09).moved((0, 0, -0.045)).lengthwise(),
        "car_screen": extrude(screens, 0.074).moved((0, 0, -0.037)).lengthwise(),
    }


def _ball() -> dict[str, Surface]:
    """One gore of six; the model turns it. Poles are level, so that the stripes show from above."""
    t = np.linspace(-0.5 * math.pi, 0.5 * math.pi, 11)
    line = np.column_stack([0.08 * np.cos(t), 0.08 * np.sin(t)])
    sixth = math.pi / 3
    gores = {f"ball_gore_{k}": lathe(line, 4, k * sixth, (k + 1) * sixth) for k in range(6)}
    tilt = math.radians(40)
    c, s = math.cos(tilt), math.sin(tilt)
    turn = np.array([[1, 0, 0], [0, c, s], [0, -s, c]])
    return {name: gore.bent(lambda v: v @ turn + [0, 0, 0.08]) for name, gore in gores.items()}


def _rings() -> dict[str, Surface]:
    rings = {}
    for k, (major, minor, height) in enumerate(
        [(0.048, 0.02, 0.03), (0.041, 0.018, 0.064), (0.034, 0.016, 0.095), (0.027, 0.014, 0.122)]
    ):
        t = np.linspace(-math.pi, math.pi, 10)
        rings[f"ring_{k}"] = lathe(
            np.column_stack([major + minor * np.cos(t), height + minor * np.sin(t)]), 22
        )
    return rings


def _duck() -> dict[str, Surface]:
    body = lathe(
        [(0, -0.052), (0.04, -0.05), (0.058, -0.02), (0.06, 0.005), (0.045, 0.035), (0.02, 0.047), (0, 0.05)],
        22,
    )

    def stretch(v: np.ndarray) -> np.ndarray:
        """Long body whose tail (-y) lifts."""
        y = v[:, 1] * 1.35
        lift = 0.03 * np.clip(-y / 0.08, 0, None) ** 2
        return np.column_stack(
            [v[:, 0] * (1 + 3 * np.minimum(y, 0)), y, v[:, 2] + 0.052 + lift * (v[:, 2] > -0.03)]
        )

    return {"duck_body": body.bent(stretch)}
