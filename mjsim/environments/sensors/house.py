"""Sensors for the floor map, the distances to obstacles and the positions of receptacles."""

import math

import cv2
import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.sensors.base import ObservationLayout, Sensor, SensorInput, unit_spec

MAP_SIZE = 64
RAYS = 24
RANGE = 3.0  # maximum range of the rangefinder, in metres
_SUBPIXEL = 8  # number of fractional bits in polygon coordinates passed to OpenCV


def occupancy(layout: ObservationLayout) -> NDArray[np.uint8]:
    """Return a square grid with 1 in all cells with an obstacle. Rows are ordered by y and columns by x."""
    raster = np.zeros((MAP_SIZE, MAP_SIZE), np.uint8)
    x_min, y_min, x_max, y_max = layout.floor.bounds
    cells = np.array([MAP_SIZE / (x_max - x_min), MAP_SIZE / (y_max - y_min)])
    for outline in layout.floor.obstacles:
        # In OpenCV, the centre of the first pixel has the coordinates (0, 0).
        corners = (outline - (x_min, y_min)) * cells - 0.5
        cv2.fillConvexPoly(raster, np.round(corners * 2**_SUBPIXEL).astype(np.int32), 1, shift=_SUBPIXEL)
    return raster


def ray_distances(
    layout: ObservationLayout, position: NDArray[np.float64], heading: float
) -> NDArray[np.float64]:
    """Return obstacle distances along rays, at most `RANGE` metres, counter-clockwise from `heading`."""
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
    layout: ObservationLayout, position: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the start points and vectors of all obstacle edges that face `position` and are in range."""
    start, edge = layout.edges
    offset = start - position
    facing = edge[:, 0] * offset[:, 1] - edge[:, 1] * offset[:, 0] > 0
    nearest = np.minimum(np.abs(offset), np.abs(offset + edge))
    beside = np.sign(offset) == np.sign(offset + edge)
    chosen = facing & ~(beside & (nearest > RANGE)).any(axis=1)
    return start[chosen], edge[chosen]


def _rangefinder(inputs: SensorInput) -> NDArray[np.float32]:
    state = inputs.state
    return (ray_distances(inputs.layout, state.position, state.heading) / RANGE).astype(np.float32)


def _receptacles(inputs: SensorInput) -> NDArray[np.float32]:
    known = inputs.world.scene.receptacles
    centres = np.array([known[key].center[:2] for key in inputs.layout.receptacles])
    return inputs.layout.scaled(inputs.to_body(centres))


MAP = Sensor(
    "map",
    lambda _: specs.BoundedArray((MAP_SIZE, MAP_SIZE), np.uint8, 0, 1),
    lambda inputs: occupancy(inputs.layout),
)
RANGEFINDER = Sensor("rangefinder", lambda _: unit_spec(RAYS, low=0.0), _rangefinder)
RECEPTACLES = Sensor("receptacles", lambda layout: unit_spec(len(layout.receptacles), 2), _receptacles)
