"""Meshes of recycling."""

import math

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Polygon

from tools.authoring.mesh_tools import LabelledMesh, extrude, join, lathe, mm, ridge, sheet, slab


def meshes() -> dict[str, LabelledMesh]:
    return {**_bottle(), **_can(), **_carton(), **_jar(), "newspaper": _newspaper()}


def _bottle() -> dict[str, LabelledMesh]:
    base = mm("0 4, 30 0, 39 8, 40 60, 37 66, 37 145, 40 151")
    neck = mm("39 170, 30 200, 16 225, 14.5 245, 0 245")
    body = lathe([*base, *neck])
    label = lathe([(0.0385, 0.07), (0.0385, 0.142)], 24)
    cap = lathe(mm("0 240, 18 240, 18 258, 16 260, 0 260"), 14)
    return {"bottle_body": body, "bottle_label": label, "bottle_cap": cap}


def _can() -> dict[str, LabelledMesh]:
    label = lathe([(0.035, 0.012), (0.035, 0.108)], 24).turned(0.4)
    bottom = lathe(mm("0 4, 26 0, 28 0, 35 12"))
    top = lathe(mm("35 108, 29.5 120, 27.5 120, 27 116, 0 116"))
    tab = extrude(affinity.scale(LineString([(0, 0), (0, 0.012)]).buffer(0.007, quad_segs=3), 1, 1), 0.0025)
    return {"can_label": label, "can_metal": join([bottom, top, tab.moved((0, -0.004, 0.116))])}


def _carton() -> dict[str, LabelledMesh]:
    """A gable-topped carton, ridge along y. Each side has the whole label."""
    w, shoulder, top, fin = 0.046, 0.155, 0.2, 0.222
    sides = []
    for k in range(4):
        side = sheet(np.array([[[w, -w, 0], [w, -w, shoulder]], [[w, w, 0], [w, w, shoulder]]], dtype=float))
        sides.append(side.turned(k * math.pi / 2))
    gable = Polygon([(-w, shoulder), (w, shoulder), (0.002, top), (-0.002, top)])
    crest = Polygon([(-0.003, top - 0.005), (0.003, top - 0.005), (0.003, fin), (-0.003, fin)])
    roof = [ridge(drawing, 2 * w) for drawing in (gable, crest)]
    spout = lathe(mm("0 0, 14 0, 14 18, 0 18"), 14)
    tilt = math.radians(45)
    c, s = math.cos(tilt), math.sin(tilt)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return {
        "carton_sides": join(sides),
        "carton_roof": join(roof),
        "carton_spout": spout.bent(lambda v: v @ turn + [0.022, 0, 0.176]),
    }


def _jar() -> dict[str, LabelledMesh]:
    glass = lathe(mm("0 3, 40 0, 46 6, 46 88, 36 106, 36 112, 0 112"))
    lid = lathe(mm("0 108, 40 108, 41 128, 38 131, 0 131"))
    label = lathe([(0.0465, 0.022), (0.0465, 0.076)], 24).turned(0.4)
    return {"jar_glass": glass, "jar_lid": lid, "jar_label": label}


def _newspaper() -> LabelledMesh:
    """A newspaper, folded once: two layers and a round fold at -y."""
    sheets = [
        slab(0.17, 0.21, 0.011).moved((0.003, 0.004, 0)),
        slab(0.17, 0.21, 0.0105).moved((0, 0, 0.0115)),
    ]
    lower = LabelledMesh(sheets[0].vertices, sheets[0].faces, np.full((len(sheets[0].vertices), 2), 0.01))
    return join([lower, sheets[1]])
