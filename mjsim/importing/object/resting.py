"""Find the pose in which an object rests on the floor."""

import math
from dataclasses import dataclass

import numpy as np
import scipy.spatial
import trimesh

from mjsim.formats.scene.surface import Floats
from mjsim.importing.object.parts import MIN_WIDTH

STEADY = math.radians(12.0)  # angle by which a stable object can be tilted without tipping over
_CONTACT = 0.0005  # maximum height of points that count as touching the floor, in metres
_FOOT_SLOPE = 0.45  # half the width of a foot, relative to the height of the centre of mass
_MAX_FACES = 300  # maximum number of faces that are tried as the base of an object
_LOWER = 1.2  # factor by which a new pose must lower the centre of mass to be preferred
_SMALLER = 0.95  # share to which a rotation must reduce the area of the footprint


@dataclass(frozen=True, eq=False)
class RestingPose:
    """The pose in which an object rests on the floor."""

    rotation: Floats  # rotation (3, 3) from the file's axes to the object's axes
    tilt: float  # angle at which the object tips over, in radians
    turned: bool  # True if the object rests on a different side than in the file


def resting_pose(points: Floats, centre: Floats) -> RestingPose:
    """Return the pose from the file if points (n, 3) are stable in it, or the most stable pose otherwise."""
    down = np.array([0.0, 0.0, -1.0])
    as_it_is = tilt(points, centre, down)
    if as_it_is >= STEADY:
        return RestingPose(_squared(points), as_it_is, turned=False)
    normals = scipy.spatial.ConvexHull(points).equations[:, :3]
    _, first = np.unique(np.round(normals, 2), axis=0, return_index=True)
    sides = normals[first[np.linspace(0, len(first) - 1, min(len(first), _MAX_FACES)).astype(int)]]
    tilts = [tilt(points, centre, side) for side in sides]
    best = int(np.argmax(tilts))
    if tilts[best] < STEADY:  # A round object gets a foot on the side where its centre of mass is lowest.
        heights = (points @ sides.T).max(axis=0) - sides @ centre
        best = int(np.argmin(heights.round(4)))
        if centre[2] - points[:, 2].min() < _LOWER * heights[best]:
            return RestingPose(_squared(points), as_it_is, turned=False)
    turn = trimesh.geometry.align_vectors(sides[best], down)[:3, :3]
    return RestingPose(np.asarray(_squared(points @ turn.T) @ turn), tilts[best], turned=True)


def tilt(points: Floats, centre: Floats, down: Floats) -> float:
    """Return the tilt in radians at which points (n, 3) tip over. It is negative if they are unstable."""
    turn = trimesh.geometry.align_vectors(down, [0.0, 0.0, -1.0])[:3, :3]
    placed, mass = points @ turn.T, turn @ centre
    floor = placed[:, 2].min()
    support = placed[placed[:, 2] < floor + _CONTACT, :2]
    return math.atan2(_distance_inside(support, mass[:2]), mass[2] - floor)


def foot(points: Floats, centre: Floats) -> Floats:
    """Return the corners (8, 3) of a low foot that keeps an object with vertices (n, 3) from rolling, in metres."""
    low, high = points.min(axis=0), points.max(axis=0)
    reach = np.minimum(centre[:2] - low[:2], high[:2] - centre[:2])
    half = np.clip(_FOOT_SLOPE * (centre[2] - low[2]), MIN_WIDTH / 2, np.maximum(0.8 * reach, MIN_WIDTH / 2))
    signs = np.array([[i, j, k] for i in (-1, 1) for j in (-1, 1) for k in (0, 1)])
    block = signs * np.array([*half, min(MIN_WIDTH + 0.004, high[2] - low[2])])
    return np.asarray(block + np.array([*centre[:2], low[2]]))


def _distance_inside(polygon: Floats, point: Floats) -> float:
    """Return the distance from a point (2,) to the edge of the hull of points (n, 2), negative if outside."""
    try:
        sides = scipy.spatial.ConvexHull(polygon).equations
    except (scipy.spatial.QhullError, ValueError):  # All points are equal or on a line.
        return -float(np.linalg.norm(polygon - point, axis=1).min())
    return -float((sides[:, :2] @ point + sides[:, 2]).max())


def _squared(points: Floats) -> Floats:
    """Return the rotation (3, 3) about the vertical that gives the smallest bounding box of the footprint."""
    flat = points[:, :2]
    to_box, extents = trimesh.bounds.oriented_bounds_2D(flat)
    rotation = np.eye(3)
    if np.prod(extents) < _SMALLER * np.prod(np.ptp(flat, axis=0)):
        rotation[:2, :2] = to_box[:2, :2]
    return rotation
