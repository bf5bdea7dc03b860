"""The floor of a scene on a grid: what is blocked, what is indoors, where one can walk, and which rooms there are."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt, label

from mjsim.formats.scene.source_scene import MAX_SIDE, unit_of
from mjsim.formats.scene.surface import Floats
from mjsim.importing.house.solids import Solid
from mjsim.values.errors import AssetError

CELL = 0.05  # m
BODY = 0.27  # m, radius of a person with a little air
_MAX_AREA = 1500.0  # m^2 that can be walked on
_BAND = (0.05, 1.8)  # m, heights at which a person bumps into things
_WALL = ((0.1, 0.5), (0.6, 0.9), (1.0, 1.25), (1.7, 1.9))  # m; what is at all these heights is a wall
_GAP = 0.6  # m, half of the widest opening of the outer wall that is closed
_PAD = 2 * _GAP + 0.3  # m around all things
_DRAWN = 10.0  # times that a drawn floor counts
_LEAST_SHARE = 0.15  # of the whole floor; less is a closet of a house that is open elsewhere
_MIN_AREA = 3.0  # m^2 that walls must enclose to be those of a house

Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Plan:
    """Grids of the floor; the first axis is x. All masks have the shape (nx, ny)."""

    origin: Floats  # lower corner of cell (0, 0), m, (2,)
    blocked: Mask  # where something stands
    walls: Mask  # where it is a wall; doors that are open count
    doors: Mask  # where doors were that are open now
    indoors: Mask  # what the outer walls enclose, walls included
    floor: Mask  # where the source draws a floor
    enclosed: bool  # whether there are such walls; else it is a rectangle

    @cached_property
    def free(self) -> Mask:
        """Floor with nothing on it."""
        return self.indoors & ~self.blocked

    @cached_property
    def clearance(self) -> Floats:
        """Distance from each cell to what stands there, m."""
        return clearance(self.free)

    @cached_property
    def walkable(self) -> Mask:
        """Where a person's middle can be: the largest connected part, those with a drawn floor before others."""
        parts, count = label(self.clearance > BODY)
        if not count:
            return np.zeros_like(self.free)
        sizes = np.bincount(parts.ravel(), 1.0 + _DRAWN * self.floor.ravel())
        return np.asarray(parts == sizes[1:].argmax() + 1)

    @property
    def area(self) -> float:
        """Of the walkable floor, m^2."""
        return float(self.walkable.sum()) * CELL**2

    def cell(self, point: Sequence[float] | Floats) -> tuple[int, int]:
        """Cell that holds a point (x, y), m; the nearest one off the grid."""
        found = np.floor((np.asarray(point)[:2] - self.origin) / CELL).astype(int)
        x, y = np.clip(found, 0, np.array(self.free.shape) - 1).tolist()
        return x, y

    def on(self, mask: Mask, points: Floats) -> Mask:
        """Whether points (k, 2), m, lie on cells of a mask, shape (k,)."""
        cells = np.clip(np.floor((points - self.origin) / CELL).astype(int), 0, np.array(mask.shape) - 1)
        return np.asarray(mask[cells[:, 0], cells[:, 1]])


