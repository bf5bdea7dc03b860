"""Measure drawn geometry that overlaps, or that flickers because two faces are in the same place."""

import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import bounding_boxes
from mjsim.house.compiled.rays import DRAWN, Floats, first_hit
from mjsim.house.validation.checked_model import Compiled

SLACK = 0.004  # depth by which drawn bodies may overlap, such as table legs on a rug, in metres
FLUSH = 0.0003  # maximum distance between two faces that flicker, in metres
FLICKER = 1e-4  # area of two coinciding faces above which people see them flicker, in m^2
EYES = (1.0, 2.0)  # range of people's eye heights in metres
GAP = 0.02  # width of a gap that hides the faces in it, in metres
SHELL = ("structure", "world", "floors")  # last parts of the names of bodies that form walls and floors
_SAMPLES = np.linspace(-0.45, 0.45, 3)  # positions on a face, relative to its size


@dataclass(frozen=True)
class DrawnFault:
    """A pair of drawn geoms that overlap, or that flicker because they have faces in the same place."""

    first: int  # id of the first geom
    second: int
    amount: float  # depth of the overlap in metres, or shared area of the faces in m^2
    place: tuple[float, ...]  # position (x, y, z) in metres


def overlaps(compiled: Compiled) -> list[DrawnFault]:
    """Find drawn geoms of different bodies that overlap by more than `SLACK`. Walls may overlap each other."""
    model, geoms = compiled.model, _drawn(compiled)
    low, high = bounding_boxes(model, compiled.data, geoms)
    bodies = model.geom_bodyid[geoms]
    shell = np.array([model.body(b).name.rpartition("/")[2] in SHELL for b in bodies.tolist()], bool)
    shared = np.minimum(high[:, None], high) - np.maximum(low[:, None], low)
    near = (shared > SLACK).all(axis=-1) & (bodies[:, None] < bodies) & ~(shell[:, None] & shell)
    ends, found = np.zeros(6), []
    for i, j in np.argwhere(near).tolist():
        first, second = int(geoms[i]), int(geoms[j])
        depth = -mujoco.mj_geomDistance(model, compiled.data, first, second, 0.0, ends)
        if depth > SLACK:
            found.append(DrawnFault(first, second, depth, tuple(((ends[:3] + ends[3:]) / 2).tolist())))
    return found


def coplanar_faces(compiled: Compiled) -> list[DrawnFault]:
    """Find pairs of visible box faces that are coplanar and overlap by more than `FLICKER` of their area.

    Faces of the same plain material look the same, so they are not reported.
    """
    model, geoms = compiled.model, _drawn(compiled)
    geoms = geoms[model.geom_type[geoms] == mujoco.mjtGeom.mjGEOM_BOX]
    geoms = geoms[np.abs(compiled.data.geom_xmat[geoms]).reshape(-1, 3, 3).max(axis=1).min(axis=1) > 1 - 1e-6]
    low, high = bounding_boxes(model, compiled.data, geoms)
    # The last row is for geoms without material.
    textured = np.append((model.mat_texid >= 0).any(axis=1), False)
    paint = np.column_stack([model.geom_matid[geoms], model.geom_rgba[geoms]])
    alike = ~textured[model.geom_matid[geoms]] & (paint[:, None] == paint).all(axis=2)
    found = []
    for axis, sign in itertools.product(range(3), (-1, 1)):
        a, b = (k for k in range(3) if k != axis)
        at = (high if sign > 0 else low)[:, axis]
        seen = (at > EYES[0] if sign < 0 else at < EYES[1]) | (axis < 2)
        shared = np.maximum(np.minimum(high[:, None], high) - np.maximum(low[:, None], low), 0.0)
        area = shared[..., a] * shared[..., b]
        pairs = np.argwhere(np.triu((np.abs(at[:, None] - at) < FLUSH) & (area > FLICKER) & ~alike & seen, 1))
        for i, j in pairs.tolist():
            rectangle = np.maximum(low[i], low[j]), np.minimum(high[i], high[j])
            for point in _samples(rectangle, axis, float(at[i])):
                if _is_visible(compiled, point, sign * np.eye(3)[axis], low, high):
                    place = tuple(point.tolist())
                    found.append(DrawnFault(int(geoms[i]), int(geoms[j]), float(area[i, j]), place))
                    break
    return found


def describe(compiled: Compiled, faults: Sequence[DrawnFault], scale: float, unit: str) -> str:
    """Return the number of faults, the largest amount and the names of its bodies, as text for a report."""
    if not faults:
        return "none"
    worst = max(faults, key=lambda fault: fault.amount)
    bodies = compiled.model.geom_bodyid[[worst.first, worst.second]].tolist()
    names = " and ".join(dict.fromkeys(compiled.model.body(body).name for body in bodies))
    return f"{len(faults)}, at most {scale * worst.amount:.0f} {unit}: {names}"


def _drawn(compiled: Compiled) -> NDArray[np.intp]:
    """Return the ids of all drawn geoms except planes, which are contact shadows."""
    planes = (mujoco.mjtGeom.mjGEOM_PLANE, mujoco.mjtGeom.mjGEOM_HFIELD)
    return compiled.shown[~np.isin(compiled.model.geom_type[compiled.shown], planes)]


def _samples(rectangle: tuple[Floats, Floats], axis: int, at: float) -> Iterator[Floats]:
    low, high = rectangle
    for u, v in itertools.product(_SAMPLES, _SAMPLES):
        point = (low + high) / 2 + np.insert([u, v], axis, 0.0) * (high - low)
        point[axis] = at
        yield point


def _is_visible(compiled: Compiled, point: Floats, normal: Floats, low: Floats, high: Floats) -> bool:
    """Return True if a point on a face is neither inside another box nor in a narrow gap."""
    start = point + 1e-3 * normal
    if ((low < start) & (start < high)).all(axis=1).any():
        return False
    return first_hit(compiled.model, compiled.data, start, normal, groups=DRAWN)[0] >= GAP
