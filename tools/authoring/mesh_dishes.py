"""Meshes of the dishes."""

import math

import numpy as np

from authoring.mesh_tools import Surface, arc, join, lathe, tube


def meshes() -> dict[str, Surface]:
    """Mesh name -> surface."""
    return {**_mug(), **_bowl(), **_plate(), **_pot(), **_teapot()}


def _mug() -> dict[str, Surface]:
    wall = lathe([(0, 0), (0.034, 0), (0.042, 0.006), (0.045, 0.03), (0.045, 0.1), (0.041, 0.1)])
    lining = lathe([(0.041, 0.1), (0.040, 0.02), (0.034, 0.01), (0, 0.01)])
    bow = arc(0.03, -0.62 * math.pi, 0.62 * math.pi, 11)
    handle = tube(np.column_stack([0.052 + bow[:, 0], np.zeros(len(bow)), 0.052 + bow[:, 1]]), 0.0075)
    shift = (-0.018, 0, 0)  # the footprint's centre lies between cup and handle
    return {"mug_wall": join([wall, handle]).moved(shift), "mug_lining": lining.moved(shift)}


def _bowl() -> dict[str, Surface]:
    outside = [
        (0, 0),
        (0.04, 0),
        (0.042, 0.008),
        (0.06, 0.025),
        (0.074, 0.048),
        (0.08, 0.072),
        (0.076, 0.072),
    ]
    inside = [(0.076, 0.072), (0.070, 0.05), (0.056, 0.03), (0.036, 0.014), (0, 0.012)]
    return {"bowl_outside": lathe(outside, 28), "bowl_inside": lathe(inside, 28)}


def _plate() -> dict[str, Surface]:
    under = [(0, 0), (0.045, 0), (0.05, 0.004), (0.082, 0.018), (0.0835, 0.021), (0.082, 0.0225)]
    rim = [(0.082, 0.0225), (0.056, 0.012)]
    well = [(0.056, 0.012), (0.05, 0.007), (0, 0.007)]
    return {"plate_body": join([lathe(under, 32), lathe(well, 32)]), "plate_rim": lathe(rim, 32)}


def _pot() -> dict[str, Surface]:
    body = lathe([(0, 0), (0.066, 0), (0.074, 0.008), (0.075, 0.085), (0, 0.085)], 28)
    ears = []
    for side in (-1, 1):
        bow = arc(0.026, -0.5 * math.pi, 0.5 * math.pi, 9)
        ears.append(tube(np.column_stack([side * (0.07 + bow[:, 0]), bow[:, 1], np.full(9, 0.066)]), 0.0065))
    lid = lathe([(0.0, 0.085), (0.078, 0.085), (0.078, 0.09), (0.055, 0.102), (0.02, 0.108), (0, 0.108)], 28)
    knob = lathe([(0, 0.106), (0.008, 0.106), (0.009, 0.114), (0.017, 0.12), (0.015, 0.128), (0, 0.13)], 14)
    return {"pot_body": body, "pot_lid": lid, "pot_fittings": join([*ears, knob])}


def _teapot() -> dict[str, Surface]:
    belly = lathe(
        [
            (0, 0),
            (0.04, 0),
            (0.044, 0.006),
            (0.062, 0.035),
            (0.064, 0.055),
            (0.054, 0.082),
            (0.034, 0.098),
            (0, 0.098),
        ],
        28,
    )
    spout = tube(
        [(0, 0.05, 0.035), (0, 0.078, 0.052), (0, 0.092, 0.078), (0, 0.108, 0.1)], [0.02, 0.015, 0.011, 0.009]
    )
    bow = arc(0.032, 0.5 * math.pi, 1.5 * math.pi, 11)
    handle = tube(np.column_stack([np.zeros(11), bow[:, 0] - 0.052, 0.055 + bow[:, 1]]), 0.0075)
    lid = lathe([(0, 0.096), (0.037, 0.096), (0.034, 0.105), (0.015, 0.113), (0, 0.113)], 20)
    knob = lathe([(0, 0.112), (0.006, 0.112), (0.012, 0.121), (0.009, 0.129), (0, 0.131)], 12)
    shift = (0, -0.01, 0)
    return {
        "teapot_body": join([belly, spout, handle]).moved(shift).turned(-math.pi / 2),
        "teapot_lid": join([lid, knob]).moved(shift).turned(-math.pi / 2),
    }