def make_plan(solids: Sequence[Solid], doors: Sequence[Solid], floor: Floats) -> Plan:
    """The plan of a house.

    Args:
        solids: All that collides.
        doors: Doors that stand open, not among the solids.
        floor: Triangles at floor height, m, (n, 3, 2).

    Raises:
        AssetError: There is neither a wall nor a floor, the scene is too large, or nobody can stand in it.
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
    standing = _box(shape, origin, solids)  # a ground plane reaches far beyond the house
    for count in (len(_WALL), len(_WALL) - 1):  # walls as high as eyes, else lower ones
        walls = np.logical_and.reduce(levels[:count]) | shut
        # Windows have sills: what is low closes the outside off, too.
        indoors = _enclosed(walls | levels[0])
        plan = Plan(origin, blocked, walls, shut & ~blocked, indoors, drawn, enclosed=True)
        whole = replace(plan, indoors=_rectangle(drawn), enclosed=False)
        near = replace(whole, indoors=whole.indoors & standing)
        if plan.area >= max(_MIN_AREA, _LEAST_SHARE * near.area):
            break
    else:
        plan = whole
    if not plan.walls.any():  # none is as high as eyes: those that one bumps into
        plan = replace(plan, walls=levels[0] | shut)
    if plan.area > _MAX_AREA:
        raise AssetError(
            f"has {plan.area:.0f} m2 that can be walked on, houses at most {_MAX_AREA:.0f} m2; give a part"
        )
    if plan.area < 1.0:
        raise AssetError(
            f"leaves nowhere to walk on {_metres(high - low)}: its walls enclose no floor, or what stands there fills "
            "it; is the size right (--units, --scale), and which way is up (--up)?"
        )
    return plan


def too_large(sides: Floats) -> AssetError:
    """The error about a scene with such sides (2,), m, with the unit in which it would be a house."""
    unit = unit_of(float(sides.max()))
    advice = "give its unit by --units, or --scale" if unit is None else f"try --units {unit}"
    return AssetError(f"spans {_metres(sides)}, and houses have at most {MAX_SIDE:g} m; {advice}")


def _metres(sides: Floats) -> str:
    return " x ".join(f"{side:.3g}" for side in sides) + " m"


def clearance(free: Mask) -> Floats:
    """Distance from each cell to the nearest one that is not free, or to the border, m."""
    padded = np.pad(free, 1)
    return np.asarray(distance_transform_edt(padded)[1:-1, 1:-1] * CELL)


def _enclosed(walls: Mask) -> Mask:
    """What walls enclose, walls included, once openings up to twice `_GAP` are closed."""
    distance = distance_transform_edt(~walls) * CELL if walls.any() else np.full(walls.shape, np.inf)
    parts, _ = label(distance > _GAP)
    border = np.unique(np.concatenate([parts[0], parts[-1], parts[:, 0], parts[:, -1]]))
    far = np.isin(parts, border[border > 0])
    if not far.any():
        return np.ones_like(walls)
    outside = (distance_transform_edt(~far) * CELL <= _GAP) & ~walls
    return np.asarray(~outside)


def _rectangle(floor: Mask) -> Mask:
    """The rectangle of a floor, or of all that stands there."""
    edge = round(_PAD / CELL)
    inside = np.zeros_like(floor)
    x, y = np.nonzero(floor)
    if len(x):
        inside[x.min() : x.max() + 1, y.min() : y.max() + 1] = True
    else:
        inside[edge:-edge, edge:-edge] = True
    return inside


def _box(shape: tuple[int, ...], origin: Floats, solids: Sequence[Solid]) -> Mask:
    """The rectangle around all that stands."""
    points = np.concatenate([solid.outline for solid in solids] or [np.zeros((1, 2))])
    (xmin, ymin), (xmax, ymax) = points.min(axis=0), points.max(axis=0)
    return _raster(shape, origin, [np.array([[xmin, ymin], [xmax, ymin], [xmax, ymax], [xmin, ymax]])])


def _at_heights(
    shape: tuple[int, ...], origin: Floats, solids: Sequence[Solid], band: tuple[float, float]
) -> Mask:
    """Cells with something between two heights, m."""
    low, high = band
    return _raster(shape, origin, [s.outline for s in solids if s.low[2] < high and s.high[2] > low])


def _raster(shape: tuple[int, ...], origin: Floats, outlines: Iterable[Floats]) -> Mask:
    image = np.zeros(shape, np.uint8)
    for points in outlines:
        hull = cv2.convexHull(((points - origin) / CELL - 0.5).astype(np.float32))[:, 0]
        cv2.fillConvexPoly(image, np.rint(hull[:, ::-1] * 16).astype(np.int32), 1, shift=4)
    return image > 0
