"""Close T-junctions between boxes, for example between the parts of a wall above and beside a door.

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
_Line = tuple[int, int, int]  # axis of a line, and its other two coordinates in units


def welded(model: Any, surfaces: Sequence[GeomSurface]) -> list[GeomSurface]:
    """Split the edges of opaque axis-aligned boxes at the corners of other boxes."""
    corners: dict[_Line, set[int]] = {}
    box = mujoco.mjtGeom.mjGEOM_BOX
    boxes = [s for s in surfaces if model.geom_type[s.geom] == box and not s.is_translucent]
    for surface in boxes:
        for point in np.unique(_units(surface.positions), axis=0).tolist():
            for axis in range(3):
                corners.setdefault(_line(point, axis), set()).add(point[axis])
    lines = {line: np.array(sorted(values)) for line, values in corners.items() if len(values) > 2}
    welded_boxes = {surface.geom: _welded_box(surface, lines) for surface in boxes}
    return [welded_boxes.get(surface.geom, surface) for surface in surfaces]


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
            faces = _triangles(int(around[:, 2].argmax()), len(around) - 1)[:, :: -1 if is_turned else 1]
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


def _triangles(third: int, last: int) -> NDArray[np.int64]:
    """Divide a side into two fans of triangles. `third` and `last` are the third corner and the last vertex.

    No triangle is flat, because the tip of each fan is on one edge and its other vertices are on the next two.
    """
    fans = [(last, k, k + 1) for k in range(third - 1)], [(third - 1, k, k + 1) for k in range(third, last)]
    return np.array([*fans[0], *fans[1]])


def _mixed(values: Floats, weights: Sequence[tuple[NDArray[np.int64], Floats]]) -> Floats:
    return np.concatenate([shares @ values[rows] for rows, shares in weights])
