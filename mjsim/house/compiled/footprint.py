"""Project the static geoms of a house onto the floor, and look up nearby obstacles and their distances."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import mujoco
import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from scipy.ndimage import distance_transform_edt
from scipy.spatial import ConvexHull, QhullError

from mjsim.house.compiled.sites import RoomMap
from mjsim.support.kernels import kernel
from mjsim.values.errors import AssetError

CIRCLE_SIDES = 32  # number of sides of the polygon around a circle, which is at most 0.5 % wider
_GEOM = mujoco.mjtGeom
_CORNERS = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-1.0, 1.0)])
_ANGLES = 2 * np.pi * (np.arange(CIRCLE_SIDES) + 0.5) / CIRCLE_SIDES
# Vertices of a polygon around the unit circle, shape (CIRCLE_SIDES, 2).
_CIRCLE = 1.0 / np.cos(np.pi / CIRCLE_SIDES) * np.column_stack([np.cos(_ANGLES), np.sin(_ANGLES)])
_TRUNK_BAND = (0.04, 1.72)  # heights of the lower and upper end of a person's trunk, in metres
CELL = 0.25  # side length of the cells of a `Floor` grid, in metres
MARGIN = 0.12  # maximum gap between the trunk and an obstacle that counts as nearby, in metres
BORDER = 0.4  # default margin of a grid around the rooms, in metres


@dataclass(frozen=True, eq=False)
class Footprint:
    """The obstacles in a house, and the extent of its rooms, seen from above."""

    # Outlines of the obstacles as convex, counter-clockwise polygons in metres, each of shape (k, 2).
    obstacles: tuple[NDArray[np.float64], ...]
    bounds: tuple[float, float, float, float]  # extent of the rooms in metres: (xmin, ymin, xmax, ymax)


def footprint(model: mujoco.MjModel, *, low: float = 0.05, high: float = 1.8) -> Footprint:
    """Project all static, colliding geoms between the heights `low` and `high`, in metres, onto the floor.

    Floors and rugs end below the default range, while lintels, lamps and wall cupboards begin above it. A
    geom that is only partly in the range is projected as a whole. Objects and the person are left out.

    Raises:
        AssetError: The house has no rooms, or a static geom is a height field or has no area.
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
    """Return points (k, 3), in metres, that enclose a geom seen from above and have the same height range.

    Raises:
        AssetError: The geom is a plane or a height field.
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
        f"geom {geom_name(model, geom)} is of type {_GEOM(kind).name}, whose outline is not known; "
        "build it from primitives or meshes"
    )


def bounding_boxes(
    model: mujoco.MjModel, data: mujoco.MjData, geoms: ArrayLike
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the lower and upper corners of the bounding boxes of n geoms in metres, each of shape (n, 3)."""
    rotations, boxes = data.geom_xmat[geoms].reshape(-1, 3, 3), model.geom_aabb[geoms]
    middle = data.geom_xpos[geoms] + np.einsum("gij,gj->gi", rotations, boxes[:, :3])
    half = np.einsum("gij,gj->gi", np.abs(rotations), boxes[:, 3:])
    return middle - half, middle + half


def _ellipsoid(centre: NDArray[np.float64], axes: NDArray[np.float64]) -> NDArray[np.float64]:
    # A linear map onto the plane turns a ball into an ellipse. The SVD of the map gives its axes.
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
            f"static geom {geom_name(model, geom)} has no area seen from above; give it a thickness"
        ) from error


def geom_name(model: mujoco.MjModel, geom: int) -> str:
    """Return the quoted name of a geom, or its number and body if it has no name."""
    body = model.body(model.geom_bodyid[geom]).name
    return repr(model.geom(geom).name or f"#{geom} of body {body}")


class Floor(NamedTuple):
    """The obstacles on a floor, as arrays for kernels. Each cell of a grid lists the obstacles near it."""

    # Edges of the obstacles, counter-clockwise. Columns: start x, start y, direction x, direction y, length.
    edges: NDArray[np.float64]
    first: NDArray[np.int64]  # first row of each obstacle in `edges`, shape (p + 1,)
    boxes: NDArray[np.float64]  # bounding box of each obstacle: xmin, xmax, ymin, ymax, shape (p, 4)
    near: NDArray[np.int64]  # indices of the obstacles near each cell, one cell after the other
    # Index in `near` of the first obstacle of each cell, row by row, shape (cells + 1,).
    near_first: NDArray[np.int64]
    origin_x: float  # x coordinate of the corner of cell (0, 0), in metres
    origin_y: float  # y coordinate of the corner of cell (0, 0), in metres
    rows: int  # number of cells along x
    columns: int  # number of cells along y

    @classmethod
    def of(cls, model: mujoco.MjModel, radius: float) -> "Floor":
        """Build the obstacle grid of a compiled house for a person with this trunk radius, in metres."""
        low, high = _TRUNK_BAND
        return cls.of_polygons(footprint(model, low=low, high=high).obstacles, radius)

    @classmethod
    def of_polygons(cls, polygons: tuple[NDArray[np.float64], ...], radius: float) -> "Floor":
        """Build the grid from convex, counter-clockwise polygons (k, 2) for a trunk radius, in metres."""
        reach = radius + MARGIN
        boxes = np.array([[*p.min(axis=0), *p.max(axis=0)] for p in polygons]).reshape(-1, 4)
        low = boxes[:, :2].min(axis=0, initial=np.inf) - reach if len(polygons) else np.zeros(2)
        high = boxes[:, 2:].max(axis=0, initial=-np.inf) + reach if len(polygons) else np.ones(2)
        rows, columns = (int(n) for n in np.ceil((high - low) / CELL))
        i, j = (index.ravel() for index in np.mgrid[:rows, :columns])
        x, y = low[0] + CELL * i, low[1] + CELL * j
        cells = shapely.box(x, y, x + CELL, y + CELL)
        tree = shapely.STRtree([shapely.Polygon(polygon) for polygon in polygons])
        cell, near = tree.query(cells, predicate="dwithin", distance=reach)
        order = np.lexsort((near, cell))
        edges = [_edges(polygon) for polygon in polygons]
        counts = np.bincount(cell, minlength=rows * columns)
        return cls(
            edges=np.concatenate([np.zeros((0, 5)), *edges]),
            first=np.cumsum([0, *(len(sides) for sides in edges)], dtype=np.int64),
            boxes=np.ascontiguousarray(boxes[:, [0, 2, 1, 3]]),
            near=np.ascontiguousarray(near[order].astype(np.int64)),
            near_first=np.concatenate(([0], np.cumsum(counts))).astype(np.int64),
            origin_x=float(low[0]),
            origin_y=float(low[1]),
            rows=rows,
            columns=columns,
        )


