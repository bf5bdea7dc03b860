"""Meshes of dishes."""

import math

import numpy as np

from tools.authoring.mesh_tools import LabelledMesh, arc, join, lathe, mm, tube


def meshes() -> dict[str, LabelledMesh]:
    return {**_mug(), **_bowl(), **_plate(), **_pot(), **_teapot()}


def _mug() -> dict[str, LabelledMesh]:
    wall = lathe(mm("0 0, 34 0, 42 6, 45 30, 45 100, 41 100"))
    lining = lathe(mm("41 100, 40 20, 34 10, 0 10"))
    bow = arc(0.03, -0.62 * math.pi, 0.62 * math.pi, 11)
    handle = tube(np.column_stack([0.052 + bow[:, 0], np.zeros(len(bow)), 0.052 + bow[:, 1]]), 0.0075)
    shift = (-0.018, 0, 0)  # moves the centre of the footprint, between cup and handle, to the origin
    return {"mug_wall": join([wall, handle]).moved(shift), "mug_lining": lining.moved(shift)}


def _bowl() -> dict[str, LabelledMesh]:
    outside = mm("0 0, 40 0, 42 8, 60 25, 74 48, 80 72, 76 72")
    inside = mm("76 72, 70 50, 56 30, 36 14, 0 12")
    return {"bowl_outside": lathe(outside, 28), "bowl_inside": lathe(inside, 28)}


def _plate() -> dict[str, LabelledMesh]:
    under = mm("0 0, 45 0, 50 4, 82 18, 83.5 21, 82 22.5")
    rim = [(0.082, 0.0225), (0.056, 0.012)]
    well = mm("56 12, 50 7, 0 7")
    return {"plate_body": join([lathe(under, 32), lathe(well, 32)]), "plate_rim": lathe(rim, 32)}


def _pot() -> dict[str, LabelledMesh]:
    body = lathe(mm("0 0, 66 0, 74 8, 75 85, 0 85"), 28)
    ears = []
    for side in (-1, 1):
        bow = arc(0.026, -0.5 * math.pi, 0.5 * math.pi, 9)
        ears.append(tube(np.column_stack([side * (0.07 + bow[:, 0]), bow[:, 1], np.full(9, 0.066)]), 0.0065))
    lid = lathe(mm("0 85, 78 85, 78 90, 55 102, 20 108, 0 108"), 28)
    knob = lathe(mm("0 106, 8 106, 9 114, 17 120, 15 128, 0 130"), 14)
    return {"pot_body": body, "pot_lid": lid, "pot_fittings": join([*ears, knob])}


def _teapot() -> dict[str, LabelledMesh]:
    belly = lathe(mm("0 0, 40 0, 44 6, 62 35, 64 55, 54 82, 34 98, 0 98"), 28)
    spout = tube(
        [(0, 0.05, 0.035), (0, 0.078, 0.052), (0, 0.092, 0.078), (0, 0.108, 0.1)], [0.02, 0.015, 0.011, 0.009]
    )
    bow = arc(0.032, 0.5 * math.pi, 1.5 * math.pi, 11)
    handle = tube(np.column_stack([np.zeros(11), bow[:, 0] - 0.052, 0.055 + bow[:, 1]]), 0.0075)
    lid = lathe(mm("0 96, 37 96, 34 105, 15 113, 0 113"), 20)
    knob = lathe(mm("0 112, 6 112, 12 121, 9 129, 0 131"), 12)
    shift = (0, -0.01, 0)
    return {
        "teapot_body": join([belly, spout, handle]).moved(shift).turned(-math.pi / 2),
        "teapot_lid": join([lid, knob]).moved(shift).turned(-math.pi / 2),
    }
