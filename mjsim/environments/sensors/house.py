"""The house as the augmented-reality system knows it: map, free way around the person, receptacles."""

import math

import cv2
import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.layout import Layout
from mjsim.environments.sensors.base import Moment, Sensor, unit_spec

MAP_SIZE = 64
RAYS = 24
RANGE = 3.0  # m
_SUBPIXEL = 8  # fractional bits of OpenCV's polygon vertices


def occupancy(layout: Layout, size: int = MAP_SIZE) -> NDArray[np.uint8]:
    """Raster of the floor's obstacles.

    Args:
        layout: With the floor.
        size: Rows and columns.

    Returns:
        1 where an obstacle covers the middle of a cell or touches it, else 0; shape (size, size). Row 0 lies at the
        floor's least y, column 0 at its least x; cells are stretched so that the bounds fill the raster.
    """
    raster = np.zeros((size, size), np.uint8)
    x_min, y_min, x_max, y_max = layout.floor.bounds
    cells = np.array([size / (x_max - x_min), size / (y_max - y_min)])
    for outline in layout.floor.obstacles:
        # OpenCV puts the middle of the first pixel at 0.
        corners = (outline - (x_min, y_min)) * cells - 0.5
        cv2.fillConvexPoly(raster, np.round(corners * 2**_SUBPIXEL).astype(np.int32), 1, shift=_SUBPIXEL)
    return raster


def free_way(layout: Layout, position: NDArray[np.float64], heading: float) -> NDArray[np.float64]:
    """How far it is to the next obstacle in each of `RAYS` directions.

    Args:
        layout: With the floor.
        position: Floor point (2,), m.
        heading: rad; ray k points k / RAYS of a turn to the left of it.

    Returns:
        m, shape (RAYS,), at most `RANGE`.
    """
    start, edge = _edges_in_front(layout, position)
    angles = heading + 2 * math.pi * np.arange(RAYS) / RAYS
    ray = np.column_stack([np.cos(angles), np.sin(angles)])
    offset = start - position
    across = ray[:, :1] * edge[:, 1] - ray[:, 1:] * edge[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        along = (offset[:, 0] * edge[:, 1] - offset[:, 1] * edge[:, 0]) / across
        share = (offset[:, 0] * ray[:, 1:] - offset[:, 1] * ray[:, :1]) / across
    met = (across != 0) & (along >= 0) & (share >= 0) & (share <= 1)
    return np.asarray(np.where(met, along, RANGE).min(axis=1, initial=RANGE))


def _edges_in_front(
    layout: Layout, position: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Edges that a ray from `position` may meet first: near, and facing it, as outlines run counter-clockwise."""
    start, edge = layout.edges
    offset = start - position
    facing = edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0] > 0
    nearest = np.minimum(np.abs(offset), np.abs(offset + edge))
    beside = np.sign(offset) == np.sign(offset + edge)
    chosen = facing & ~(beside & (nearest > RANGE)).any(axis=1)
    return start[chosen], edge[chosen]


def _rangefinder(moment: Moment) -> NDArray[np.float32]:
    seen = moment.observation
    return (free_way(moment.layout, seen.position, seen.heading) / RANGE).astype(np.float32)


def _receptacles(moment: Moment) -> NDArray[np.float32]:
    known = moment.world.scene.receptacles
    centres = np.array([known[key].center[:2] for key in moment.layout.receptacles])
    return moment.layout.scaled(moment.to_body(centres))


MAP = Sensor(
    "map",
    lambda _: specs.BoundedArray((MAP_SIZE, MAP_SIZE), np.uint8, 0, 1),
    lambda moment: occupancy(moment.layout),
)
RANGEFINDER = Sensor("rangefinder", lambda _: unit_spec(RAYS, low=0.0), _rangefinder)
RECEPTACLES = Sensor("receptacles", lambda layout: unit_spec(len(layout.receptacles), 2), _receptacles)
