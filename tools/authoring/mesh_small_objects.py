"""Build the meshes of dishes, toys, books and recyclable objects."""

import math

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Polygon, box

from tools.authoring.mesh_tools import (
    Floats,
    LabelledMesh,
    arc,
    extrude,
    from_above,
    join,
    lathe,
    mm,
    ridge,
    sheet,
    side,
    slab,
    tube,
)


def dishes() -> dict[str, LabelledMesh]:
    return {**_mug(), **_bowl(), **_plate(), **_pot(), **_teapot()}


def toys() -> dict[str, LabelledMesh]:
    return {**_car(), **_ball(), **_rings(), **_duck()}


def books() -> dict[str, LabelledMesh]:
    return {
        "hardback_cover": slab(0.15, 0.2, 0.0035).moved((0, 0, 0.0365)),
        "hardback_spine": _spine(0.04, 0.2, 0.012).moved((-0.066, 0, 0.02)),
        "paperback_cover": slab(0.115, 0.18, 0.002).moved((0, 0, 0.026)),
        "magazine": _curled(),
        "comic": slab(0.15, 0.21, 0.0085),
        "open_pages": _open_pages(),
        "open_cover": slab(0.15, 0.25, 0.005),
    }


def recycling() -> dict[str, LabelledMesh]:
    return {**_bottle(), **_can(), **_carton(), **_jar(), "newspaper": _newspaper()}


def _mug() -> dict[str, LabelledMesh]:
    wall = lathe(mm("0 0, 34 0, 42 6, 45 30, 45 100, 41 100"))
    lining = lathe(mm("41 100, 40 20, 34 10, 0 10"))
    bow = arc(0.03, -0.62 * math.pi, 0.62 * math.pi, 11)
    handle = tube(np.column_stack([0.052 + bow[:, 0], np.zeros(len(bow)), 0.052 + bow[:, 1]]), 0.0075)
    shift = (-0.018, 0, 0)  # moves the middle between cup and handle to the origin
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
    for sign in (-1, 1):
        bow = arc(0.026, -0.5 * math.pi, 0.5 * math.pi, 9)
        ears.append(tube(np.column_stack([sign * (0.07 + bow[:, 0]), bow[:, 1], np.full(9, 0.066)]), 0.0065))
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


def _car() -> dict[str, LabelledMesh]:
    """Build a toy car from its side view, with its front at + and its rear at -."""
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
    """Build a ball from six segments, tilted so that its stripes are visible from above."""
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
        # a long body with a raised tail at -y
        y = v[:, 1] * 1.35
        lift = 0.03 * np.clip(-y / 0.08, 0, None) ** 2
        return np.column_stack(
            [v[:, 0] * (1 + 3 * np.minimum(y, 0)), y, v[:, 2] + 0.052 + lift * (v[:, 2] > -0.03)]
        )

    return {"duck_body": body.bent(stretch)}


def _spine(height: float, length: float, bulge: float) -> LabelledMesh:
    """Build a rounded spine: half an ellipse extruded along y, with its flat side towards +x."""
    curve = arc(height / 2, 0.5 * math.pi, 1.5 * math.pi, 9)
    outline = Polygon(np.column_stack([curve[:, 0] * bulge / (height / 2), curve[:, 1]]))
    return ridge(outline, length)


def _curled() -> LabelledMesh:
    """Build a thin magazine with a slightly lifted edge."""
    x, y = np.meshgrid(np.linspace(-0.075, 0.075, 9), np.array([-0.105, 0.105]), indexing="ij")
    lift = 0.007 * np.clip((x + 0.02) / 0.095, 0, 1) ** 2
    top = np.stack([x, y, 0.011 + lift], axis=-1)
    bottom = np.stack([x, y, 0.6 * lift], axis=-1)
    return _closed(top, bottom)


def _open_pages() -> LabelledMesh:
    """Build an open book with two arched halves on either side of a fold along x."""
    y = np.concatenate([np.linspace(-0.12, -0.004, 9), [0.0], np.linspace(0.004, 0.12, 9)])
    arch = 0.012 + 0.02 * np.sqrt(np.clip(np.abs(y) / 0.03, 0, 1)) * (1.0 - 0.55 * np.abs(y) / 0.12)
    x = np.array([-0.072, 0.072])
    xs, ys = np.meshgrid(x, y, indexing="ij")
    top = np.stack([xs, ys, np.broadcast_to(arch, xs.shape)], axis=-1)
    bottom = np.stack([xs, ys, np.full(xs.shape, 0.004)], axis=-1)
    return _closed(top, bottom)


def _closed(top: Floats, bottom: Floats) -> LabelledMesh:
    """Join two grids (rows, columns, 3) into a closed solid, with the texture on the upper grid."""
    upper, lower = from_above(sheet(top)), sheet(bottom)
    lower = LabelledMesh(lower.vertices, lower.faces[:, ::-1])

    def rim(points: Floats) -> Floats:
        return np.vstack(
            [points[:-1, 0], points[-1, :-1], points[:0:-1, -1], points[0, :0:-1], points[:1, 0]]
        )

    skirt = sheet(np.stack([rim(bottom), rim(top)], axis=1))
    parts = [LabelledMesh(s.vertices, s.faces, np.full((len(s.vertices), 2), 0.01)) for s in (lower, skirt)]
    return join([upper, *parts])


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
    """Build a carton with a gable top and its ridge along y. Each side shows the whole label."""
    w, shoulder, top, fin = 0.046, 0.155, 0.2, 0.222
    sides = []
    for k in range(4):
        panel = sheet(np.array([[[w, -w, 0], [w, -w, shoulder]], [[w, w, 0], [w, w, shoulder]]], dtype=float))
        sides.append(panel.turned(k * math.pi / 2))
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
    """Build a newspaper that is folded once, with two layers and a round fold at -y."""
    sheets = [
        slab(0.17, 0.21, 0.011).moved((0.003, 0.004, 0)),
        slab(0.17, 0.21, 0.0105).moved((0, 0, 0.0115)),
    ]
    lower = LabelledMesh(sheets[0].vertices, sheets[0].faces, np.full((len(sheets[0].vertices), 2), 0.01))
    return join([lower, sheets[1]])
