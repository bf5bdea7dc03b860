"""Meshes of the office supplies."""

import math

import numpy as np
from shapely.geometry import Point, Polygon, box

from authoring.mesh_tools import Surface, arc, extrude, join, lathe, rounded_box, slab, tube


def meshes() -> dict[str, Surface]:
    """Mesh name -> surface."""
    return {**_stapler(), **_tape(), **_pencil_cup(), **_calculator(), **_notebook(), **_hole_punch()}


def _side(drawing: Polygon, width: float, rounding: float = 0.004) -> Surface:
    """A body drawn from the side, `width` wide across x, its corners rounded."""
    soft = drawing.buffer(-rounding, quad_segs=3).buffer(rounding, quad_segs=3)
    return extrude(soft, width).moved((0, 0, -width / 2)).lengthwise()


def _stapler() -> dict[str, Surface]:
    base = Polygon([(-0.09, 0), (0.09, 0), (0.09, 0.01), (0.02, 0.016), (-0.06, 0.016), (-0.09, 0.014)])
    arm = Polygon(
        [
            (-0.09, 0.026),
            (-0.084, 0.052),
            (-0.05, 0.062),
            (0.03, 0.064),
            (0.085, 0.05),
            (0.092, 0.036),
            (0.08, 0.03),
        ]
    )
    hinge = Polygon([(-0.08, 0.01), (-0.05, 0.01), (-0.055, 0.045), (-0.078, 0.045)])
    rail = Polygon([(-0.075, 0.022), (0.084, 0.022), (0.086, 0.038), (-0.075, 0.038)])
    return {
        "stapler_base": join([_side(base, 0.046, 0.001), _side(hinge, 0.05, 0.001)]),
        "stapler_arm": _side(arm, 0.04, 0.006),
        "stapler_rail": _side(rail, 0.022, 0.001),
    }


def _tape() -> dict[str, Surface]:
    """A desk dispenser: roll at -y, cutter at +y."""
    profile = [
        (-0.085, 0),
        (0.085, 0),
        (0.088, 0.04),
        (0.07, 0.045),
        (0.05, 0.022),
        (-0.0, 0.018),
        (-0.018, 0.03),
        (-0.05, 0.03),
        (-0.085, 0.03),
    ]
    cheek = Polygon([(-0.085, 0), (0.0, 0), (0.0, 0.03), (-0.022, 0.055), (-0.055, 0.055), (-0.085, 0.03)])
    cheeks = [_side(cheek, 0.009, 0.004).moved((x, 0, 0)) for x in (-0.022, 0.022)]
    hub = Point(-0.035, 0.05)
    roll = hub.buffer(0.038, quad_segs=6).difference(hub.buffer(0.022, quad_segs=5))
    core = hub.buffer(0.022, quad_segs=5).difference(hub.buffer(0.015, quad_segs=4))
    strip = Polygon([(-0.03, 0.086), (-0.028, 0.088), (0.086, 0.0425), (0.085, 0.04)])
    teeth = Polygon([(0.082, 0.038), (0.09, 0.042), (0.091, 0.047), (0.083, 0.044)])
    return {
        "tape_body": join([_side(Polygon(profile), 0.052), *cheeks]),
        "tape_roll": join([_side(roll, 0.026, 0.0), _side(strip, 0.024, 0.0)]),
        "tape_core": join([_side(core, 0.028, 0.0), _side(teeth, 0.03, 0.0)]),
    }


def _pencil_cup() -> dict[str, Surface]:
    cup = lathe(
        [
            (0, 0),
            (0.038, 0),
            (0.04, 0.002),
            (0.042, 0.098),
            (0.042, 0.1),
            (0.038, 0.1),
            (0.037, 0.07),
            (0, 0.07),
        ]
    )
    return {
        "pencil_cup": cup,
        "pencil": _pencil(),
        "pencil_tip": lathe([(0, 0.139), (0.0065, 0.139), (0.0025, 0.156), (0, 0.157)], 6),
    }


def _pencil() -> Surface:
    return lathe([(0, 0), (0.0062, 0), (0.0062, 0.14), (0, 0.14)], 6)


def _calculator() -> dict[str, Surface]:
    case = rounded_box(0.09, 0.15, 0.022, 0.006)
    return {"calculator_case": case, "calculator_face": slab(0.08, 0.138, 0.0015).moved((0, 0, 0.0215))}


def _notebook() -> dict[str, Surface]:
    """Bound along its long side at -x."""
    loops = []
    for y in np.linspace(-0.085, 0.085, 11):
        bow = arc(0.0115, 0, 2 * math.pi, 9)
        loops.append(tube(np.column_stack([bow[:, 0] - 0.07, np.full(9, y), bow[:, 1] + 0.0138]), 0.0022, 4))
    return {
        "notebook_cover": slab(0.138, 0.2, 0.002).moved((0.004, 0, 0.018)),
        "notebook_spiral": join(loops),
    }


def _hole_punch() -> dict[str, Surface]:
    """Lever drawn from the side, handle at +y."""
    lever = Polygon(
        [
            (-0.05, 0.04),
            (-0.045, 0.062),
            (-0.02, 0.072),
            (0.03, 0.076),
            (0.068, 0.072),
            (0.072, 0.062),
            (0.01, 0.05),
        ]
    )
    bracket = Polygon([(-0.05, 0.012), (-0.005, 0.012), (-0.01, 0.055), (-0.045, 0.055)])
    base = rounded_box(0.13, 0.12, 0.016, 0.006)
    cheeks = [_side(bracket, 0.012, 0.003).moved((x, 0, 0)) for x in (-0.045, 0.045)]
    posts = [
        lathe([(0, 0.012), (0.009, 0.012), (0.009, 0.05), (0, 0.05)], 10).moved((x, -0.03, 0))
        for x in (-0.025, 0.025)
    ]
    guide = extrude(box(-0.055, 0.04, 0.055, 0.046), 0.006).moved((0, 0, 0.014))
    return {
        "punch_base": join([base, guide]),
        "punch_lever": _side(lever, 0.11, 0.005),
        "punch_metal": join([*cheeks, *posts]),
    }
