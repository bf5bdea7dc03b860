"""Build the meshes of receptacles: wires, handles, the recycling symbol, and books on a shelf."""

import math

import numpy as np
import trimesh
from shapely import affinity
from shapely.geometry import LineString, Polygon
from shapely.ops import unary_union

from tools.authoring.mesh_tools import LabelledMesh, arc, extrude, join, slab, tube

WIRE = 0.0035  # radius of the dish rack's wires in metres


def meshes() -> dict[str, LabelledMesh]:
    books = {f"shelf_books_{k}": books for k, books in enumerate(_shelf_books())}
    return {
        "dish_rack": _dish_rack(0.472, 0.464, 0.06, 0.196),
        "recycling_symbol": _recycling_symbol(0.24),
        "hamper_handle": _handle(),
        "toys_sign": slab(0.3, 0.15, 0.004),
        "office_sign": slab(0.2, 0.07, 0.003),
        **books,
    }


def _dish_rack(width: float, depth: float, low: float, high: float) -> LabelledMesh:
    """Build a rectangle of upright wires between two heights, with two rails."""
    x, y = width / 2, depth / 2
    corners = np.array([[-x, -y], [x, -y], [x, y], [-x, y]])
    bars = []
    for start, stop in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        count = round(float(np.linalg.norm(stop - start)) / 0.038)
        for t in np.arange(count) / count:
            foot = start + t * (stop - start)
            bars.append(tube([[*foot, low], [*foot, high]], WIRE, 4))
        for level in (high, (low + high) / 2):
            bars.append(tube([[*start, level], [*stop, level]], 1.5 * WIRE if level == high else WIRE, 5))
    return join(bars)


def _recycling_symbol(size: float) -> LabelledMesh:
    """Build a recycling symbol of three arrows with total height `size`, extruded by 4 mm."""
    path = np.array([[0.16, -0.3], [-0.32, -0.3], [-0.45, -0.1], [-0.3, 0.13]])
    band = LineString(path).buffer(0.085, cap_style="flat", join_style="bevel")
    ahead = (path[-1] - path[-2]) / math.hypot(*(path[-1] - path[-2]))
    across = np.array([-ahead[1], ahead[0]])
    head = Polygon([path[-1] + 0.17 * across, path[-1] - 0.17 * across, path[-1] + 0.2 * ahead])
    arrow = unary_union([band, head])
    arrows = [affinity.rotate(arrow, 120 * k, origin=(0, 0)) for k in range(3)]
    gaps = [affinity.rotate(head.buffer(0.035), 120 * k, origin=(0, 0)) for k in range(3)]
    # An arrow ends in front of the head of the next arrow, to leave a gap.
    drawing = [a.difference(gaps[(k + 1) % 3]).difference(gaps[(k + 2) % 3]) for k, a in enumerate(arrows)]
    return join([extrude(affinity.scale(a, size, size, origin=(0, 0)), 0.004) for a in drawing])


def _handle() -> LabelledMesh:
    """Build a curved handle in the x-z plane, with its ends at z = 0."""
    bow = arc(0.06, math.pi, 2 * math.pi, 9, 0.8)
    return tube(np.column_stack([bow[:, 0], np.zeros(9), bow[:, 1]]), 0.009, 6)


def _shelf_books() -> list[LabelledMesh]:
    """Build upright books in four colours on two shelves of the bookcase, with their spines towards -y."""
    widths = [0.032, 0.024, 0.04, 0.028, 0.036, 0.022, 0.045, 0.03]
    heights = [0.2, 0.215, 0.18, 0.205, 0.19, 0.222]
    colours: list[list[LabelledMesh]] = [[], [], [], []]
    for shelf, (base, left, right) in enumerate([(0.06, -0.41, 0.3), (0.335, -0.25, 0.41)]):
        x, k = left, 3 * shelf
        while x + widths[k % 8] < right:
            width, height, depth = widths[k % 8], heights[k % 6], 0.2 + 0.01 * (k % 4)
            box = trimesh.creation.box((width - 0.002, depth, height))
            middle = np.array([x + width / 2, -0.14 + depth / 2, base + height / 2])
            colours[(k * 3 + k // 5) % 4].append(
                LabelledMesh(np.asarray(box.vertices) + middle, np.asarray(box.faces))
            )
            x, k = x + width, k + 1
    return [join(books) for books in colours]
