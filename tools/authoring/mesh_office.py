"""Build the meshes of office supplies."""

import math

import numpy as np
from shapely.geometry import Point, Polygon, box

from tools.authoring.mesh_tools import (
    LabelledMesh,
    arc,
    extrude,
    join,
    lathe,
    mm,
    rounded_box,
    side,
    slab,
    tube,
)


def meshes() -> dict[str, LabelledMesh]:
    return {**_stapler(), **_tape(), **_pencil_cup(), **_calculator(), **_notebook(), **_hole_punch()}


def _stapler() -> dict[str, LabelledMesh]:
    base = Polygon(mm("-90 0, 90 0, 90 10, 20 16, -60 16, -90 14"))
    arm = Polygon(mm("-90 26, -84 52, -50 62, 30 64, 85 50, 92 36, 80 30"))
    hinge = Polygon(mm("-80 10, -50 10, -55 45, -78 45"))
    rail = Polygon(mm("-75 22, 84 22, 86 38, -75 38"))
    return {
        "stapler_base": join([side(base, 0.046, 0.001), side(hinge, 0.05, 0.001)]),
        "stapler_arm": side(arm, 0.04, 0.006),
        "stapler_rail": side(rail, 0.022, 0.001),
    }


def _tape() -> dict[str, LabelledMesh]:
    """Build a tape dispenser with the roll towards -y and the cutter towards +y."""
    profile = mm("-85 0, 85 0, 88 40, 70 45, 50 22, -0 18, -18 30, -50 30, -85 30")
    cheek = Polygon(mm("-85 0, 0 0, 0 30, -22 55, -55 55, -85 30"))
    cheeks = [side(cheek, 0.009, 0.004).moved((x, 0, 0)) for x in (-0.022, 0.022)]
    hub = Point(-0.035, 0.05)
    roll = hub.buffer(0.038, quad_segs=6).difference(hub.buffer(0.022, quad_segs=5))
    core = hub.buffer(0.022, quad_segs=5).difference(hub.buffer(0.015, quad_segs=4))
    strip = Polygon(mm("-30 86, -28 88, 86 42.5, 85 40"))
    teeth = Polygon(mm("82 38, 90 42, 91 47, 83 44"))
    return {
        "tape_body": join([side(Polygon(profile), 0.052, 0.004), *cheeks]),
        "tape_roll": join([side(roll, 0.026), side(strip, 0.024)]),
        "tape_core": join([side(core, 0.028), side(teeth, 0.03)]),
    }


def _pencil_cup() -> dict[str, LabelledMesh]:
    cup = lathe(mm("0 0, 38 0, 40 2, 42 98, 42 100, 38 100, 37 70, 0 70"))
    return {
        "pencil_cup": cup,
        "pencil": _pencil(),
        "pencil_tip": lathe(mm("0 139, 6.5 139, 2.5 156, 0 157"), 6),
    }


def _pencil() -> LabelledMesh:
    return lathe(mm("0 0, 6.2 0, 6.2 140, 0 140"), 6)


def _calculator() -> dict[str, LabelledMesh]:
    case = rounded_box(0.09, 0.15, 0.022, 0.006)
    return {"calculator_case": case, "calculator_face": slab(0.08, 0.138, 0.0015).moved((0, 0, 0.0215))}


def _notebook() -> dict[str, LabelledMesh]:
    """Build a notebook that is bound along its long side at -x."""
    loops = []
    for y in np.linspace(-0.085, 0.085, 11):
        bow = arc(0.0115, 0, 2 * math.pi, 9)
        loops.append(tube(np.column_stack([bow[:, 0] - 0.07, np.full(9, y), bow[:, 1] + 0.0138]), 0.0022, 4))
    return {
        "notebook_cover": slab(0.138, 0.2, 0.002).moved((0.004, 0, 0.018)),
        "notebook_spiral": join(loops),
    }


def _hole_punch() -> dict[str, LabelledMesh]:
    """Build a hole punch from its side view, with the handle towards +y."""
    lever = Polygon(mm("-50 40, -45 62, -20 72, 30 76, 68 72, 72 62, 10 50"))
    bracket = Polygon(mm("-50 12, -5 12, -10 55, -45 55"))
    base = rounded_box(0.13, 0.12, 0.016, 0.006)
    cheeks = [side(bracket, 0.012, 0.003).moved((x, 0, 0)) for x in (-0.045, 0.045)]
    posts = [lathe(mm("0 12, 9 12, 9 50, 0 50"), 10).moved((x, -0.03, 0)) for x in (-0.025, 0.025)]
    guide = extrude(box(-0.055, 0.04, 0.055, 0.046), 0.006).moved((0, 0, 0.014))
    return {
        "punch_base": join([base, guide]),
        "punch_lever": side(lever, 0.11, 0.005),
        "punch_metal": join([*cheeks, *posts]),
    }
