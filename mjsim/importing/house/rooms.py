"""Find the rooms of an imported house. Unless rooms are given, the floor is split at narrow passages."""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, label

from mjsim.formats.scene.source_scene import NamedRoom, ScenePiece, merged_rectangles, words_of
from mjsim.formats.scene.surface import Floats
from mjsim.importing.house.floor_grid import CELL, FloorGrid, Mask, clearance
from mjsim.support.toml import read_toml
from mjsim.values.errors import AssetError, brief

# Half the widths of passages that separate rooms, in metres. All except the first are for large rooms only.
_NARROW = (0.65, 0.9, 1.2, 1.5, 1.8)
_HALL = 45.0  # floor area above which a room is split at wider passages, in square metres
_HALL_PART = 5.0  # floor area that two parts of a split room must exceed, in square metres
# Minimum floor area of a room in square metres. Smaller rooms are merged with adjacent rooms.
_MIN_AREA = 1.5
_MIN_WALK = 0.5  # minimum walkable area of a room, in square metres
_COARSE = 2  # side length of the blocks that make up the rectangles of a room, in cells
_LARGE = 0.5  # minimum size of furniture that determines the use of a room, in metres
# Key, label and word groups of each use. A room needs furniture that matches a word of every group.
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
    """The rooms of a house on a floor grid."""

    names: tuple[tuple[str, str], ...]  # key and label of each room; the first entry is room 1
    labels: Labels  # room number of each cell, or 0 for none, shape (nx, ny)
    floor: Mask  # cells of all rooms without the walls, shape (nx, ny)
    reason: str  # explanation of how the rooms were found, for the report

    def rectangles(self, grid: FloorGrid) -> list[tuple[str, Floats, Floats]]:
        """Return rectangles that cover all rooms: room key, lower corner and upper corner (2,), in metres."""
        found = []
        nx, ny = (np.array(self.labels.shape) // _COARSE).tolist()
        blocks = self.labels[: nx * _COARSE, : ny * _COARSE].reshape(nx, _COARSE, ny, _COARSE)
        coarse = blocks.max(axis=(1, 3))
        step = CELL * _COARSE
        for number, (key, _) in enumerate(self.names, 1):
            for a, b, c, d in merged_rectangles(coarse == number):
                low, high = grid.origin + step * np.array([a, c]), grid.origin + step * np.array([b, d])
                found.append((key, low, high))
        return found

    def shell(self, grid: FloorGrid) -> list[tuple[Floats, Floats]]:
        """Return boxes that block the area around the rooms, as lower and upper corners (2,) in metres."""
        inside = binary_dilation(self.labels > 0)
        rows, columns = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        across, along = (slice(max(at[0] - 4, 0), at[-1] + 5) for at in (rows, columns))
        window = np.zeros_like(inside)
        window[across, along] = True
        parts, _ = label(window & ~inside)
        solid = grid.walls & ~grid.doors
        needed = np.isin(parts, np.setdiff1d(np.unique(parts[~solid]), [0]))
        return [
            (grid.origin + CELL * np.array([a, c]), grid.origin + CELL * np.array([b, d]))
            for a, b, c, d in merged_rectangles(needed)
        ]


class _RoomTable(msgspec.Struct, forbid_unknown_fields=True):
    label: str
    boxes: Annotated[list[tuple[float, float, float, float]], msgspec.Meta(min_length=1)]


def read_rooms(path: Path) -> tuple[NamedRoom, ...]:
    """Read rooms from a TOML file. Raise an AssetError if the file contains no rooms or invalid ones."""
    try:
        rooms = msgspec.convert(read_toml(path).get("rooms", {}), dict[str, _RoomTable])
    except (OSError, ValueError) as error:
        raise AssetError(brief(f"cannot read rooms from {path}: {error}")) from error
    bad = [key for key in rooms if not re.fullmatch(r"[a-z][a-z0-9_]*", key)]
    if bad or not rooms:
        raise AssetError(
            f"{path} has {f'a room {bad[0]!r}' if bad else 'no rooms'}; write [rooms.kitchen] with a label and "
            "boxes = [[xmin, ymin, xmax, ymax], ...]"
        )
    return tuple(NamedRoom(key, room.label, tuple(room.boxes)) for key, room in rooms.items())


def find_rooms(grid: FloorGrid, given: Sequence[NamedRoom], pieces: Sequence[ScenePiece]) -> Rooms:
    """Divide the reachable floor into rooms. Raise an AssetError if the given rooms cover none of it."""
    region = grid.indoors & ~(grid.walls & ~grid.doors)
    if given:
        seeds, reason = _seeds_of(grid, given), "given"
    else:
        seeds = _parted(grid.indoors & ~grid.walls)
        reason = f"separated where the way is at most {2 * _NARROW[0]} m wide, halls where it is wider"
    grown = _grown(seeds, region)
    kept = [
        n
        for n in range(1, int(grown.max()) + 1)
        if (grid.walkable & (grown == n)).sum() * CELL**2 >= _MIN_WALK
        and (bool(given) or (grown == n).sum() * CELL**2 >= _MIN_AREA)
    ]
    if not kept and given:
        raise AssetError("no given room has walkable floor; boxes are in the source's coordinates, in m")
    if not kept:  # No part is large enough to be a room.
        seeds, kept, reason = grid.walkable.astype(np.int32), [1], "one room"
    numbered = np.zeros(int(seeds.max()) + 1, np.int32)
    numbered[kept] = np.arange(1, len(kept) + 1)
    floor = _grown(numbered[seeds], region)
    labels = floor
    for _ in range(2):  # rooms include two cells of their walls
        labels = np.where(labels == 0, _spread(labels, cv2.MORPH_RECT), labels)
    given_names = [(given[n - 1].key, given[n - 1].label) for n in kept if given]
    names = given_names or _names(labels, len(kept), grid, pieces)
    return Rooms(tuple(names), labels, floor > 0, reason)


def _parted(floor: Mask) -> Labels:
    """Split a floor without furniture at narrow passages. Return the room numbers, shape (nx, ny)."""
    distance = clearance(floor)
    labels = np.zeros(floor.shape, np.int32)
    waiting = [(floor, 0)]
    while waiting:
        region, level = waiting.pop()
        seeds, count = label(region & (distance > _NARROW[level]))
        parts = seeds
        # Fill wide areas first, so that rooms meet at narrow passages.
        for depth in np.arange(_NARROW[level], -CELL, -CELL):
            parts = _grown(parts, region & (distance > depth))
        sizes = np.bincount(parts.ravel(), minlength=count + 1)[1:] * CELL**2
        if level and (sizes > _HALL_PART).sum() < 2:
            parts, sizes, count = region.astype(np.int32), np.array([region.sum() * CELL**2]), 1
        for number in range(1, count + 1):
            part = parts == number
            if sizes[number - 1] > _HALL and level + 1 < len(_NARROW):
                waiting.append((part, level + 1))
            else:
                labels[part] = labels.max() + 1
    return labels


def _seeds_of(grid: FloorGrid, given: Sequence[NamedRoom]) -> Labels:
    seeds = np.zeros(grid.free.shape, np.int32)
    for number, room in enumerate(given, 1):
        for xmin, ymin, xmax, ymax in room.boxes:
            (a, c), (b, d) = grid.cell((xmin, ymin)), grid.cell((xmax, ymax))
            seeds[a : b + 1, c : d + 1] = number
    return np.where(grid.indoors & ~grid.walls, seeds, 0).astype(np.int32)


def _grown(seeds: NDArray[np.integer], region: Mask) -> Labels:
    """Extend the labels to all cells of a region that are connected to a labelled cell."""
    labels = np.where(region, seeds, 0).astype(np.int32)
    while True:
        fresh = np.where(region & (labels == 0), _spread(labels, cv2.MORPH_CROSS), labels)
        if np.array_equal(fresh, labels):
            return labels
        labels = fresh


def _names(
    labels: Labels, count: int, grid: FloorGrid, pieces: Sequence[ScenePiece]
) -> list[tuple[str, str]]:
    words: list[set[str]] = [set() for _ in range(count + 1)]
    for piece in pieces:
        points = piece.surface.corners.reshape(-1, 3)
        if np.ptp(points, axis=0).max() >= _LARGE:
            middle = (points.min(axis=0) + points.max(axis=0)) / 2
            words[labels[grid.cell(middle)]] |= set(words_of(piece.name))
    names: list[tuple[str, str]] = []
    for number in range(1, count + 1):
        found = words[number]
        fits = ((key, text) for key, text, sets in _USES if all(found & set(some.split()) for some in sets))
        key, text = next(fits, ("room", "Room"))
        same = sum(re.fullmatch(rf"{key}(_\d+)?", k) is not None for k, _ in names)
        names.append((f"{key}_{same + 1}", f"{text} {same + 1}") if same or key == "room" else (key, text))
    return names


def _spread(labels: Labels, shape: int) -> Labels:
    kernel = cv2.getStructuringElement(shape, (3, 3))  # OpenCV cannot dilate 32-bit integers.
    return np.asarray(cv2.dilate(labels.astype(np.float32), kernel), np.int32)
