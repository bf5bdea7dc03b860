"""Rooms of a floor plan: as the source or the user names them, else parted where the way is narrow."""

import re
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

from mjsim.formats.scene.source_scene import NamedRoom, Piece, merged_rectangles, words_of
from mjsim.formats.scene.surface import Floats
from mjsim.importing.house.plan import CELL, Mask, Plan, clearance
from mjsim.support.files import read_text
from mjsim.values.errors import AssetError, brief

_NARROW = (0.65, 0.9, 1.2, 1.5, 1.8)  # m, half of the way that parts two rooms; the wider ones part halls
_HALL = 45.0  # m^2, floor of a room that is rather parted at wider openings
_HALL_PART = 5.0  # m^2, at least, of each part
_MIN_AREA = 1.5  # m^2 of floor; smaller ones belong to their neighbours
_MIN_WALK = 0.5  # m^2 that can be walked on
_COARSE = 2  # cells along the side of the grid of a room's rectangles
_LARGE = 0.5  # m; smaller things say nothing about the use of a room
# Names of furniture say what a room is; the first that fits counts.
_USES = (
    ("living_kitchen", "Living room with kitchen", ("kitchen fridge refrigerator", "sofa couch")),
    (
        "kitchen",
        "Kitchen",
        ("kitchen fridge refrigerator oven stove cooker cooking hob microwave dishwasher",),
    ),
    ("bathroom", "Bathroom", ("bath bathtub shower toilet washbasin",)),
    ("bedroom", "Bedroom", ("bed bunk wardrobe",)),
    ("living_room", "Living room", ("sofa couch tv television fireplace living",)),
    ("dining_room", "Dining room", ("dining",)),
    ("office", "Office", ("desk study office",)),
)

Labels = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Rooms:
    """Rooms on the grid of a plan."""

    names: tuple[tuple[str, str], ...]  # key and label of room 1, 2, ...
    labels: Labels  # number of the room of each cell, 0 off all rooms, (nx, ny)
    floor: Mask  # cells of rooms, without those in their walls, (nx, ny)
    reason: str  # how they were found

    def rectangles(self, plan: Plan) -> list[tuple[str, Floats, Floats]]:
        """Rectangles that cover the rooms: key, lower and upper corner, m, (2,) each."""
        found = []
        nx, ny = (np.array(self.labels.shape) // _COARSE).tolist()
        blocks = self.labels[: nx * _COARSE, : ny * _COARSE].reshape(nx, _COARSE, ny, _COARSE)
        coarse = blocks.max(axis=(1, 3))
        step = CELL * _COARSE
        for number, (key, _) in enumerate(self.names, 1):
            for a, b, c, d in merged_rectangles(coarse == number):
                found.append(
                    (key, plan.origin + step * np.array([a, c]), plan.origin + step * np.array([b, d]))
                )
        return found

    def shell(self, plan: Plan) -> list[tuple[Floats, Floats]]:
        """Boxes that close everything off the rooms: lower and upper corner, m, (2,) each."""
        inside = binary_dilation(self.labels > 0)
        rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        edge = 4
        window = np.zeros_like(inside)
        window[
            max(rows[0] - edge, 0) : rows[-1] + edge + 1, max(columns[0] - edge, 0) : columns[-1] + edge + 1
        ] = True
        parts, _ = label(window & ~inside)
        solid = plan.walls & ~plan.doors
        needed = np.isin(parts, np.setdiff1d(np.unique(parts[~solid]), [0]))
        return [
            (plan.origin + CELL * np.array([a, c]), plan.origin + CELL * np.array([b, d]))
            for a, b, c, d in merged_rectangles(needed)
        ]


class _RoomTable(msgspec.Struct, forbid_unknown_fields=True):
    label: str
    boxes: Annotated[list[tuple[float, float, float, float]], msgspec.Meta(min_length=1)]


def read_rooms(path: Path) -> tuple[NamedRoom, ...]:
    """Rooms of a TOML file, `AssetError` where it has none that can be read."""
    try:
        tables = tomllib.loads(read_text(path))
        rooms = msgspec.convert(tables.get("rooms", {}), dict[str, _RoomTable])
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, msgspec.ValidationError) as error:
        raise AssetError(brief(f"cannot read rooms from {path}: {error}")) from error
    bad = [key for key in rooms if not re.fullmatch(r"[a-z][a-z0-9_]*", key)]
    if bad or not rooms:
        raise AssetError(
            f"{path} has {f'a room {bad[0]!r}' if bad else 'no rooms'}; write [rooms.kitchen] with a label and "
            "boxes = [[xmin, ymin, xmax, ymax], ...]"
        )
    return tuple(NamedRoom(key, room.label, tuple(room.boxes)) for key, room in rooms.items())


