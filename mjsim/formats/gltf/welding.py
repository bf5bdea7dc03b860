"""Close T-junctions between boxes, such as the stretches of a wall above and next to a door.

Where a corner of one box is on an edge of another box, rounding in a rasteriser leaves gaps of single pixels.
The edge therefore gets a vertex there as well.
"""

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.formats.gltf.shapes import Floats
from mjsim.formats.gltf.surfaces import GeomSurface

UNIT = 1e-4  # distance below which two coordinates count as equal, in metres
_SIDES, _CORNERS = 6, 4  # number of sides of a box, and of corners of a side
_ONES = np.eye(_CORNERS)
_SQUARE = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])  # corners of a side in its own frame
_FLAT = 1e-9  # area of a polygon in this frame that counts as zero
_Line = tuple[int, int, int]  # axis of a line, and its other two coordinates in units


def welded(model: Any, surfaces: Sequence[GeomSurface]) -> list[GeomSurface]:
    """Split the edges of opaque axis-aligned boxes at the corners of other boxes."""
    corners: dict[_Line, set[int]] = {}
    boxes = [surface for surface in surfaces if _is_opaque_box(model, surface)]
    for surface in boxes:
        for point in np.unique(_units(surface.positions), axis=0).tolist():
            for axis in range(3):
                corners.setdefault(_line(point, axis), set()).add(point[axis])
    lines = {line: np.array(sorted(values)) for line, values in corners.items() if len(values) > 2}
    welded_boxes = {surface.geom: _welded_box(surface, lines) for surface in boxes}
    return [welded_boxes.get(surface.geom, surface) for surface in surfaces]


def _is_opaque_box(model: Any, surface: GeomSurface) -> bool:
    return model.geom_type[surface.geom] == mujoco.mjtGeom.mjGEOM_BOX and not surface.is_translucent


def _units(positions: Floats) -> NDArray[np.int64]:
    return np.rint(positions / UNIT).astype(np.int64)


def _line(point: Sequence[int], axis: int) -> _Line:
    return axis, point[(axis + 1) % 3], point[(axis + 2) % 3]


def _welded_box(surface: GeomSurface, lines: dict[_Line, NDArray[np.int64]]) -> GeomSurface:
    """Add vertices to the edges of a box, and triangulate its sides again."""
    units = _units(surface.positions)
    weights, triangles, count = [], [], 0
    for side in range(_SIDES):
        rows = _CORNERS * side + np.arange(_CORNERS)
        around = np.array(list(_outline(units[rows], lines)))
        faces = surface.triangles[2 * side : 2 * side + 2] - rows[0]
        if len(around) > _CORNERS:
            is_turned = faces[0].tolist() != [0, 1, 2]
            faces = np.array(_triangulated(around @ _SQUARE))[:, :: -1 if is_turned else 1]
        weights.append((rows, around))
        triangles.append(faces + count)
        count += len(around)
    return replace(
        surface,
        positions=_mixed(surface.positions, weights),
        normals=_mixed(surface.normals, weights),
        triangles=np.concatenate(triangles),
        uv=None if surface.uv is None else _mixed(surface.uv, weights),
    )


def _outline(side: NDArray[np.int64], lines: dict[_Line, NDArray[np.int64]]) -> Iterable[Floats]:
    """Yield each vertex on the outline of a side as weights of the side's four corners, shape (4,)."""
    for start in range(_CORNERS):
        end = (start + 1) % _CORNERS
        yield _ONES[start]
        (along,) = np.nonzero(side[end] - side[start])
        if len(along) != 1:
            continue
        axis, first, last = int(along[0]), side[start, along[0]], side[end, along[0]]
        found = lines.get(_line(side[start].tolist(), axis), np.zeros(0, np.int64))
        between = found[(found > min(first, last)) & (found < max(first, last))]
        for value in between if first < last else between[::-1]:
            share = (value - first) / (last - first)
            yield (1.0 - share) * _ONES[start] + share * _ONES[end]


def _triangulated(points: Floats) -> list[list[int]]:
    """Divide a convex polygon (n, 2) into triangles, none of which is flat. Its vertices may be in line."""

    places = points.tolist()

    def area(ring: Sequence[int]) -> float:
        corners = [places[vertex] for vertex in ring]
        ways = zip(corners, [*corners[1:], corners[0]], strict=True)
        return float(sum(x0 * y1 - y0 * x1 for (x0, y0), (x1, y1) in ways))

    triangles, ring = [], list(range(len(points)))
    while len(ring) > 3:
        for at in range(len(ring)):
            ear, rest = [ring[at - 1], ring[at], ring[(at + 1) % len(ring)]], ring[:at] + ring[at + 1 :]
            if area(ear) > _FLAT and area(rest) > _FLAT:
                break
        triangles.append(ear)
        ring = rest
    return [*triangles, ring]


def _mixed(values: Floats, weights: Sequence[tuple[NDArray[np.int64], Floats]]) -> Floats:
    return np.concatenate([shares @ values[rows] for rows, shares in weights])
