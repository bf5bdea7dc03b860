"""Meshes of the recycling."""

import math

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Polygon

from authoring.mesh_tools import Surface, extrude, join, lathe, sheet, slab


def meshes() -> dict[str, Surface]:
    """Mesh name -> surface."""
    return {**_bottle(), **_can(), **_carton(), **_jar(), "newspaper": _newspaper()}


def _bottle() -> dict[str, Surface]:
    base = [
        (0, 0.004),
        (0.03, 0),
        (0.039, 0.008),
        (0.04, 0.06),
        (0.037, 0.066),
        (0.037, 0.145),
        (0.04, 0.151),
    ]
    neck = [(0.039, 0.17), (0.03, 0.2), (0.016, 0.225), (0.0145, 0.245), (0, 0.245)]
    body = lathe([*base, *neck])
    label = lathe([(0.0385, 0.07), (0.0385, 0.142)], 24)
    cap = lathe([(0, 0.24), (0.018, 0.24), (0.018, 0.258), (0.016, 0.26), (0, 0.26)], 14)
    return {"bottle_body": body, "bottle_label": label, "bottle_cap": cap}


def _can() -> dict[str, Surface]:
    label = lathe([(0.035, 0.012), (0.035, 0.108)], 24).turned(0.4)
    bottom = lathe([(0, 0.004), (0.026, 0.0), (0.028, 0.0), (0.035, 0.012)])
    top = lathe([(0.035, 0.108), (0.0295, 0.12), (0.0275, 0.12), (0.027, 0.116), (0, 0.116)])
    tab = extrude(affinity.scale(LineString([(0, 0), (0, 0.012)]).buffer(0.007, quad_segs=3), 1, 1), 0.0025)
    return {"can_label": label, "can_metal": join([bottom, top, tab.moved((0, -0.004, 0.116))])}


def _carton() -> dict[str, Surface]:
    """A gable-topped carton, ridge along y; each side carries the whole label."""
    w, shoulder, ridge, fin = 0.046, 0.155, 0.2, 0.222
    sides = []
    for k in range(4):
        side = sheet(np.array([[[w, -w, 0], [w, -w, shoulder]], [[w, w, 0], [w, w, shoulder]]], dtype=float))
        sides.append(side.turned(k * math.pi / 2))
    gable = Polygon([(-w, shoulder), (w, shoulder), (0.002, ridge), (-0.002, ridge)])
    crest = Polygon([(-0.003, ridge - 0.005), (0.003, ridge - 0.005), (0.003, fin), (-0.003, fin)])
    roof = []
    for drawing in (gable, crest):
        prism = extrude(drawing, 2 * w).moved((0, 0, -w))
        roof.append(Surface(prism.vertices[:, [0, 2, 1]] * [1, -1, 1], prism.faces))
    spout = lathe([(0, 0), (0.014, 0), (0.014, 0.018), (0, 0.018)], 14)
    tilt = math.radians(45)
    c, s = math.cos(tilt), math.sin(tilt)
    turn = np.array([[c, 0, -s], [0, 1, 0], [s, 0, c]])
    return {
        "carton_sides": join(sides),
        "carton_roof": join(roof),
        "carton_spout": spout.bent(lambda v: v @ turn + [0.022, 0, 0.176]),
    }


def _jar() -> dict[str, Surface]:
    glass = lathe(
        [(0, 0.003), (0.04, 0), (0.046, 0.006), (0.046, 0.088), (0.036, 0.106), (0.036, 0.112), (0, 0.112)]
    )
    lid = lathe([(0, 0.108), (0.04, 0.108), (0.041, 0.128), (0.038, 0.131), (0, 0.131)])
    label = lathe([(0.0465, 0.022), (0.0465, 0.076)], 24).turned(0.4)
    return {"jar_glass": glass, "jar_lid": lid, "jar_label": label}


def _newspaper() -> Surface:
    """Folded once: two layers and a round fold at -y."""
    sheets = [
        slab(0.17, 0.21, 0.011).moved((0.003, 0.004, 0)),
        slab(0.17, 0.21, 0.0105).moved((0, 0, 0.0115)),
    ]
    lower = Surface(sheets[0].vertices, sheets[0].faces, np.full((len(sheets[0].vertices), 2), 0.01))
    return join([lower, sheets[1]])
