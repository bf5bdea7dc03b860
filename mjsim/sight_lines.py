"""Lines of sight that are worth a ray: in the field of view, and not behind a large wall for certain."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel

INSET = 0.7  # of the half extents: box corners and face centres of round objects are empty
OFFSETS = np.vstack([np.zeros(3), INSET * np.eye(3), -INSET * np.eye(3)])
MARGIN = 1e-6  # m, for rounding


class SightGeometry(NamedTuple):
    """What looking needs of a scene and no step changes.

    Attributes:
        geoms: Ids of the objects' drawn geoms, (g,).
        owners: Position of each one's object in the episode's order, (g,).
        boxes: Centre and half extents of each one's bounding box, in its own frame, m, (g, 6).
        wall_centers: Centres of large static boxes (walls, cupboards), the largest first, m, (w, 3).
        wall_axes: Their axes as columns, (w, 3, 3).
        wall_half_sizes: Their half extents, m, (w, 3).
        person: Which geoms belong to the person, (ngeom,).
    """

    geoms: NDArray[np.int64]
    owners: NDArray[np.int64]
    boxes: NDArray[np.float64]
    wall_centers: NDArray[np.float64]
    wall_axes: NDArray[np.float64]
    wall_half_sizes: NDArray[np.float64]
    person: NDArray[np.bool_]


class Gaze(NamedTuple):
    """Where the eye is, and what it could see if nothing were in between.

    Attributes:
        eye: m, (3,).
        axes: Rows forward, left and up, (3, 3).
        slopes: Tangents of half the horizontal and half the vertical field of view, (2,).
        range: m.
    """

    eye: NDArray[np.float64]
    axes: NDArray[np.float64]
    slopes: NDArray[np.float64]
    range: float


@kernel
def open_rays(
    sight: SightGeometry,
    positions: NDArray[np.float64],
    rotations: NDArray[np.float64],
    wanted: NDArray[np.bool_],
    gaze: Gaze,
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Rays worth casting: inside the field of view, and no wall certainly in front of the object.

    Args:
        sight: Objects and walls.
        positions: Geom positions, m, (ngeom, 3).
        rotations: Geom rotations, row by row, (ngeom, 9).
        wanted: Which objects count, (n,).
        gaze: Eye and field of view.

    Returns:
        Object of each ray, (k,), in order, and vectors from the eye to points in its bounding box, m, (k, 3).
    """
    low, high = bounding_boxes(sight, positions, rotations, wanted)
    owners, rays = np.empty(7 * len(wanted), np.int64), np.empty((7 * len(wanted), 3))
    count = 0
    for i in np.flatnonzero(low[:, 0] <= high[:, 0]):
        for offset in OFFSETS:
            ray = rays[count]
            for k in range(3):
                middle, half = (low[i, k] + high[i, k]) / 2, (high[i, k] - low[i, k]) / 2
                ray[k] = middle + half * offset[k] - gaze.eye[k]
            if in_field(ray, gaze) and not is_blocked(ray, low[i], high[i], gaze.eye, sight):
                owners[count] = i
                count += 1
    return owners[:count], rays[:count]


@kernel
def bounding_boxes(
    sight: SightGeometry,
    positions: NDArray[np.float64],
    rotations: NDArray[np.float64],
    wanted: NDArray[np.bool_],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Corners of the upright boxes around wanted objects, m, each (n, 3); infinity and -infinity for the others."""
    low, high = np.full((len(wanted), 3), np.inf), np.full((len(wanted), 3), -np.inf)
    for geom, i, box in zip(sight.geoms, sight.owners, sight.boxes):  # noqa: B905 - numba knows no `strict`
        if not wanted[i]:
            continue
        for k in range(3):
            r0, r1, r2 = rotations[geom, 3 * k], rotations[geom, 3 * k + 1], rotations[geom, 3 * k + 2]
            center = positions[geom, k] + (r0 * box[0] + r1 * box[1] + r2 * box[2])
            half = abs(r0) * box[3] + abs(r1) * box[4] + abs(r2) * box[5]
            low[i, k] = min(low[i, k], center - half)
            high[i, k] = max(high[i, k], center + half)
    return low, high


@kernel
def in_field(ray: NDArray[np.float64], gaze: Gaze) -> bool:
    """Whether a vector (3,) from the eye, m, ends inside the viewing frustum."""
    if ray[0] ** 2 + ray[1] ** 2 + ray[2] ** 2 > gaze.range**2:
        return False
    forward = ray[0] * gaze.axes[0, 0] + ray[1] * gaze.axes[0, 1] + ray[2] * gaze.axes[0, 2]
    left = ray[0] * gaze.axes[1, 0] + ray[1] * gaze.axes[1, 1] + ray[2] * gaze.axes[1, 2]
    up = ray[0] * gaze.axes[2, 0] + ray[1] * gaze.axes[2, 1] + ray[2] * gaze.axes[2, 2]
    return bool(abs(left) <= forward * gaze.slopes[0] and abs(up) <= forward * gaze.slopes[1])


@kernel
def is_blocked(
    ray: NDArray[np.float64],
    low: NDArray[np.float64],
    high: NDArray[np.float64],
    eye: NDArray[np.float64],
    sight: SightGeometry,
) -> bool:
    """Whether a ray (3,) from the eye enters a wall before the box from `low` to `high`, each (3,), m.

    Walls are taken as a little smaller than they are, and the box as a little larger.
    """
    reach = 0.0  # share of the ray at which it enters the object's box
    for k in range(3):
        if ray[k] > MARGIN:
            reach = max(reach, (low[k] - MARGIN - eye[k]) / ray[k])
        elif ray[k] < -MARGIN:
            reach = max(reach, (high[k] + MARGIN - eye[k]) / ray[k])
    for w in range(len(sight.wall_centers)):
        enter, leave = -np.inf, reach
        for k in range(3):
            along = start = 0.0
            for j in range(3):
                along += ray[j] * sight.wall_axes[w, j, k]
                start += (eye[j] - sight.wall_centers[w, j]) * sight.wall_axes[w, j, k]
            half = sight.wall_half_sizes[w, k] - MARGIN
            if abs(along) > MARGIN:
                near, far = (-half - start) / along, (half - start) / along
                enter, leave = max(enter, min(near, far)), min(leave, max(near, far))
            elif abs(start) > half:
                leave = -np.inf
            if enter >= leave:
                break
        if 0.0 < enter < leave:
            return True
    return False
