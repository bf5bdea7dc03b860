"""Compute a grid of the floor of a scene, with its obstacles, walls and walkable cells."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, find_objects, label

from mjsim.formats.scene.source_scene import MAX_SIDE, unit_of
from mjsim.formats.scene.surface import Floats
from mjsim.importing.house.solids import Solid
from mjsim.values.errors import AssetError

CELL = 0.05  # side length of a grid cell, in metres
BODY = 0.27  # radius of a person's body including a safety margin, in metres
_MAX_AREA = 1500.0
_BAND = (0.05, 1.8)  # range of heights in which solids obstruct a person, in metres
# Ranges of heights, in metres. A wall must be solid in all of them.
_WALL = ((0.1, 0.5), (0.6, 0.9), (1.0, 1.25), (1.7, 1.9))
_GAP = 0.6  # half the maximum width of openings that count as closed, in metres
_PAD = 2 * _GAP + 0.3  # margin of the grid around the scene, in metres
_DRAWN = 10.0  # additional weight of cells in which the imported scene has a visible floor
_LEAST_SHARE = 0.15  # minimum share of the floor that outer walls must enclose
_MIN_AREA = 3.0  # minimum area enclosed by the walls of a house, in square metres
# Floor around the obstacles that belongs to a house without walls, in metres. Ground planes extend farther.
_AROUND = 2.5

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class FloorGrid:
    """Masks of the cells of a floor. All masks have the shape (nx, ny), and the first axis is x."""

    origin: Floats  # lower corner of cell (0, 0) in metres, shape (2,)
    blocked: Mask  # cells with obstacles
    walls: Mask  # cells with walls, including open doors
    doors: Mask
    indoors: Mask  # cells inside the outer walls, including the walls
    floor: Mask  # cells in which the source draws a floor
    enclosed: bool  # False if no outer walls enclose the floor, so that `indoors` is a rectangle

    @cached_property
    def free(self) -> Mask:
        return self.indoors & ~self.blocked

    @cached_property
    def clearance(self) -> Floats:
        """The distance from each cell to the nearest obstacle, in metres."""
        return clearance(self.free)

    @cached_property
    def walkable(self) -> Mask:
        """The largest connected floor on which a person can stand. Cells with a drawn floor weigh more."""
        parts, count = label(self.clearance > BODY)
        if not count:
            return np.zeros_like(self.free)
        sizes = np.bincount(parts.ravel(), 1.0 + _DRAWN * self.floor.ravel())
        return np.asarray(parts == sizes[1:].argmax() + 1)

    @property
    def area(self) -> float:
        """The area of the walkable floor, in square metres."""
        return float(self.walkable.sum()) * CELL**2

    @property
    def outside_share(self) -> float:
        """The share of the walkable floor from which fewer than three of four directions lead to a wall."""
        ahead = [np.logical_or.accumulate(self.walls, axis) for axis in (0, 1)]
        back = [np.flip(np.logical_or.accumulate(np.flip(self.walls, axis), axis), axis) for axis in (0, 1)]
        return float((np.sum([*ahead, *back], axis=0) < 3)[self.walkable].mean())

    def cell(self, point: Sequence[float] | Floats) -> tuple[int, int]:
        """Return the cell at a point (x, y) in metres, or the nearest cell for a point outside the grid."""
        found = np.floor((np.asarray(point)[:2] - self.origin) / CELL).astype(int)
        x, y = np.clip(found, 0, np.array(self.free.shape) - 1).tolist()
        return x, y

    def on(self, mask: Mask, points: Floats) -> Mask:
        """Return a mask (k,) of the points (k, 2), in metres, whose cells are in `mask`."""
        cells = np.clip(np.floor((points - self.origin) / CELL).astype(int), 0, np.array(mask.shape) - 1)
        return np.asarray(mask[cells[:, 0], cells[:, 1]])


def make_floor_grid(solids: Sequence[Solid], doors: Sequence[Solid], floor: Floats) -> FloorGrid:
    """Compute the floor grid of a house.

    Args:
        solids: All solids of the scene except open doors.
        doors: Open doors.
        floor: Triangles at floor height in metres, shape (n, 3, 2).

    Raises:
        AssetError: The scene has neither walls nor a floor, is too large, or leaves no room for a person.
    """
    corners = [np.array([s.low[:2], s.high[:2]]) for s in (*solids, *doors)]
    ground = floor.reshape(-1, 2)
    if len(ground) and (not corners or np.ptp(ground, axis=0).max() < MAX_SIDE):
        corners.append(ground)
    if not corners:
        raise AssetError("has neither walls nor a floor; is it a house?")
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    if (high - low).max() > MAX_SIDE:
        raise too_large(high - low)
    origin = low - _PAD
    shape = tuple(np.ceil((high - low + 2 * _PAD) / CELL).astype(int).tolist())
    blocked, shut = (_at_heights(shape, origin, chosen, _BAND) for chosen in (solids, doors))
    levels = [_at_heights(shape, origin, solids, band) for band in _WALL]
    drawn = _raster(shape, origin, floor)
    for count in (len(_WALL), len(_WALL) - 1):  # try walls up to eye level, then lower walls
        walls = np.logical_and.reduce(levels[:count]) | shut
        # Openings above a sill are treated as closed, so that a window is not taken for a door.
        indoors = _enclosed(walls | levels[0])
        grid = FloorGrid(origin, blocked, walls, shut & ~blocked, indoors, drawn, enclosed=True)
        standing = _box(shape, origin, solids, 0.0 if (walls & ~shut).any() else _AROUND)
        whole = replace(grid, indoors=_rectangle(drawn) & standing, enclosed=False)
        if grid.area >= max(_MIN_AREA, _LEAST_SHARE * whole.area):
            break
    else:
        grid = whole
    if not grid.walls.any():  # No wall is high enough, so use all solids at knee height instead.
        grid = replace(grid, walls=levels[0] | shut)
    if grid.area > _MAX_AREA:
        raise AssetError(
            f"has {grid.area:.0f} m2 that can be walked on, houses at most {_MAX_AREA:.0f} m2; give a part"
        )
    if grid.area < 1.0:
        raise AssetError(
            f"leaves nowhere to walk on {_metres(high - low)}: its walls enclose no floor, or what stands there fills "
            "it; is the size right (--units, --scale), and which way is up (--up)?"
        )
    return grid


def too_large(sides: Floats) -> AssetError:
    """Create an error about a scene whose sides (2,), in metres, are too long. It suggests a better unit."""
    unit = unit_of(float(sides.max()))
    advice = "give its unit by --units, or --scale" if unit is None else f"try --units {unit}"
    return AssetError(f"spans {_metres(sides)}, and houses have at most {MAX_SIDE:g} m; {advice}")


def _metres(sides: Floats) -> str:
    return " x ".join(f"{side:.3g}" for side in sides) + " m"


def clearance(free: Mask) -> Floats:
    """Return the distance from each cell to the nearest occupied cell or to the border, in metres."""
    padded = np.pad(free, 1)
    return np.asarray(distance_transform_edt(padded)[1:-1, 1:-1] * CELL)


def _enclosed(walls: Mask) -> Mask:
    """Return the cells enclosed by walls, and the walls. Openings up to twice `_GAP` count as closed."""
    distance = distance_transform_edt(~walls) * CELL if walls.any() else np.full(walls.shape, np.inf)
    parts, _ = label(distance > _GAP)
    border = np.unique(np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]]))
    far = np.isin(parts, border[border > 0])
    if not far.any():
        return np.ones_like(walls)
    outside = (distance_transform_edt(~far) * CELL <= _GAP) & ~walls
    return np.asarray(~outside)


def _rectangle(floor: Mask) -> Mask:
    """Return the cells in the bounding box of a floor, or of the whole scene if no floor is drawn."""
    edge = round(_PAD / CELL)
    inside = np.zeros_like(floor)
    inside[find_objects(floor.astype(np.uint8))[0] if floor.any() else np.s_[edge:-edge, edge:-edge]] = True
    return inside


def _box(shape: tuple[int, ...], origin: Floats, solids: Sequence[Solid], margin: float) -> Mask:
    """Return the cells in the bounding box of all solids, which is extended by a margin in metres."""
    points = np.concatenate([solid.outline for solid in solids] or [np.zeros((1, 2))])
    low, high = points.min(axis=0) - margin, points.max(axis=0) + margin
    return _raster(shape, origin, [np.array([low, [high[0], low[1]], high, [low[0], high[1]]])])


def _at_heights(
    shape: tuple[int, ...], origin: Floats, solids: Sequence[Solid], band: tuple[float, float]
) -> Mask:
    low, high = band
    return _raster(shape, origin, [s.outline for s in solids if s.low[2] < high and s.high[2] > low])


def _raster(shape: tuple[int, ...], origin: Floats, outlines: Iterable[Floats]) -> Mask:
    image = np.zeros(shape, np.uint8)
    for points in outlines:
        hull = cv2.convexHull(((points - origin) / CELL - 0.5).astype(np.float32))[:, 0]
        cv2.fillConvexPoly(image, np.rint(hull[:, ::-1] * 16).astype(np.int32), 1, shift=4)
    return image > 0
