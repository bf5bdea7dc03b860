"""Meshes of books and magazines."""

import math

import numpy as np
from shapely.geometry import Polygon

from tools.authoring.mesh_tools import Floats, LabelledMesh, arc, from_above, join, ridge, sheet, slab


def meshes() -> dict[str, LabelledMesh]:
    """Return the surfaces by mesh name, with spines along y."""
    return {
        "hardback_cover": slab(0.15, 0.2, 0.0035).moved((0, 0, 0.0365)),
        "hardback_spine": _spine(0.04, 0.2, 0.012).moved((-0.066, 0, 0.02)),
        "paperback_cover": slab(0.115, 0.18, 0.002).moved((0, 0, 0.026)),
        "magazine": _curled(),
        "comic": slab(0.15, 0.21, 0.0085),
        "open_pages": _open_pages(),
        "open_cover": slab(0.15, 0.25, 0.005),
    }


def _spine(height: float, length: float, bulge: float) -> LabelledMesh:
    """A rounded spine: half an ellipse extruded along y, with the flat side towards +x."""
    curve = arc(height / 2, 0.5 * math.pi, 1.5 * math.pi, 9)
    outline = Polygon(np.column_stack([curve[:, 0] * bulge / (height / 2), curve[:, 1]]))
    return ridge(outline, length)


def _curled() -> LabelledMesh:
    """A thin magazine with a slightly lifted free edge."""
    x, y = np.meshgrid(np.linspace(-0.075, 0.075, 9), np.array([-0.105, 0.105]), indexing="ij")
    lift = 0.007 * np.clip((x + 0.02) / 0.095, 0, 1) ** 2
    top = np.stack([x, y, 0.011 + lift], axis=-1)
    bottom = np.stack([x, y, 0.6 * lift], axis=-1)
    return _closed(top, bottom)


def _open_pages() -> LabelledMesh:
    """Two arched halves on either side of a gutter along x."""
    y = np.concatenate([np.linspace(-0.12, -0.004, 9), [0.0], np.linspace(0.004, 0.12, 9)])
    arch = 0.012 + 0.02 * np.sqrt(np.clip(np.abs(y) / 0.03, 0, 1)) * (1.0 - 0.55 * np.abs(y) / 0.12)
    x = np.array([-0.072, 0.072])
    xs, ys = np.meshgrid(x, y, indexing="ij")
    top = np.stack([xs, ys, np.broadcast_to(arch, xs.shape)], axis=-1)
    bottom = np.stack([xs, ys, np.full(xs.shape, 0.004)], axis=-1)
    return _closed(top, bottom)


def _closed(top: Floats, bottom: Floats) -> LabelledMesh:
    """Close two grids (rows, columns, 3) into a solid with the texture on the upper one."""
    upper, lower = from_above(sheet(top)), sheet(bottom)
    lower = LabelledMesh(lower.vertices, lower.faces[:, ::-1])

    def rim(points: Floats) -> Floats:
        return np.vstack(
            [points[:-1, 0], points[-1, :-1], points[:0:-1, -1], points[0, :0:-1], points[:1, 0]]
        )

    skirt = sheet(np.stack([rim(bottom), rim(top)], axis=1))
    parts = [LabelledMesh(s.vertices, s.faces, np.full((len(s.vertices), 2), 0.01)) for s in (lower, skirt)]
    return join([upper, *parts])
