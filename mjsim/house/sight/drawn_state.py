"""Compute the poses of the visual geoms of a scene, and find large boxes that block the view."""

from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.rays import DRAWN, moving_geoms
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel

Floats = NDArray[np.float64]

MARGIN = 1e-6  # tolerance for rounding errors, in metres
_MIN_WALL = 0.25  # minimum half extents of a large box along its two longest axes, in metres


class WallBoxes(NamedTuple):
    """Large static boxes of a scene, from large to small."""

    centers: Floats  # centres of the boxes in metres, shape (w, 3)
    axes: Floats  # axes of the boxes as columns, shape (w, 3, 3)
    half_sizes: Floats  # half extents of the boxes in metres, shape (w, 3)


def drawn_state(scene: Scene, data: mujoco.MjData) -> tuple[Scene, mujoco.MjData]:
    """Return the scene with visual geoms and its state. The next call for the scene overwrites this state."""
    if scene.visuals:
        return scene, data
    drawn = scene.cached("drawn state", lambda: _DrawnState(scene.counterpart(visuals=True)))
    drawn.place(data)
    return drawn.scene, drawn.data


def large_boxes(scene: Scene, alpha: float) -> WallBoxes:
    """Find the large boxes with an opacity above `alpha` in a scene with visual geoms."""
    model = scene.model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    drawn, static = DRAWN[model.geom_group] > 0, ~moving_geoms(model)
    opacity = model.geom_rgba[:, 3].copy()  # Rays pass through invisible geoms, whose alpha is 0.
    textured = model.geom_matid >= 0
    opacity[textured] *= model.mat_rgba[model.geom_matid[textured], 3]
    extents = np.sort(model.geom_size, axis=1)
    large = (model.geom_type == mujoco.mjtGeom.mjGEOM_BOX) & (extents[:, 1] >= _MIN_WALL)
    found = np.flatnonzero(large & static & drawn & (opacity > alpha))
    found = found[np.argsort(-extents[found, 1] * extents[found, 2], kind="stable")]
    rotations = data.geom_xmat[found].reshape(-1, 3, 3)
    return WallBoxes(data.geom_xpos[found], rotations, model.geom_size[found])


@kernel
def is_blocked(eye: Floats, ray: Floats, reach: float, walls: WallBoxes, inside: bool) -> bool:
    """Return True if a wall blocks a ray from the eye within the fraction `reach` of its length.

    A wall around the eye blocks the ray only if `inside` is True. Walls are made smaller by `MARGIN`, so that
    rounding errors never block a ray.
    """
    for w in range(len(walls.centers)):
        enter, leave = -np.inf, reach
        for k in range(3):
            along = start = 0.0
            for j in range(3):
                along += ray[j] * walls.axes[w, j, k]
                start += (eye[j] - walls.centers[w, j]) * walls.axes[w, j, k]
            half = walls.half_sizes[w, k] - MARGIN
            if abs(along) > MARGIN:
                near, far = (-half - start) / along, (half - start) / along
                enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
            elif abs(start) > half:
                leave = -np.inf
            if enter >= leave:
                break
        if max(enter, 0.0) < leave and (inside or enter > 0.0):
            return True
    return False


class _DrawnState:
    def __init__(self, scene: Scene) -> None:
        self.scene, self.data = scene, mujoco.MjData(scene.model)
        model, data = scene.model, self.data
        mujoco.mj_kinematics(model, data)  # The poses of static geoms are computed only once.
        geoms = np.flatnonzero(model.body_weldid[model.geom_bodyid] != 0)
        self._geoms = (
            geoms, model.geom_bodyid[geoms], model.geom_pos[geoms], model.geom_quat[geoms],
            data.geom_xpos, data.geom_xmat,
        )  # fmt: skip

    def place(self, data: mujoco.MjData) -> None:
        mine = self.data
        mine.xpos[:], mine.xquat[:], mine.xmat[:] = data.xpos, data.xquat, data.xmat
        mine.xipos[:], mine.ximat[:] = data.xipos, data.ximat
        place_geoms(self._geoms, data.xpos, data.xquat, data.xmat)


@kernel
def place_geoms(geoms: Any, positions: Floats, quaternions: Floats, rotations: Floats) -> None:
    """Compute the poses of geoms from the poses of their bodies, with exactly the same arithmetic as MuJoCo.

    `geoms` contains geom ids (g,), body ids (g,), positions (g, 3) and quaternions (g, 4) relative to the
    bodies, and the output arrays (ngeom, 3) and (ngeom, 9). The other arrays are body poses as in `MjData`.
    """
    ids, bodies, local_positions, local_quaternions, geom_xpos, geom_xmat = geoms
    for k in range(len(ids)):
        position, rotation, r = local_positions[k], geom_xmat[ids[k]], rotations[bodies[k]]
        for i in range(3):
            offset = r[3 * i] * position[0] + r[3 * i + 1] * position[1] + r[3 * i + 2] * position[2]
            geom_xpos[ids[k], i] = offset + positions[bodies[k], i]
        a, b = quaternions[bodies[k]], local_quaternions[k]
        w = a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3]
        x = a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2]
        y = a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1]
        z = a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0]
        rotation[0] = w * w + x * x - y * y - z * z
        rotation[4] = w * w - x * x + y * y - z * z
        rotation[8] = w * w - x * x - y * y + z * z
        rotation[1], rotation[2] = 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)
        rotation[3], rotation[5] = 2.0 * (x * y + w * z), 2.0 * (y * z - w * x)
        rotation[6], rotation[7] = 2.0 * (x * z - w * y), 2.0 * (y * z + w * x)
