"""Predict which objects a person may see soon.

The result may include objects that stay hidden. Only walls and large furniture hide objects, each object is
replaced by its bounding sphere, and the person may turn and walk at full speed. The visibility of an object
from each cell of a grid at eye height is cached until the object moves.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.rays import Floats, Mask
from mjsim.house.scene.scene import Scene
from mjsim.house.sight.drawn_state import WallBoxes, is_blocked, large_boxes
from mjsim.support.kernels import kernel
from mjsim.values.observation import Observation

CELL = 0.25  # side length of a grid cell, in metres
_MOVED = 1e-3  # displacement above which an object counts as moved, in metres
_UNKNOWN, _HIDDEN, _OPEN = -1, 0, 1
_OPAQUE = 0.99  # opacity above which a wall hides objects


class _VisibilityGrid(NamedTuple):
    origin: Floats  # x and y of the corner of the first cell, and the eye height, in metres
    # Visibility (`_UNKNOWN`, `_HIDDEN` or `_OPEN`) of n objects from each cell, shape (rows, columns, n).
    seen: NDArray[np.int8]


class PotentialVisibility:
    """A predictor of the objects that a person may see soon.

    Args:
        scene: Scene of the episode.
        horizon: Length of the prediction, in seconds.
        field_of_view: Horizontal field of view in radians. The default is that of the scene's person.
    """

    def __init__(self, scene: Scene, horizon: float, field_of_view: float | None = None) -> None:
        person = scene.person
        self._walls = scene.cached("opaque walls", lambda: _opaque_walls(scene))
        self._offsets, self._radii = _balls(scene)
        self._stride = horizon * person.fastest_walk
        self._swing = horizon * math.hypot(person.turning_speed, person.looking_speed)
        self._width = math.tan((field_of_view or person.field_of_view) / 2.0)
        low, high = _extent(self._walls, self._stride + 1.0)
        rows, columns = (math.ceil(length / CELL) for length in high - low)
        self._grid = _VisibilityGrid(
            np.array([*low, person.eye_height]),
            np.full((rows, columns, len(self._radii)), _UNKNOWN, np.int8),
        )
        self._centers = np.full((len(self._radii), 3), np.inf)

    def may_see(self, seen: Observation, aspect: float) -> Mask:
        """Return a mask (n,) of the objects that may soon be in view. `aspect` is its width / height."""
        centers = _centers(seen.object_positions, seen.object_quaternions, self._offsets)
        moved = (np.abs(centers - self._centers) > _MOVED).any(axis=1)
        if moved.any():
            self._centers[moved] = centers[moved]
            self._grid.seen[:, :, moved] = _UNKNOWN
        # Angle between the centre of the view and one of its corners
        corner = math.atan(self._width * math.hypot(1.0, 1.0 / aspect))
        c, s, cp, sp = (f(a) for a in (seen.heading, seen.pitch) for f in (math.cos, math.sin))
        gaze = np.array([c * cp, s * cp, sp])
        arguments = seen.eye, gaze, corner + self._swing, self._stride
        return np.asarray(_may_see(*arguments, self._centers, self._radii, self._walls, self._grid))


def _balls(scene: Scene) -> tuple[Floats, Floats]:
    scene = scene if scene.visuals else scene.counterpart(visuals=True)
    model, owner = scene.model, scene.index.geom_owner
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    signs = np.array(np.meshgrid(*[(-1.0, 1.0)] * 3)).T.reshape(-1, 3)
    count = len(scene.index.names)
    offsets, radii = np.zeros((count, 3)), np.zeros(count)
    positions, quaternions = scene.index.poses(data.qpos)
    for i in range(count):
        geoms = np.flatnonzero((owner == i) & (model.geom_group <= 2))
        boxes = model.geom_aabb[geoms]
        corners = boxes[:, None, :3] + signs * boxes[:, None, 3:]  # in the frame of each geom
        rotations = data.geom_xmat[geoms].reshape(-1, 3, 3)
        points = data.geom_xpos[geoms, None] + np.einsum("gij,gkj->gki", rotations, corners)
        body = np.zeros(9)
        mujoco.mju_quat2Mat(body, quaternions[i])
        local = (points.reshape(-1, 3) - positions[i]) @ body.reshape(3, 3)
        offsets[i] = (local.min(axis=0) + local.max(axis=0)) / 2.0
        radii[i] = np.linalg.norm(local - offsets[i], axis=1).max()
    return offsets, radii


def _opaque_walls(scene: Scene) -> WallBoxes:
    scene = scene if scene.visuals else scene.counterpart(visuals=True)
    return large_boxes(scene, _OPAQUE)


def _extent(walls: WallBoxes, margin: float) -> tuple[Floats, Floats]:
    if not len(walls.centers):
        return np.full(2, -margin), np.full(2, margin)
    half = np.abs(walls.axes[:, :2]) @ walls.half_sizes[:, :, None]
    half, centers = half[..., 0], walls.centers[:, :2]
    return (centers - half).min(axis=0) - margin, (centers + half).max(axis=0) + margin


@kernel
def _centers(positions: Floats, quaternions: Floats, offsets: Floats) -> Floats:
    centers = np.empty_like(positions)
    for i in range(len(positions)):
        w, x, y, z = quaternions[i]
        a, b, c = offsets[i]
        u, v, t = 2 * (y * c - z * b), 2 * (z * a - x * c), 2 * (x * b - y * a)
        centers[i, 0] = positions[i, 0] + a + w * u + y * t - z * v
        centers[i, 1] = positions[i, 1] + b + w * v + z * u - x * t
        centers[i, 2] = positions[i, 2] + c + w * t + x * v - y * u
    return centers


@kernel
def _may_see(
    eye: Floats,
    gaze: Floats,
    angle: float,
    stride: float,
    centers: Floats,
    radii: Floats,
    walls: WallBoxes,
    grid: _VisibilityGrid,
) -> Mask:
    """Return a mask of the objects within `angle` of the gaze that are visible from a cell near the eye.

    `angle` is in radians and `gaze` is a unit vector. The eye can move by `stride`. The bounding spheres of
    the objects have `centers` (n, 3) and `radii` (n,). Lengths are in metres. `grid` caches the results.
    """
    ahead = np.zeros(len(radii), np.bool_)
    for i in range(len(radii)):
        ray = centers[i] - eye
        distance = math.sqrt(ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2)
        spread = stride + radii[i]
        if distance <= spread:
            ahead[i] = True
            continue
        cosine = (ray[0] * gaze[0] + ray[1] * gaze[1] + ray[2] * gaze[2]) / distance
        ahead[i] = math.acos(min(1.0, max(-1.0, cosine))) <= angle + math.asin(spread / distance)
    found = np.zeros(len(radii), np.bool_)
    start, cell = np.array([eye[0], eye[1], grid.origin[2]]), np.empty(3)
    cell[2] = grid.origin[2]
    row, column = int((eye[0] - grid.origin[0]) / CELL), int((eye[1] - grid.origin[1]) / CELL)
    around = math.ceil(stride / CELL)
    for r in range(max(0, row - around), min(grid.seen.shape[0], row + around + 1)):
        for c in range(max(0, column - around), min(grid.seen.shape[1], column + around + 1)):
            cell[0], cell[1] = grid.origin[0] + (r + 0.5) * CELL, grid.origin[1] + (c + 0.5) * CELL
            if math.hypot(cell[0] - eye[0], cell[1] - eye[1]) > stride + CELL:
                continue
            if (r != row or c != column) and is_blocked(start, cell - start, 1.0, walls, True):
                continue
            for i in range(len(radii)):
                if ahead[i] and not found[i]:
                    if grid.seen[r, c, i] == _UNKNOWN:
                        grid.seen[r, c, i] = _ball_in_sight(cell, centers[i], radii[i], walls)
                    found[i] = grid.seen[r, c, i] == _OPEN
    return found


@kernel
def _ball_in_sight(eye: Floats, center: Floats, radius: float, walls: WallBoxes) -> int:
    ray = center - eye
    level = math.hypot(ray[0], ray[1])
    distance = math.hypot(level, ray[2])
    if distance <= radius or level < radius:
        return _OPEN
    reach = 1.0 - radius / distance  # fraction of the ray that is outside the bounding sphere
    if not is_blocked(eye, ray, reach, walls, True):
        return _OPEN
    side = np.array([-ray[1], ray[0], 0.0]) * (radius / level)
    top = np.array([-ray[0] * ray[2] / level, -ray[1] * ray[2] / level, level]) * (radius / distance)
    for end in (center + side, center - side, center + top, center - top):
        if not is_blocked(eye, end - eye, reach, walls, True):
            return _OPEN
    return _HIDDEN
