"""A Numba kernel that scans a physics simulation for problems after each control step."""

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

# Distance from a room up to which an object counts as inside, in metres. Doorways are not part of the rooms.
OUTSIDE = 0.3

_TOLERANCE = 1e-6  # tolerance for rounding errors, in metres

# Results of a scan.
NORMAL, SUSPECT, WARNED, NOT_FINITE = 0, 1, 2, 3
# Flags of an object: far from its anchor, fast, slow, touched by the person's foot. See `ScanArrays.limits`.
DISPLACED, FAST, SLOW, PUSHED = 1, 2, 4, 8


def static_boxes(scene: Scene) -> Floats:
    """Return the minimum and maximum corners of the house geoms' bounding boxes, shape (k, 6)."""
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
    """The inputs and outputs of a scan. Most inputs are views of a simulation's state."""

    qpos: Floats  # generalized positions, shape (nq,)
    qvel: Floats  # generalized velocities, shape (nv,)
    xipos: Floats  # centres of mass of all bodies in metres, shape (nbody, 3)
    site_xpos: Floats  # positions of all sites in metres, shape (nsite, 3)
    site_xmat: Floats  # orientations of all sites, shape (nsite, 9)
    warnings: Ints  # number of MuJoCo warnings by type, shape (nwarning,)
    bodies: Ints  # body id of each object, shape (n,)
    dofs: Ints  # first degree of freedom of each object, shape (n,)
    geom_owner: Ints  # object index of each geom, or -1, shape (ngeom,)
    trunk: int  # geom ids of the person's trunk and foot
    foot: int
    # Squares of three limits, shape (3,): distance (m) from its anchor at which an object is `DISPLACED`,
    # speed (m/s) above which it is `FAST`, and speed (m/s) below which it is `SLOW`.
    limits: Floats
    boxes: Floats  # boxes returned by `static_boxes`
    rooms: tuple[Floats, Floats, Floats]  # see `RoomMap.rectangles`
    grip_sites: NDArray[np.intp]  # see `Grips.sites`
    # See `AnomalyDetector.anchors`. An anchor follows its object if none of the `boxes` is on the path.
    anchors: Floats
    flags: NDArray[np.uint8]  # output: flags of each object, shape (n,)
    # Output, shape (6,): the two overlaps (at least 0), two distances and two angles of a `HealthSample`.
    sample: Floats
    # Input and output, shape (4,): largest overlaps (metres) and weld errors (metres and radians) so far.
    extremes: Floats


@kernel
def scan(fields: Any, geoms: Ints, distances: Floats, left: bool, right: bool) -> int:
    """Scan the state, objects, hands and contacts. Return `NORMAL`, `SUSPECT`, `WARNED` or `NOT_FINITE`.

    `fields` is a `ScanArrays` as a plain tuple, which Numba unpacks twice as fast. `geoms` (ncon, 2) and
    `distances` (ncon,), in metres, describe the contacts. `left` and `right` are True for loaded hands.
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
