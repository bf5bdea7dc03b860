"""Kernels that compute the vectors of an observation.

One kernel computes all vectors, because calling a kernel takes longer than the computation of a vector.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Vector = NDArray[np.float32]

RAYS = 24
RANGE = 3.0  # maximum range of the rangefinder, in metres
STATUSES = LOOSE, CARRIED, DELIVERED = 0, 1, 2  # indices of `ObjectStatus`

# Indices into `EpisodeConstants.offsets`.
(
    GPS, COMPASS, POSE, MOTION, INVENTORY, RANGEFINDER, RECEPTACLES, _MASK,
    POSITIONS, ROTATIONS, STATUS, _CATEGORIES, GOALS, REMAINING, TIME_LEFT,
) = range(15)  # fmt: skip


def vector_shapes(slots: int, categories: int, receptacles: int) -> dict[str, tuple[int, ...]]:
    """Return the shapes of all vectors by the names of their sensors, in the order in which they are stored."""
    return {
        "gps": (2,),
        "compass": (2,),
        "pose": (4,),
        "motion": (4,),
        "inventory": (2, slots),
        "rangefinder": (RAYS,),
        "receptacles": (receptacles, 2),
        "object_mask": (slots,),
        "object_positions": (slots, 3),
        "object_rotations": (slots, 4),
        "object_status": (slots, len(STATUSES)),
        "object_categories": (slots, categories),
        "goals": (slots, 2),
        "remaining": (1,),
        "time_left": (1,),
    }


class ObstacleEdges(NamedTuple):
    """The outlines of the obstacles on a floor, in metres."""

    edges: (
        Floats  # counter-clockwise edges of all obstacles: start x, start y, vector x, vector y, shape (e, 4)
    )
    first: Ints  # first row of each obstacle in `edges`, shape (p + 1,)
    circles: Floats  # a circle around each obstacle: centre x and y, radius, shape (p, 3)


class EpisodeConstants(NamedTuple):
    """The values that stay the same during an episode. Lengths are in metres and angles in radians."""

    offsets: Ints  # index of each vector's first value in the array of all vectors, shape (15,)
    start: Floats  # position and heading of the person at the start, shape (3,)
    bounds: Floats  # extent of the rooms: xmin, ymin, xmax, ymax
    receptacles: Floats  # centres of the receptacles, shape (r, 2)
    bins: Floats  # centre of each object's receptacle, shape (n, 2)
    obstacles: ObstacleEdges
    scale: float  # length by which offsets are divided
    max_speed: float
    time_limit: float


class ObservedState(NamedTuple):
    """The state of the person and the objects. See `Observation` for the units."""

    time: float
    position: Floats
    heading: float
    pitch: float
    velocity: Floats
    hands: tuple[int, int]  # index of the object in the left and the right hand, or -1
    busy: bool
    object_positions: Floats
    object_quaternions: Floats
    object_status: Ints  # index of each object's status in `ObjectStatus`, shape (n,)

    @classmethod
    def example(cls) -> "ObservedState":
        """Return a snapshot with strided arrays. Code that is compiled for it also accepts contiguous arrays."""
        pair, rows, statuses = np.zeros(4)[::2], np.zeros((1, 8))[:, ::2], np.zeros(2, np.int64)[::2]
        return cls(0.0, pair, 0.0, 0.0, pair, (-1, -1), False, rows, rows, statuses)


@kernel
def compute_vectors(now: ObservedState, episode: EpisodeConstants, values: Vector) -> None:
    """Store the vectors of an observation in `values`, which contains zeros and the constant vectors."""
    _observe_person(now, episode, values)
    _observe_objects(now, episode, values)
    x, y = now.position[0], now.position[1]
    _find_ranges(x, y, now.heading, episode.obstacles, values[episode.offsets[RANGEFINDER] :])
    for i, center in enumerate(episode.receptacles):
        out = values[episode.offsets[RECEPTACLES] + 2 * i :]
        _rotate(center[0] - x, center[1] - y, now.heading, episode.scale, out)
    values[episode.offsets[TIME_LEFT]] = max(0.0, 1.0 - now.time / episode.time_limit)


@kernel
def _observe_person(now: ObservedState, episode: EpisodeConstants, values: Vector) -> None:
    offsets, start, bounds = episode.offsets, episode.start, episode.bounds
    gps, compass, pose, motion = offsets[GPS], offsets[COMPASS], offsets[POSE], offsets[MOTION]
    x, y = now.position[0] - start[0], now.position[1] - start[1]
    _rotate(x, y, start[2], episode.scale, values[gps:])
    values[compass], values[compass + 1] = math.cos(now.heading - start[2]), math.sin(now.heading - start[2])
    for k in range(2):
        middle, half = (bounds[k] + bounds[k + 2]) / 2, (bounds[k + 2] - bounds[k]) / 2
        values[pose + k] = _clip((now.position[k] - middle) / half)
    values[pose + 2], values[pose + 3] = math.cos(now.heading), math.sin(now.heading)
    _rotate(now.velocity[0], now.velocity[1], now.heading, episode.max_speed, values[motion:])
    values[motion + 2] = _clip(now.pitch / (math.pi / 2))
    values[motion + 3] = now.busy
    for hand in range(2):
        if now.hands[hand] >= 0:
            slots = (offsets[INVENTORY + 1] - offsets[INVENTORY]) // 2
            values[offsets[INVENTORY] + hand * slots + now.hands[hand]] = 1.0


@kernel
def _observe_objects(now: ObservedState, episode: EpisodeConstants, values: Vector) -> None:
    offsets, undelivered = episode.offsets, 0
    for i, status in enumerate(now.object_status):
        position, q = now.object_positions[i], now.object_quaternions[i]
        out = values[offsets[POSITIONS] + 3 * i :]
        x, y = position[0] - now.position[0], position[1] - now.position[1]
        _rotate(x, y, now.heading, episode.scale, out)
        out[2] = _clip(position[2] / episode.scale)
        # A quaternion and its negative describe the same rotation, so the one with w >= 0 is used.
        norm = math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2 + q[3] ** 2) * (-1.0 if q[0] < 0 else 1.0)
        for k in range(4):
            values[offsets[ROTATIONS] + 4 * i + k] = _clip(q[k] / norm)
        values[offsets[STATUS] + len(STATUSES) * i + status] = 1.0
        if status == DELIVERED:
            continue
        undelivered += 1
        if status == CARRIED:
            x, y = episode.bins[i, 0] - now.position[0], episode.bins[i, 1] - now.position[1]
        _rotate(x, y, now.heading, episode.scale, values[offsets[GOALS] + 2 * i :])
    values[offsets[REMAINING]] = undelivered / len(now.object_status)


@kernel
def _find_ranges(x: float, y: float, heading: float, obstacles: ObstacleEdges, out: Vector) -> None:
    """Store obstacle distances along rays from (x, y), counter-clockwise from `heading`, as shares of `RANGE`."""
    forward_x, forward_y, distances = np.empty(RAYS), np.empty(RAYS), np.full(RAYS, RANGE)
    for r in range(RAYS):
        angle = heading + 2 * math.pi * r / RAYS
        forward_x[r], forward_y[r] = math.cos(angle), math.sin(angle)
    for p, circle in enumerate(obstacles.circles):
        center_x, center_y, radius = circle[0] - x, circle[1] - y, circle[2]
        if center_x**2 + center_y**2 > (RANGE + radius) ** 2:
            continue
        for r in range(RAYS):
            if abs(forward_x[r] * center_y - forward_y[r] * center_x) > radius:
                continue
            if not -radius < forward_x[r] * center_x + forward_y[r] * center_y < distances[r] + radius:
                continue
            for e in range(obstacles.first[p], obstacles.first[p + 1]):
                start_x, start_y = obstacles.edges[e, 0] - x, obstacles.edges[e, 1] - y
                edge_x, edge_y = obstacles.edges[e, 2], obstacles.edges[e, 3]
                facing = edge_x * start_y - edge_y * start_x
                across = forward_y[r] * edge_x - forward_x[r] * edge_y
                along = start_y * forward_x[r] - start_x * forward_y[r]  # from 0 to `across` on the edge
                if facing > 0 and 0 <= along <= across and facing < distances[r] * across:
                    distances[r] = facing / across
    for r in range(RAYS):
        out[r] = distances[r] / RANGE


@kernel
def _rotate(x: float, y: float, heading: float, unit: float, out: Vector) -> None:
    """Store the forward and left components of a vector in the frame of `heading`, divided by `unit`."""
    c, s = math.cos(heading), math.sin(heading)
    out[0], out[1] = _clip((x * c + y * s) / unit), _clip((y * c - x * s) / unit)


@kernel
def _clip(value: float) -> float:
    return min(max(value, -1.0), 1.0)
