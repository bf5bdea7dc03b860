"""Meshes of a house that collide: MuJoCo takes each for its convex hull, which may fill floor that it leaves free."""

from collections.abc import Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.findings import Finding
from mjsim.house.validation.floor import BODY_BAND

AREA = 0.1  # m^2 of floor that a hull may fill
_SIDE = 24  # places along each side of a hull's outline
_MAX_CROSSINGS = 50


def check_hulls(compiled: Compiled) -> Iterator[Finding]:
    """Colliding meshes around whose triangles a person could stand, but not around their hull."""
    model, (low, high) = compiled.model, BODY_BAND
    meshes = compiled.solid[model.geom_type[compiled.solid] == mujoco.mjtGeom.mjGEOM_MESH]
    for geom in meshes.tolist():
        points = compiled.points(geom)
        if points[:, 2].max() < low or points[:, 2].min() > high:
            continue
        places, share = _places_within(points[:, :2])
        free = [place for place in places if _is_free(compiled, geom, place)]
        if len(free) * share > AREA:
            yield compiled.warning(
                "hulls",
                f"the mesh geom {compiled.geom_name(geom)} collides as its convex hull, which fills "
                f"{len(free) * share:.1f} m^2 of floor that the mesh leaves free",
                'add boxes or convex parts in group 3, and let the mesh only be seen: contype="0" conaffinity="0"',
                (*np.mean(free, axis=0), 0.0),
            )


def _places_within(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Places (k, 2), m, on a grid within the convex hull of points (n, 2), m, and the area of each, m^2."""
    sides = np.ptp(points, axis=0) / _SIDE
    steps = np.stack(np.meshgrid(np.arange(_SIDE), np.arange(_SIDE)), axis=-1).reshape(-1, 2)
    places = points.min(axis=0) + (steps + 0.5) * sides
    edges = ConvexHull(points).equations
    inside = np.all(places @ edges[:, :2].T + edges[:, 2] < 0, axis=1)
    return places[inside], float(np.prod(sides))


def _is_free(compiled: Compiled, geom: int, place: NDArray[np.float64]) -> bool:
    """Whether nothing of a mesh is at chest height over a floor point (2,), m, and nothing below it."""
    low, high = BODY_BAND
    at, crossings = np.array([*place, high / 2]), 0
    below = _to_mesh(compiled, geom, at, -1.0)
    while (above := _to_mesh(compiled, geom, at, 1.0)) >= 0 and crossings < _MAX_CROSSINGS:
        crossings += 1
        at[2] += above + 1e-4
    return crossings % 2 == 0 and not 0 <= below < high / 2 - low


def _to_mesh(compiled: Compiled, geom: int, start: NDArray[np.float64], up: float) -> float:
    """Distance from a point (3,), m, up (1) or down (-1) to the next triangle of a mesh, m; -1 where there is none."""
    return float(mujoco.mj_rayMesh(compiled.model, compiled.data, geom, start, np.array([0.0, 0.0, up])))
