"""The walkable floor of a compiled house, and grids that assign rooms and clearances to its cells."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.compiled.house import NavigableFloor
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.house.compiled.standing import StandingPlaces
from mjsim.house.validation.checked_model import Compiled
from mjsim.values.person_parameters import PersonParameters

BODY_BAND = (0.05, 1.8)  # range of heights in which geoms obstruct a person, in metres
BORDER = 1.0  # margin of the grids around the rooms, in metres
_CELLS = 1e6  # approximate maximum number of cells in a grid
_FINEST = 0.025  # minimum cell size in metres


@dataclass(frozen=True, eq=False)
class WalkableFloor:
    """The walkable floor of a compiled house, with grids for validation rules."""

    compiled: Compiled
    rooms: RoomMap
    receptacles: dict[str, ReceptacleGeometry]
    rooms_of: dict[str, str]  # receptacle key -> key of its room in the catalogue
    navigable: NavigableFloor

    @cached_property
    def standing(self) -> StandingPlaces:
        """The places where the default person can stand."""
        model, data = self.compiled.model, self.compiled.data
        return StandingPlaces(model, data, self.rooms, self.navigable, PersonParameters())

    @cached_property
    def walkable(self) -> tuple[NDArray[np.float64], float]:
        """The grid points (k, 2) of the largest walkable region, in metres, and the area per point in m^2."""
        xmin, ymin, xmax, ymax = self.rooms.bounds
        islands = self.navigable.topdown_map
        size = np.array([(xmax - xmin) / islands.shape[1], (ymax - ymin) / islands.shape[0]])
        cells = np.argwhere(islands == 0)[:, ::-1]
        return np.array([xmin, ymin]) + (cells + 0.5) * size, float(np.prod(size))

    @cached_property
    def clearance(self) -> ClearanceField:
        """A grid of the distances to the nearest wall or piece of furniture."""
        xmin, ymin, xmax, ymax = self.rooms.bounds
        area = (xmax - xmin + 2 * BORDER) * (ymax - ymin + 2 * BORDER)
        low, high = BODY_BAND
        return ClearanceField.from_model(
            self.compiled.model,
            low=low,
            high=high,
            resolution=max(_FINEST, math.sqrt(area / _CELLS)),
            border=BORDER,
        )

    @cached_property
    def centres(self) -> NDArray[np.float64]:
        """The centres of the cells of the `clearance` grid, in metres, shape (nx, ny, 2)."""
        field = self.clearance
        nx, ny = field.distance.shape
        x, y = (o + field.resolution * np.arange(n) for o, n in ((field.origin_x, nx), (field.origin_y, ny)))
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    @cached_property
    def rectangle_of(self) -> NDArray[np.intp]:
        """The index of the room rectangle that contains each cell's centre, or -1 outside, shape (nx, ny)."""
        field = self.clearance
        found = np.full(field.distance.shape, -1)
        for k, (centre, half, axes) in enumerate(zip(*self.rooms.rectangles, strict=True)):
            reach = np.abs(axes) @ half
            low, high = (self.cell_of(centre + sign * reach) for sign in (-1, 1))
            window = np.s_[low[0] : high[0] + 1, low[1] : high[1] + 1]
            local = np.abs((self.centres[window] - centre) @ axes)
            found[window][(local <= half).all(axis=-1)] = k
        return found

    def cell_of(self, points: NDArray[np.float64]) -> NDArray[np.intp]:
        """Return the indices (..., 2) of the cells that are nearest to points (..., 2) in metres."""
        field = self.clearance
        cells = np.rint((points - [field.origin_x, field.origin_y]) / field.resolution).astype(np.intp)
        return np.clip(cells, 0, np.array(field.distance.shape) - 1)

    def rectangles_of(self, key: str) -> NDArray[np.intp]:
        """Return the indices (k,) of all rectangles of a room."""
        return np.flatnonzero(np.array(self.rooms.keys) == key)
