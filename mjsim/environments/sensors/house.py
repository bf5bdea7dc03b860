"""The sensor for the floor map."""

import cv2
import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.sensors.base import ObservationLayout, Sensor

MAP_SIZE = 64
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


MAP = Sensor(
    "map",
    lambda _: specs.BoundedArray((MAP_SIZE, MAP_SIZE), np.uint8, 0, 1),
    lambda inputs: inputs.world.scene.cached("map", lambda: occupancy(inputs.layout)).copy(),
)
