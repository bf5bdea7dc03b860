"""Place bins along the walls of an imported house, such that no passage is blocked."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label
from trimesh.transformations import rotation_matrix, translation_matrix

from mjsim.formats.scene.source_scene import Bin, ScenePiece
from mjsim.formats.scene.surface import Floats
from mjsim.house.catalogue.catalogue import Catalogue, Receptacle
from mjsim.house.validation.checked_model import Compiled, compile_model
from mjsim.importing.house.floor_grid import BODY, CELL, FloorGrid, Mask, clearance
from mjsim.importing.house.rooms import Rooms
from mjsim.values.errors import AssetError

AREA = 5.0  # walkable floor area that is required for each bin, in square metres
_STAND = 0.8  # depth of the floor that must be free in front of a bin, in metres
_ASIDE = 0.05  # width of the floor that must be free on each side of a bin, in metres
_WALL = 0.15  # maximum distance between a bin and the wall behind it, in metres
_WIDE = 0.4  # radius of a body that can still reach all of the floor once the bins are placed, in metres
_TRIES = 300  # maximum number of poses that are tried for a bin in each room
_LOST = 1.0  # walkable floor that a bin may block in addition to its surroundings, in square metres
_SLACK = 0.01  # distance by which the triangles of a bin in the source may exceed its model, in metres
# Bins in order of priority, and the types of rooms in which people would look for them.
_HOMES = {
    "dish_bin": ("kitchen", "living_kitchen", "dining_room"),
    "toy_box": ("bedroom", "living_room"),
    "recycling_bin": ("kitchen", "living_kitchen", "hall"),
    "laundry_hamper": ("bathroom", "bedroom"),
    "office_box": ("office", "bedroom", "living_room"),
    "bookshelf": ("living_room", "living_kitchen", "office"),
}
# Possible yaw angles of a bin, each with the direction in which the back of the bin points.
_TURNS = ((0.0, (0, 1)), (math.pi, (0, -1)), (math.pi / 2, (-1, 0)), (-math.pi / 2, (1, 0)))


Span = tuple[int, int]  # indices of the first cell and of the cell after the last one


def place_bins(grid: FloorGrid, rooms: Rooms, catalogue: Catalogue) -> tuple[Bin, ...]:
    """Place as many bins as the floor area allows. Raise an AssetError if no bin fits."""
    rng = np.random.default_rng(0)
    wanted = [key for key in _HOMES if key in catalogue.receptacles]
    wanted = wanted[: max(1, int(grid.area / AREA))]
    bins: list[Bin] = []
    for key in wanted:
        compiled = _compiled(catalogue.receptacles[key])
        base = compiled.extent(compiled.solid)[:, :2]
        found = _placed(grid, rooms, key, base, [b.room for b in bins], rng)
        if found is not None:
            place, grid = found
            bins.append(place)
    if not bins:
        raise AssetError(
            f"has no place for a bin: a wall along x or y, 0.6 m long and 1.9 m high, with {_STAND} m of free floor "
            "before it; remove furniture, or turn the source"
        )
    return tuple(bins)


def without_bins(pieces: Sequence[ScenePiece], bins: Sequence[Bin], catalogue: Catalogue) -> list[ScenePiece]:
    """Remove the triangles of bins from a scene, because the models of the catalogue replace them."""
    found = list(pieces)
    for place in bins:
        compiled = _compiled(catalogue.receptacles[place.key])
        low, high = compiled.extent(np.union1d(compiled.solid, compiled.shown))
        frame = translation_matrix((place.x, place.y, place.z)) @ rotation_matrix(place.yaw, (0, 0, 1))
        to_bin = np.linalg.inv(frame)
        for number, piece in enumerate(found):
            corners = piece.surface.moved(to_bin).corners
            outside = ((corners < low - _SLACK) | (corners > high + _SLACK)).any(axis=(1, 2))
            if not outside.all():
                found[number] = replace(piece, surface=piece.surface.select(outside))
    return [piece for piece in found if len(piece.surface)]


def _compiled(receptacle: Receptacle) -> Compiled:
    compiled = compile_model(f"receptacle {receptacle.key}", receptacle.path)
    if not isinstance(compiled, Compiled):
        raise AssetError(f"{receptacle.path} {compiled[0].message}; {compiled[0].remedy}")
    return compiled


def _placed(
    grid: FloorGrid, rooms: Rooms, key: str, base: Floats, taken: Sequence[str], rng: np.random.Generator
) -> tuple[Bin, FloorGrid] | None:
    """Place a bin, and return it with the updated grid. Return None if the bin does not fit.

    `base` contains the lower and upper corners of the bin's base (2, 2), in metres. Prefer rooms in which people
    would look for the bin, and rooms with few other bins.
    """
    numbers = list(range(1, len(rooms.names) + 1))
    homes = _HOMES[key]

    def rank(number: int) -> tuple[int, int, float]:
        name = rooms.names[number - 1][0]
        kind = name.rstrip("0123456789").rstrip("_")
        home = homes.index(kind) if kind in homes else len(homes)
        area = float((grid.walkable & (rooms.labels == number)).sum())
        return taken.count(name) + (home == len(homes)), home, -area

    for number in sorted(numbers, key=rank):
        for turn in _choices(grid, rooms.labels == number, np.ptp(base, axis=0), rng):
            if (after := _with_bin(grid, rooms, np.ptp(base, axis=0), turn)) is not None:
                x, y, yaw = _origin(grid, base, turn)
                return Bin(key, rooms.names[number - 1][0], x, y, yaw), after
    return None


@dataclass(frozen=True)
class _Choice:
    cells: tuple[slice, slice]
    before: tuple[slice, slice]
    yaw: float
    back: tuple[int, int]  # direction in which the back of the bin points


def _choices(grid: FloorGrid, room: Mask, size: Floats, rng: np.random.Generator) -> list[_Choice]:
    free = grid.free & room
    standing = grid.walkable & room
    # Cells outside the house count as walls, because the outer shell is added later.
    walls = (grid.walls & ~grid.doors) | ~grid.indoors
    ahead = round(_STAND / CELL)
    found: list[_Choice] = []
    for yaw, back in _TURNS:
        sides = np.ceil(np.add(size, (2 * _ASIDE, 0.0)) / CELL).astype(int).tolist()
        spans = [(0, side) for side in (sides[::-1] if back[0] else sides)]
        edge = [_beyond(span, way, -1) for span, way in zip(spans, back, strict=True)]
        before = [_beyond(span, -way, ahead) for span, way in zip(spans, back, strict=True)]
        behind = np.zeros_like(walls)
        for step in range(1, round(_WALL / CELL) + 1):
            shift = (-back[0] * step, -back[1] * step)
            behind |= np.roll(walls, shift, (0, 1))  # cells that have a wall at most `_WALL` behind them
        fits = _all(free, spans) & _all(behind, edge) & _all(free, before) & (_count(standing, before) > 0)
        found += [
            _Choice(_at(spans, place), _at(before, place), yaw, back) for place in np.argwhere(fits).tolist()
        ]
    order = rng.permutation(len(found))[:_TRIES]
    return [found[k] for k in order]


def _beyond(span: Span, way: int, cells: int) -> Span:
    """Return the span itself if `way` is 0, or a number of `cells` after it (1) or before it (-1).

    If `cells` is negative, return the cells at that end of the span.
    """
    if way == 0:
        return span
    end = span[way > 0]
    return min(end, end + way * cells), max(end, end + way * cells)


def _at(spans: Sequence[Span], place: Sequence[int]) -> tuple[slice, slice]:
    x, y = (slice(at + start, at + stop) for at, (start, stop) in zip(place, spans, strict=True))
    return x, y


def _with_bin(grid: FloorGrid, rooms: Rooms, size: Floats, choice: _Choice) -> FloorGrid | None:
    blocked = grid.blocked.copy()
    blocked[choice.cells] = True
    after = replace(grid, blocked=blocked)
    lost = np.prod(size + 2 * _WIDE) + _LOST
    if grid.area - after.area > lost or not after.walkable[choice.before].any():
        return None
    for radius in (BODY, _WIDE):
        if _parts(after, radius) > _parts(grid, radius):
            return None
    numbers = range(1, len(rooms.names) + 1)
    area = [(after.walkable & (rooms.labels == n)).sum() * CELL**2 for n in numbers]
    return after if min(area) > 0.4 else None


def _parts(grid: FloorGrid, radius: float) -> int:
    """Count the connected floor areas above 0.2 m^2 for a body with this radius in metres."""
    parts, _ = label(clearance(grid.free) > radius)
    return int((np.bincount(parts.ravel())[1:] * CELL**2 > 0.2).sum())


def _origin(grid: FloorGrid, base: Floats, choice: _Choice) -> tuple[float, float, float]:
    low = grid.origin + CELL * np.array([choice.cells[0].start, choice.cells[1].start])
    high = grid.origin + CELL * np.array([choice.cells[0].stop, choice.cells[1].stop])
    back = np.array(choice.back, float)
    middle: Floats = (low + high) / 2
    reach = float(np.abs(back) @ (high - low)) / 2 - np.ptp(base, axis=0)[1] / 2
    middle = middle + back * reach
    cos, sin = math.cos(choice.yaw), math.sin(choice.yaw)
    x, y = base.mean(axis=0)
    return float(middle[0] - cos * x + sin * y), float(middle[1] - sin * x - cos * y), choice.yaw


def _count(mask: Mask, spans: Sequence[Span]) -> NDArray[np.int_]:
    """Return the number of true cells of `mask` in a rectangle around each cell, whose ends are in `spans`."""
    total = np.pad(np.cumsum(np.cumsum(mask, axis=0), axis=1), ((1, 0), (1, 0)))
    (a, b), (c, d) = (
        [np.clip(np.arange(side) + end, 0, side) for end in span]
        for side, span in zip(mask.shape, spans, strict=True)
    )
    return np.asarray(total[b][:, d] - total[a][:, d] - total[b][:, c] + total[a][:, c])


def _all(mask: Mask, spans: Sequence[Span]) -> Mask:
    """Return a mask of the cells for which `mask` is true in the whole rectangle given by two spans."""
    (a, b), (c, d) = spans
    return np.asarray(_count(mask, spans) == (b - a) * (d - c))