def find_rooms(plan: Plan, given: Sequence[NamedRoom], pieces: Sequence[Piece]) -> Rooms:
    """Rooms that cover all floor that can be reached; `AssetError` where given ones cover none."""
    if given:
        seeds, reason = _seeds_of(plan, given), "given"
        names = [(room.key, room.label) for room in given]
    else:
        open_floor = plan.indoors & ~plan.walls
        seeds = _parted(open_floor)
        names, reason = (
            [],
            f"parted where the way is at most {2 * _NARROW[0]} m wide, halls where it is wider",
        )
    grown = _grown(seeds, plan.indoors & ~(plan.walls & ~plan.doors))
    kept = [
        n
        for n in range(1, int(grown.max()) + 1)
        if (plan.walkable & (grown == n)).sum() * CELL**2 >= _MIN_WALK
        and (bool(given) or (grown == n).sum() * CELL**2 >= _MIN_AREA)
    ]
    if not kept and given:
        raise AssetError(
            "no room that is given has floor that can be walked on; boxes are in m of the source"
        )
    if not kept:  # nowhere as wide as a room
        seeds, kept, reason = plan.walkable.astype(np.int32), [1], "one room"
    numbered = np.zeros(int(seeds.max()) + 1, np.int32)
    numbered[kept] = np.arange(1, len(kept) + 1)
    region = plan.indoors & ~(plan.walls & ~plan.doors)
    floor = _grown(numbered[seeds], region)
    labels = _within_walls(floor)
    names = [names[n - 1] for n in kept] if given else _names(labels, len(kept), plan, pieces)
    return Rooms(tuple(names), labels, floor > 0, reason)


def _parted(floor: Mask) -> Labels:
    """Rooms (nx, ny) of a floor with nothing but walls."""
    distance = clearance(floor)
    labels = np.zeros(floor.shape, np.int32)
    waiting = [(floor, 0)]
    while waiting:
        region, level = waiting.pop()
        seeds, count = label(region & (distance > _NARROW[level]))
        parts = seeds
        for depth in np.arange(
            _NARROW[level], -CELL, -CELL
        ):  # wide places first, so that rooms meet where it is narrow
            parts = _grown(parts, region & (distance > depth))
        sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:] * CELL**2
        if level and (sizes > _HALL_PART).sum() < 2:
            seeds, parts, sizes, count = (
                region,
                region.astype(np.int32),
                np.array([region.sum() * CELL**2]),
                1,
            )
        for number in range(1, count + 1):
            part = parts == number
            if sizes[number - 1] > _HALL and level + 1 < len(_NARROW):
                waiting.append((part, level + 1))
            else:
                labels[part] = labels.max() + 1
    return labels


def _seeds_of(plan: Plan, given: Sequence[NamedRoom]) -> Labels:
    seeds = np.zeros(plan.free.shape, np.int32)
    for number, room in enumerate(given, 1):
        for xmin, ymin, xmax, ymax in room.boxes:
            (a, c), (b, d) = plan.cell((xmin, ymin)), plan.cell((xmax, ymax))
            seeds[a : b + 1, c : d + 1] = number
    return np.where(plan.indoors & ~plan.walls, seeds, 0).astype(np.int32)


def _grown(seeds: NDArray[np.integer], region: Mask) -> Labels:
    """Seeds spread over a region, around corners, not through what is off it."""
    labels = np.where(region, seeds, 0).astype(np.int32)
    while True:
        fresh = np.where(region & (labels == 0), _spread(labels, cv2.MORPH_CROSS), labels)
        if np.array_equal(fresh, labels):
            return labels
        labels = fresh


def _within_walls(labels: Labels) -> Labels:
    """Rooms two cells farther, into their walls."""
    for _ in range(2):
        labels = np.where(labels == 0, _spread(labels, cv2.MORPH_RECT), labels)
    return labels


def _names(labels: Labels, count: int, plan: Plan, pieces: Sequence[Piece]) -> list[tuple[str, str]]:
    """Keys and labels by the furniture of each room."""
    words: list[set[str]] = [set() for _ in range(count + 1)]
    for piece in pieces:
        points = piece.surface.corners.reshape(-1, 3)
        if np.ptp(points, axis=0).max() >= _LARGE:
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            words[labels[plan.cell(middle)]] |= set(words_of(piece.name))
    names: list[tuple[str, str]] = []
    for number in range(1, count + 1):
        found = words[number]
        fits = ((key, text) for key, text, sets in _USES if all(found & set(some.split()) for some in sets))
        key, text = next(fits, ("room", "Room"))
        same = sum(re.fullmatch(rf"{key}(_\d+)?", k) is not None for k, _ in names)
        names.append((f"{key}_{same + 1}", f"{text} {same + 1}") if same or key == "room" else (key, text))
    return names


def _spread(labels: Labels, shape: int) -> Labels:
    """The largest label of each cell and its neighbours."""
    kernel = cv2.getStructuringElement(shape, (3, 3))  # OpenCV has no dilation of integers
    return np.asarray(cv2.dilate(labels.astype(np.float32), kernel), np.int32)
