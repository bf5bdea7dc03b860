"""The floor plan of what a person cannot walk through: outlines of the compiled model's static geoms."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError

from mjsim.house.compiled.rooms import RoomMap
from mjsim.values.errors import AssetError

CIRCLE_SIDES = 32  # a circumscribed polygon covers 0.5 % of the radius too much, never too little

_GEOM = mujoco.mjtGeom


@dataclass(frozen=True, eq=False)
class Footprint:
    """Obstacles of a floor, seen from above."""

    obstacles: tuple[NDArray[np.float64], ...]  # convex polygons, counter-clockwise, m, each of shape (k, 2)
    bounds: tuple[float, float, float, float]  # extent of the rooms: (xmin, ymin, xmax, ymax), m


def footprint(model: mujoco.MjModel, *, low: float = 0.05, high: float = 1.8) -> Footprint:
    """Project the static colliding geoms that reach into a band of heights, from `low` to `high`, m.

    Floors and rugs end below the band; lintels, lamps and wall cupboards begin above it. A geom that reaches
    into the band counts with its whole outline. Objects and the person move, so they are left out.

    Raises:
        AssetError: The house has no rooms, or a static geom is a height field or a zero-sized shape.
    """
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    static = model.body_weldid[model.geom_bodyid] == 0
    colliding = (model.geom_contype | model.geom_conaffinity) != 0
    obstacles = []
    for geom in np.flatnonzero(static & colliding):
        if model.geom_type[geom] == _GEOM.mjGEOM_PLANE:
            continue
        points = outline_points(model, int(geom), data.geom_xpos[geom], data.geom_xmat[geom].reshape(3, 3))
        if points[:, 2].max() > low and points[:, 2].min() < high:
            obstacles.append(_hull(model, int(geom), points[:, :2]))
    return Footprint(tuple(obstacles), RoomMap.from_model(model).bounds)


def outline_points(
    model: mujoco.MjModel, geom: int, centre: NDArray[np.float64], rotation: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Points (k, 3), m, around `centre` with the geom's extent in z, whose outline from above covers its own.

    `AssetError` where the geom is a plane or a height field.
    """
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == _GEOM.mjGEOM_BOX:
        return np.asarray(_CORNERS * size @ rotation.T + centre)
    if kind in (_GEOM.mjGEOM_MESH, _GEOM.mjGEOM_SDF):
        mesh = model.geom_dataid[geom]
        first = model.mesh_vertadr[mesh]
        vertices = model.mesh_vert[first : first + model.mesh_vertnum[mesh]].astype(np.float64)
        return np.asarray(vertices @ rotation.T + centre)
    if kind in (_GEOM.mjGEOM_SPHERE, _GEOM.mjGEOM_ELLIPSOID):
        radii = size[[0, 0, 0]] if kind == _GEOM.mjGEOM_SPHERE else size
        return _ellipsoid(centre, rotation * radii)
    axis = rotation[:, 2] * size[1]
    if kind == _GEOM.mjGEOM_CAPSULE:
        ball = np.eye(3) * size[0]
        return np.vstack([_ellipsoid(centre - axis, ball), _ellipsoid(centre + axis, ball)])
    if kind == _GEOM.mjGEOM_CYLINDER:
        rim = _CIRCLE @ (rotation[:, :2] * size[0]).T
        return np.vstack([centre - axis + rim, centre + axis + rim])
    raise AssetError(
        f"geom {_name(model, geom)} is of type {_GEOM(kind).name}, whose outline is not known; "
        "build it from primitives or meshes"
    )


def _ellipsoid(centre: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outline and top and bottom of the image of the unit ball under the columns of `axes`."""
    # The shadow of a ball under a linear map to the plane is the ellipse that the map's SVD gives.
    directions, lengths, _ = np.linalg.svd(axes[:2])
    outline = np.zeros((CIRCLE_SIDES, 3))
    outline[:, :2] = _CIRCLE @ (directions * lengths).T
    reach = np.array([[0.0, 0.0, np.linalg.norm(axes[2])]])
    return np.asarray(np.vstack([outline, reach, -reach]) + centre)


def _hull(model: mujoco.MjModel, geom: int, points: NDArray[np.float64]) -> NDArray[np.float64]:
    try:
        return np.ascontiguousarray(points[ConvexHull(points).vertices])
    except QhullError as error:
        raise AssetError(
            f"static geom {_name(model, geom)} has no area seen from above; give it a thickness"
        ) from error


def _name(model: mujoco.MjModel, geom: int) -> str:
    body = model.body(model.geom_bodyid[geom]).name
    return repr(model.geom(geom).name or f"#{geom} of body {body}")


_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_ANGLES = 2 * np.pi * (np.arange(CIRCLE_SIDES) + 0.5) / CIRCLE_SIDES
# A polygon around the unit circle, touching it at the middles of its sides, (k, 2).
_CIRCLE = 1.0 / np.cos(np.pi / CIRCLE_SIDES) * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
