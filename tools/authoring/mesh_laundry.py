"""Build the meshes of laundry objects."""

import math

import numpy as np
from shapely import affinity
from shapely.geometry import LineString, Point, Polygon, box

from tools.authoring.mesh_tools import (
    Floats,
    LabelledMesh,
    arc,
    cushion,
    extrude,
    from_above,
    join,
    lathe,
    mm,
    sheet,
)


def meshes() -> dict[str, LabelledMesh]:
    return {**_socks(), **_t_shirt(), "towel": _towel(), "jeans": _jeans(), **_cap()}


def _socks() -> dict[str, LabelledMesh]:
    """Build two overlapping socks that lie side by side, with the legs along y."""
    leg = Polygon(mm("-28 -20, -28 110, 28 110, 28 -50, 0 -85"))
    foot = Polygon(mm("-28 -20, 0 -85, 28 -50, -30 0, -100 -30, -100 -85"))
    sock = leg.union(foot.buffer(0.002)).union(Point(-0.085, -0.058).buffer(0.03, quad_segs=4))
    sock = sock.buffer(0.012, quad_segs=3).buffer(-0.012, quad_segs=3).simplify(0.002)
    bands = [
        box(-0.2, 0.085, 0.2, 0.2),
        box(-0.2, 0.05, 0.2, 0.065),
        box(-0.2, 0.015, 0.2, 0.03),
        box(-0.3, -0.2, -0.085, 0.2),
    ]
    knit = cushion(sock, 0.026, 0.006)
    trim = join(
        [
            extrude(sock.intersection(b).buffer(0.0006, join_style="mitre"), 0.022).moved((0, 0, 0.0045))
            for b in bands
        ]
    )

    def pair(part: LabelledMesh) -> LabelledMesh:
        return join([part.moved((0.0, -0.005, 0)), part.turned(0.12).moved((0.078, -0.022, 0.02))])

    return {"socks_knit": pair(knit), "socks_trim": pair(trim)}


def _t_shirt() -> dict[str, LabelledMesh]:
    """Build a small T-shirt that is spread out flat, with the collar towards +y."""
    half = mm("40 125, 85 112, 152 35, 112 0, 68 52, 74 -130")
    outline = Polygon([*half, *((-x, y) for x, y in reversed(half))])
    shirt = outline.difference(affinity.scale(Point(0, 0.122).buffer(0.036, quad_segs=4), 1.0, 0.7))
    neck = np.column_stack([arc(0.04, math.pi, 2 * math.pi, 9, 0.7) + np.array([0, 0.122]), np.full(9, 0.02)])
    collar = sheet(
        np.stack(
            [neck + np.array([0, 0.003, 0.004]), neck * [1.2, 1, 1] + np.array([0, -0.011, 0.004])], axis=1
        )
    )
    spikes = [((0.045, 0.02)[k % 2], math.pi * (0.5 + k / 5)) for k in range(10)]
    star = Polygon([(r * math.cos(a), r * math.sin(a) - 0.03) for r, a in spikes])
    hems = [
        LineString([(s * 0.147, 0.031), (s * 0.115, 0.005)]).buffer(0.009, cap_style="flat") for s in (-1, 1)
    ]
    trim = [extrude(hem, 0.024) for hem in hems]
    return {
        "t_shirt": _rumpled(cushion(shirt, 0.022, 0.006), 0.004),
        "t_shirt_print": join([extrude(star, 0.004).moved((0, 0, 0.0215)), collar, *trim]),
    }


def _rumpled(surface: LabelledMesh, depth: float) -> LabelledMesh:
    """Add soft waves to the upper side of a mesh."""

    def rule(v: Floats) -> Floats:
        wave = np.sin(31 * v[:, 0] + 17 * v[:, 1]) + np.sin(43 * v[:, 1] - 13 * v[:, 0] + 1)
        upper = np.clip(v[:, 2] / v[:, 2].max(), 0, 1)
        dip = 0.5 * depth * (wave - 1) * upper * (v[:, 2] > 0.004)
        return np.column_stack([v[:, :2], v[:, 2] + dip])

    return surface.bent(rule)


def _towel() -> LabelledMesh:
    """Build a dropped towel: a heap with radial folds, whose texture follows the cloth."""
    u, v = np.meshgrid(np.linspace(-1, 1, 23), np.linspace(-1, 1, 23), indexing="ij")
    # Map the square cloth to a round heap with an irregular outline.
    radius = np.maximum(np.abs(u), np.abs(v))
    angle = np.arctan2(v, u)
    reach = 0.125 * (1 + 0.1 * np.sin(3 * angle + 1) + 0.07 * np.sin(5 * angle))
    folds = np.sin(7 * angle + 5 * radius) * radius + 0.6 * np.sin(11 * angle - 4 * radius + 2) * radius**2
    height = (
        0.085 * (1 - radius**1.6)
        + 0.014 * folds * (1.25 - radius)
        + 0.012 * np.sin(9 * u + 2) * np.cos(7 * v)
    )
    height = np.where(radius > 0.999, 0.0, np.maximum(height, 0.006))
    return sheet(
        np.stack([reach * radius * np.cos(angle) - 0.008, reach * radius * np.sin(angle), height], axis=-1)
    )


def _jeans() -> LabelledMesh:
    """Build jeans that are spread out flat, with the waist towards +y."""
    half = mm("80 125, 95 50, 140 -105, 50 -125")
    outline = Polygon([*half, (0.0, 0.02), *((-x, y) for x, y in reversed(half))])
    return _rumpled(cushion(outline, 0.026, 0.006), 0.003)


def _cap() -> dict[str, LabelledMesh]:
    """Build a baseball cap with the brim towards +y."""
    t = np.linspace(0.0, 0.5 * math.pi, 8)
    dome = np.column_stack([0.088 * np.cos(t) ** 0.8, 0.012 + 0.083 * np.sin(t)])
    crown = lathe(np.vstack([[0, 0.0], [0.086, 0.0], dome, [0.006, 0.097], [0, 0.101]]), 24)
    reach = Point(0, 0).buffer(0.09, quad_segs=6)
    brim = affinity.scale(Point(0, 0.07).buffer(0.082, quad_segs=7), 1.0, 1.1).difference(
        reach.buffer(-0.008)
    )
    brim = max(brim.geoms, key=lambda p: p.area) if hasattr(brim, "geoms") else brim
    brim = brim.intersection(box(-0.1, 0.0, 0.1, 0.2))
    visor = cushion(brim, 0.012, 0.004)
    droop = visor.bent(lambda v: v + np.column_stack([0 * v[:, :2], 0.012 - 2.2 * v[:, 0] ** 2]))
    shift = (0, -0.035, 0)
    band = lathe([(0.0885, 0.004), (0.0895, 0.022)], 24)
    return {
        "cap_crown": crown.moved(shift),
        "cap_brim": from_above(droop).moved(shift),
        "cap_band": band.moved(shift),
    }
