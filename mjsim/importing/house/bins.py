"""Places for the bins of the catalogue: backs to a wall, room to stand before them, and every way stays open."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import label

from mjsim.formats.scene.source_scene import Bin
from mjsim.formats.scene.surface import Floats
from mjsim.house.catalogue.catalogue import Catalogue, Receptacle
from mjsim.house.validation.checked_model import Compiled, compile_model
from mjsim.importing.house.plan import BODY, CELL, Mask, Plan, clearance
from mjsim.importing.house.rooms import Rooms
from mjsim.values.errors import AssetError

AREA = 5.0  # m^2 of walkable floor for each bin
_STAND = 0.8  # m of free floor before a bin
_ASIDE = 0.05  # m of air at the sides
_WALL = 0.15  # m behind a bin within which the wall is
_WIDE = 0.4  # m, radius at which ways stay as connected as they were
_TRIES = 300  # places that are tried for a bin, for each room
_LOST = 1.0  # m^2 of floor that may no longer be walked on, beyond the bin and its surroundings
# Bins by importance, and rooms in which people would look for them.
_HOMES = {
    "dish_bin": ("kitchen", "living_kitchen", "dining_room"),
    "toy_box": ("bedroom", "living_room"),
    "recycling_bin": ("kitchen", "living_kitchen", "hall"),
    "laundry_hamper": ("bathroom", "bedroom"),
    "office_box": ("office", "bedroom", "living_room"),
    "bookshelf": ("living_room", "living_kitchen", "office"),
}
# Turns about z and the way that the back then points.
_TURNS = ((0.0, (0, 1)), (math.pi, (0, -1)), (math.pi / 2, (-1, 0)), (-math.pi / 2, (1, 0)))


Span = tuple[int, int]  # cells from, to, the end not included


@dataclass(frozen=True)
class _Size:
    """Extent of a receptacle in its own frame, m: its sides and the middle of its base."""

    width: float
    depth: float
    middle: tuple[float, float]


def place_bins(plan: Plan, rooms: Rooms, catalogue: Catalogue, seed: int = 0) -> tuple[Bin, ...]:
    """As many bins as the floor is for, at most all of the catalogue; `AssetError` where none finds a place."""
    rng = np.random.default_rng(seed)
    wanted = [key for key in _HOMES if key in catalogue.receptacles]
    wanted = wanted[: max(1, int(plan.area / AREA))]
    bins: list[Bin] = []
    for key in wanted:
        size = _size(catalogue.receptacles[key])
        found = _placed(plan, rooms, key, size, [b.room for b in bins], rng)
        if found is not None:
            place, plan = found
            bins.append(place)
    if not bins:
        raise AssetError(
            f"has no place for a bin: a wall along x or y, 0.6 m long and 1.9 m high, with {_STAND} m of free floor "
            "before it; remove furniture, or turn the source"
        )
    return tuple(bins)


def _size(receptacle: Receptacle) -> _Size:
    compiled = compile_model(f"receptacle {receptacle.key}", receptacle.path)
    if not isinstance(compiled, Compiled):
        raise AssetError(f"{receptacle.path} {compiled[0].message}; {compiled[0].remedy}")
    low, high = compiled.extent(compiled.solid)[:, :2]
    (x, y), (width, depth) = ((low + high) / 2).tolist(), (high - low).tolist()
    return _Size(width, depth, (x, y))


def _placed(
    plan: Plan, rooms: Rooms, key: str, size: _Size, taken: Sequence[str], rng: np.random.Generator
) -> tuple[Bin, Plan] | None:
    """A place for a bin and the plan with it; by preference in a room that is for it, else in one with few bins."""
    numbers = list(range(1, len(rooms.names) + 1))
    homes = _HOMES[key]

    def rank(number: int) -> tuple[int, int, float]:
        name = rooms.names[number - 1][0]
        kind = name.rstrip("0123456789").rstrip("_")
        home = homes.index(kind) if kind in homes else len(homes)
        area = float((plan.walkable & (rooms.labels == number)).sum())
        return taken.count(name) + (home == len(homes)), home, -area

    for number in sorted(numbers, key=rank):
        for turn in _choices(plan, rooms.labels == number, size, rng):
            if (after := _with_bin(plan, rooms, size, turn)) is not None:
                x, y, yaw = _origin(plan, size, turn)
                return Bin(key, rooms.names[number - 1][0], x, y, yaw), after
    return None


@dataclass(frozen=True)
class _Choice:
    """A bin on the grid: its cells, and those before it."""

    cells: tuple[slice, slice]
    before: tuple[slice, slice]
    yaw: float
    back: tuple[int, int]  # which way its back points


def _choices(plan: Plan, room: Mask, size: _Size, rng: np.random.Generator) -> list[_Choice]:
    """Places in a room with the back to a wall, in random order."""
    free = plan.free & room
    standing = plan.walkable & room
    walls = (plan.walls & ~plan.doors) | ~plan.indoors  # where the shell closes it
    ahead = round(_STAND / CELL)
    found: list[_Choice] = []
    for yaw, back in _TURNS:
        sides = np.ceil(np.array([size.width + 2 * _ASIDE, size.depth]) / CELL).astype(int).tolist()
        spans = [(0, side) for side in (sides[::-1] if back[0] else sides)]
        edge = [_last(span, way) for span, way in zip(spans, back, strict=True)]
        before = [_beyond(span, -way, ahead) for span, way in zip(spans, back, strict=True)]
        behind = np.zeros_like(walls)
        for step in range(1, round(_WALL / CELL) + 1):
            behind |= _shifted(walls, back, step)  # cells with a wall that near behind them
        fits = _all(free, spans) & _all(behind, edge) & _all(free, before) & (_count(standing, before) > 0)
        found += [
            _Choice(_at(spans, place), _at(before, place), yaw, back) for place in np.argwhere(fits).tolist()
        ]
    order = rng.permutation(len(found))[:_TRIES]
    return [found[k] for k in order]


def _last(span: Span, way: int) -> Span:
    """The last cell of a span on a way, up or down; all of it across."""
    start, stop = span
    return {1: (stop - 1, stop), 0: span, -1: (start, start + 1)}[way]


def _beyond(span: Span, way: int, cells: int) -> Span:
    """So many cells beyond a span on a way, up or down; the span itself across."""
    start, stop = span
    return {1: (stop, stop + cells), 0: span, -1: (start - cells, start)}[way]


def _at(spans: Sequence[Span], place: Sequence[int]) -> tuple[slice, slice]:
    """Spans as cells of the grid, seen from a place."""
    x, y = (slice(at + start, at + stop) for at, (start, stop) in zip(place, spans, strict=True))
    return x, y


def _with_bin(plan: Plan, rooms: Rooms, size: _Size, choice: _Choice) -> Plan | None:
    """The plan with a bin; None where it would be in the way."""
    blocked = plan.blocked.copy()
    blocked[choice.cells] = True
    after = replace(plan, blocked=blocked)
    lost = (size.width + 2 * _WIDE) * (size.depth + 2 * _WIDE) + _LOST
    if plan.area - after.area > lost or not after.walkable[choice.before].any():
        return None
    for radius in (BODY, _WIDE):
        if _parts(after, radius) > _parts(plan, radius):
            return None
    numbers = range(1, len(rooms.names) + 1)
    area = [(after.walkable & (rooms.labels == n)).sum() * CELL**2 for n in numbers]
    return after if min(area) > 0.4 else None


def _parts(plan: Plan, radius: float) -> int:
    """Into how many parts of more than 0.2 m^2 the floor falls for a body of a radius, m."""
    parts, _ = label(clearance(plan.free) > radius)
    return int((np.bincount(parts.ravel())[1:] * CELL**2 > 0.2).sum())


def _origin(plan: Plan, size: _Size, choice: _Choice) -> tuple[float, float, float]:
    """Where the receptacle's frame is: x, y, m, and yaw, rad; its back ends with its cells."""
    low = plan.origin + CELL * np.array([choice.cells[0].start, choice.cells[1].start])
    high = plan.origin + CELL * np.array([choice.cells[0].stop, choice.cells[1].stop])
    back = np.array(choice.back, float)
    middle: Floats = (low + high) / 2
    reach = float(np.abs(back) @ (high - low)) / 2 - size.depth / 2
    middle = middle + back * reach
    cos, sin = math.cos(choice.yaw), math.sin(choice.yaw)
    x, y = size.middle
    return float(middle[0] - cos * x + sin * y), float(middle[1] - sin * x - cos * y), choice.yaw


def _count(mask: Mask, spans: Sequence[Span]) -> NDArray[np.int_]:
    """How many cells of a mask are within two spans, seen from each cell."""
    total = np.pad(np.cumsum(np.cumsum(mask, axis=0), axis=1), ((1, 0), (1, 0)))
    (a, b), (c, d) = (
        [np.clip(np.arange(side) + end, 0, side) for end in span]
        for side, span in zip(mask.shape, spans, strict=True)
    )
    return np.asarray(total[b][:, d] - total[a][:, d] - total[b][:, c] + total[a][:, c])


def _all(mask: Mask, spans: Sequence[Span]) -> Mask:
    """Cells from which all cells within two spans are in a mask."""
    (a, b), (c, d) = spans
    return np.asarray(_count(mask, spans) == (b - a) * (d - c))


def _shifted(mask: Mask, by: tuple[int, int], steps: int) -> Mask:
    """Cells whose neighbour, so many steps in a direction, is in a mask."""
    return np.roll(mask, (-by[0] * steps, -by[1] * steps), (0, 1))