def _edges(polygon: NDArray[np.float64]) -> NDArray[np.float64]:
    sides = np.roll(polygon, -1, axis=0) - polygon
    lengths = np.hypot(sides[:, 0], sides[:, 1])
    keep = lengths > 0.0
    return np.column_stack((polygon[keep], sides[keep] / lengths[keep, None], lengths[keep]))


class ClearanceField(NamedTuple):
    """A grid of signed distances to the nearest static geom. All arrays are for kernels."""

    # Distance from each cell's centre to the nearest geom in metres, negative inside geoms, shape (nx, ny).
    distance: NDArray[np.float64]
    gradient: NDArray[np.float64]  # direction of the steepest increase as a unit vector, shape (nx, ny, 2)
    origin_x: float  # x coordinate of the centre of cell (0, 0), in metres
    origin_y: float  # y coordinate of the centre of cell (0, 0), in metres
    resolution: float  # side length of a cell in metres

    @classmethod
    def from_model(
        cls,
        model: mujoco.MjModel,
        *,
        low: float,
        high: float,
        resolution: float = 0.04,
        border: float = BORDER,
    ) -> "ClearanceField":
        """Compute the grid for all static, colliding geoms between two heights, in metres."""
        plan = footprint(model, low=low, high=high)
        xmin, ymin, xmax, ymax = plan.bounds
        origin = np.array([xmin - border, ymin - border])
        shape = np.ceil((np.array([xmax, ymax]) + border - origin) / resolution).astype(int) + 1
        solid = np.zeros(tuple(shape), dtype=bool)
        for polygon in plan.obstacles:
            _fill(solid, (polygon - origin) / resolution)
        outside = distance_transform_edt(~solid) if solid.any() else np.full(solid.shape, math.inf)
        distance = np.minimum((outside - distance_transform_edt(solid)) * resolution, 9.0)
        gradient = np.stack(np.gradient(distance, resolution), axis=-1)
        size = np.linalg.norm(gradient, axis=-1, keepdims=True)
        unit = np.divide(gradient, size, out=np.zeros_like(gradient), where=size > 1e-9)
        return cls(distance, unit, float(origin[0]), float(origin[1]), resolution)


@kernel
def clearance_at(x: float, y: float, field: ClearanceField) -> tuple[float, float, float]:
    """Return the distance from a point to the nearest geom, in metres, and the direction away from it."""
    distance, gradient = field.distance, field.gradient
    u = (x - field.origin_x) / field.resolution
    v = (y - field.origin_y) / field.resolution
    i = min(max(int(u), 0), distance.shape[0] - 2)
    j = min(max(int(v), 0), distance.shape[1] - 2)
    a, b = min(max(u - i, 0.0), 1.0), min(max(v - j, 0.0), 1.0)
    low = (1 - a) * distance[i, j] + a * distance[i + 1, j]
    high = (1 - a) * distance[i, j + 1] + a * distance[i + 1, j + 1]
    near_i, near_j = i + int(a > 0.5), j + int(b > 0.5)
    return (1 - b) * low + b * high, gradient[near_i, near_j, 0], gradient[near_i, near_j, 1]


def _fill(grid: NDArray[np.bool_], polygon: NDArray[np.float64]) -> None:
    low = np.maximum(np.floor(polygon.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(polygon.max(axis=0)).astype(int) + 1, grid.shape)
    if np.any(low >= high):
        return
    cells = np.stack(
        np.meshgrid(*(np.arange(a, b) for a, b in zip(low, high, strict=True)), indexing="ij"), -1
    )
    inside = np.ones(cells.shape[:2], dtype=bool)
    for start, end in zip(polygon, np.roll(polygon, -1, axis=0), strict=True):
        edge = end - start
        length = float(np.hypot(*edge))
        if length > 1e-9:  # The polygon is counter-clockwise, so its interior is to the left of each edge.
            offset = cells - start
            left_by = (edge[0] * offset[..., 1] - edge[1] * offset[..., 0]) / length
            inside &= left_by >= -0.5
    grid[low[0] : high[0], low[1] : high[1]] |= inside
