"""A Numba kernel that scans the state, objects, hands and contacts after each control step."""

import math
from typing import Any, NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.house import compiled_house
from mjsim.house.compiled.sites import nearest_rectangle
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel
from mjsim.world.body.grips import site_angle, site_gap

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# Doorways are outside the rooms, so positions up to this far from a room count as inside. In metres.
OUTSIDE = 0.3

_TOLERANCE = 1e-6  # tolerance for rounding errors, in metres

# Results of a scan.
NORMAL, SUSPECT, WARNED, NOT_FINITE = 0, 1, 2, 3
# Flags of an object: far from its anchor, fast, slow, or touched by the person's foot. See `ScanArrays.limits`.
DISPLACED, FAST, SLOW, PUSHED = 1, 2, 4, 8


def static_boxes(scene: Scene) -> Floats:
    """Return the minimum and maximum corner of a box around each colliding geom of the house, shape (k, 6)."""
    return compiled_house(scene.catalogue).cached(("static boxes",), lambda: _static_boxes(scene.model))


def _static_boxes(model: mujoco.MjModel) -> Floats:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    static = model.body_weldid[model.geom_bodyid] == 0
    geoms = np.flatnonzero(static & ((model.geom_contype | model.geom_conaffinity) > 0))
    rotations, boxes = data.geom_xmat[geoms].reshape(-1, 3, 3), model.geom_aabb[geoms]
    centers = data.geom_xpos[geoms] + np.einsum("kij,kj->ki", rotations, boxes[:, :3])
    half_sizes = np.einsum("kij,kj->ki", np.abs(rotations), boxes[:, 3:]) + _TOLERANCE
    return np.hstack((centers - half_sizes, centers + half_sizes))


class ScanArrays(NamedTuple):
    """Inputs and outputs of scans: views of a simulation's state and model, and the results."""

    qpos: Floats  # generalized positions, shape (nq,)
    qvel: Floats  # generalized velocities, shape (nv,)
    xipos: Floats  # centres of mass of all bodies in metres, shape (nbody, 3)
    site_xpos: Floats  # positions of all sites in metres, shape (nsite, 3)
    site_xmat: Floats  # orientations of all sites, shape (nsite, 9)
    warnings: Ints  # number of MuJoCo warnings by type, shape (nwarning,)
    bodies: Ints  # body id of each object, shape (n,)
    dofs: Ints  # first degree of freedom of each object, shape (n,)
    geom_owner: Ints  # object index of each geom, or -1, shape (ngeom,)
    trunk: int  # geoms of the person
    foot: int
    # Squares of three limits, shape (3,): distance from the anchor (metres) beyond which an object is `DISPLACED`,
    # speed (m/s) above which it is `FAST`, and speed (m/s) below which it is `SLOW`.
    limits: Floats
    boxes: Floats  # boxes returned by `static_boxes`
    rooms: tuple[Floats, Floats, Floats]  # see `RoomMap.rectangles`
    grip_sites: NDArray[np.intp]  # see `Grips.sites`
    # See `AnomalyDetector.anchors`. An anchor moves along if `boxes` show that the path is clear.
    anchors: Floats
    flags: NDArray[np.uint8]  # output: flags of each object, shape (n,)
    # Output, shape (6,): both overlaps of a `HealthSample`, at least 0, then its weld errors in metres and in radians.
    sample: Floats
    # Updated: largest overlaps (metres) and weld errors (metres and radians) so far, shape (4,).
    extremes: Floats


@kernel
def scan(fields: Any, geoms: Ints, distances: Floats, left: bool, right: bool) -> int:
    """Scan the state, objects, hands and contacts. Return `NORMAL`, `SUSPECT`, `WARNED` or `NOT_FINITE`.

    `fields` are those of `ScanArrays` as a plain tuple, which Numba unpacks in half the time. `geoms` (ncon, 2) and
    `distances` (ncon,), in metres, are those of the contacts. `left` and `right` are True if the hand holds an object.
    """
    arrays = ScanArrays(*fields)
    for count in arrays.warnings:
        if count:
            return WARNED
    total = 0.0
    for value in arrays.qpos:
        total += value
    for value in arrays.qvel:
        total += value
    if not math.isfinite(total):
        return NOT_FINITE
    state = _flag_objects(arrays)
    sample, sites = arrays.sample, arrays.grip_sites
    sample[0], sample[1] = _overlaps(arrays, geoms, distances)
    for hand in range(2):
        sample[2 + hand] = sample[4 + hand] = math.nan
        if (left if hand == 0 else right) and sites[hand, 0] >= 0:
            sample[2 + hand] = site_gap(arrays.site_xpos, sites[hand, 0], sites[hand, 1])
            sample[4 + hand] = site_angle(arrays.site_xmat, sites[hand, 0], sites[hand, 1])
    for k in range(6):
        extreme = k if k < 2 else k // 2 + 1
        if sample[k] > arrays.extremes[extreme]:  # NaN compares as False
            arrays.extremes[extreme] = sample[k]
    return state


@kernel
def _flag_objects(arrays: ScanArrays) -> int:
    state, anchors, limits, rooms = NORMAL, arrays.anchors, arrays.limits, arrays.rooms
    for item in range(len(arrays.bodies)):
        center, dof, flags = arrays.xipos[arrays.bodies[item]], arrays.dofs[item], 0
        gap = speed = 0.0
        for k in range(3):
            gap += (center[k] - anchors[item, k]) ** 2
            speed += arrays.qvel[dof + k] ** 2
        if gap > limits[0]:
            clear = is_path_clear(anchors[item], center, arrays.boxes)
            if clear and nearest_rectangle(center[0], center[1], rooms[0], rooms[1], rooms[2]) <= OUTSIDE:
                anchors[item, 0], anchors[item, 1], anchors[item, 2] = center[0], center[1], center[2]
            else:
                flags |= DISPLACED
        if speed > limits[1]:
            flags |= FAST
        if flags:
            state = SUSPECT
        if speed < limits[2]:
            flags |= SLOW
        arrays.flags[item] = flags
    return state


@kernel
def is_path_clear(start: Floats, end: Floats, boxes: Floats) -> bool:
    """Return True if the bounding box of two points (3,) overlaps none of the boxes."""
    low_x, high_x = min(start[0], end[0]), max(start[0], end[0])
    low_y, high_y = min(start[1], end[1]), max(start[1], end[1])
    low_z, high_z = min(start[2], end[2]), max(start[2], end[2])
    for box in boxes:
        if (
            low_x <= box[3] and high_x >= box[0]
            and low_y <= box[4] and high_y >= box[1]
            and low_z <= box[5] and high_z >= box[2]
        ):  # fmt: skip
            return False
    return True


@kernel
def _overlaps(arrays: ScanArrays, geoms: Ints, distances: Floats) -> tuple[float, float]:
    trunk, foot, owner = arrays.trunk, arrays.foot, arrays.geom_owner
    deepest = deepest_trunk = 0.0
    for c in range(len(distances)):
        first, second = geoms[c, 0], geoms[c, 1]
        if first == trunk or second == trunk:
            deepest_trunk = max(deepest_trunk, -distances[c])
        elif first == foot or second == foot:
            item = owner[second] if first == foot else owner[first]
            if item >= 0 and distances[c] < 0.0:
                arrays.flags[item] |= PUSHED
        else:
            deepest = max(deepest, -distances[c])
    return deepest, deepest_trunk
