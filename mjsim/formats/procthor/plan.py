"""Read the rooms, walls, openings and objects of a ProcTHOR house from its JSON file.

The JSON file uses a left-handed coordinate system with y up. Seen from above, its (x, z) are (x, y) in mjsim.
Its walls have no thickness and are the centre lines of walls in mjsim. The position of an object is the
centre of its bounding box, and its front faces along z at rotation 0.
"""

import math
import re
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec
import numpy as np

from mjsim.formats.scene.source_scene import NamedRoom, boxes_of, words_of
from mjsim.generator.values import WALL
from mjsim.support.files import read_json, read_text
from mjsim.values.errors import AssetError, brief

# Metadata key of a mapping from room ids to [key, label], which exported houses contain because ProcTHOR has only four
# room types.
NAMES = "mjsim_rooms"
# Names of room types that are not written in camel case.
_TYPES = {"livingroom": "living_room"}


_Number = Annotated[float, msgspec.Meta(ge=-1000.0, le=1000.0)]


class Vector(msgspec.Struct):
    """A position in metres or a rotation in degrees."""

    x: _Number = 0.0
    y: _Number = 0.0
    z: _Number = 0.0


class _Span(msgspec.Struct):
    min: Vector
    max: Vector


class _Room(msgspec.Struct, rename="camel"):
    id: str
    floor_polygon: list[Vector]
    room_type: str = "Room"


class _Wall(msgspec.Struct, rename="camel"):
    id: str
    polygon: list[Vector]
    room_id: str = ""
    empty: bool = False


class _Opening(msgspec.Struct, rename="camel"):
    id: str
    wall0: str | None = None
    room0: str | None = None
    room1: str | None = None
    hole_polygon: list[Vector] = []
    bounding_box: _Span | None = None  # used by older files


class Thing(msgspec.Struct, rename="camel"):
    """An object in the house, together with the objects on top of it."""

    id: str
    position: Vector
    asset_id: str = ""
    rotation: Vector = msgspec.field(default_factory=Vector)
    kinematic: bool = False
    children: list["Thing"] = []


class _House(msgspec.Struct):
    rooms: list[_Room]
    walls: list[_Wall]
    doors: list[_Opening] = []
    windows: list[_Opening] = []
    objects: list[Thing] = []
    metadata: dict[str, Any] = {}


@dataclass(frozen=True)
class PlanWall:
    """A wall, which is defined by its centre line on the floor."""

    start: tuple[float, float]  # start point (x, y) in metres
    end: tuple[float, float]
    height: float


@dataclass(frozen=True)
class PlanOpening:
    """A door or window, which spans the wall from `start` to `end`, in metres."""

    start: tuple[float, float]
    end: tuple[float, float]
    bottom: float
    top: float
    is_door: bool
    rooms: tuple[str, ...]  # keys of the rooms on both sides, or of one room for a front door


@dataclass(frozen=True)
class ProcthorPlan:
    """The floor plan of a ProcTHOR house, converted to metres with z up."""

    rooms: tuple[NamedRoom, ...]
    walls: tuple[PlanWall, ...]
    openings: tuple[PlanOpening, ...]


def read_plan(path: Path) -> tuple[ProcthorPlan, tuple[Thing, ...]]:
    """Read the floor plan and the objects of a house. Raise `AssetError` if the file is not a valid house."""
    try:
        house = msgspec.convert(_without_nulls(read_json(read_text(path))), _House)
    except (OSError, ValueError, RecursionError) as error:
        raise AssetError(
            brief(f"cannot read {path} as a house of ProcTHOR: {error}; export it again")
        ) from error
    if not house.rooms:
        raise AssetError(f"{path} has no rooms; give a house of ProcTHOR")
    rooms = tuple(_rooms(house, path))
    keys = {room.id: named.key for room, named in zip(house.rooms, rooms, strict=True)}
    ends = {wall.id: _ends(wall, path) for wall in house.walls}
    walls: dict[Any, PlanWall] = {}
    for wall in house.walls:
        start, end, height = ends[wall.id]
        inner = "exterior" not in (wall.room_id, *wall.id.split("|"))
        if inner and not wall.empty and math.dist(start, end) > WALL:
            walls.setdefault(tuple(sorted((start, end))), PlanWall(start, end, height))
    openings = [
        _opening(one, ends, keys, of == "door", path)
        for of, ones in (("door", house.doors), ("window", house.windows))
        for one in ones
    ]
    return ProcthorPlan(rooms, tuple(walls.values()), tuple(openings)), tuple(house.objects)


def _without_nulls(value: Any) -> Any:
    """Remove null values from JSON objects. A front door, for example, has null as its second room."""
    if isinstance(value, dict):
        return {key: _without_nulls(one) for key, one in value.items() if one is not None}
    return [_without_nulls(one) for one in value] if isinstance(value, list) else value


def _rooms(house: _House, path: Path) -> Iterator[NamedRoom]:
    given = house.metadata.get(NAMES, {})
    counts = Counter[str]()
    for room in house.rooms:
        words = "_".join(word.lower() for word in words_of(room.room_type)) or "room"
        kind = _TYPES.get(words, words)
        counts[kind] += 1
        number = counts[kind]
        key = f"{kind}_{number}" if number > 1 else kind
        label = kind.replace("_", " ").capitalize() + (f" {number}" if number > 1 else "")
        names = given.get(room.id) if isinstance(given, dict) else None
        if isinstance(names, list) and len(names) == 2 and re.fullmatch(r"[a-z][a-z0-9_]*", str(names[0])):
            key, label = map(str, names)
        outline = np.array([(point.x, point.z) for point in room.floor_polygon])
        try:
            yield NamedRoom(key, label, boxes_of(outline))
        except ValueError as error:
            raise AssetError(f"{path}: the room {room.id!r} {error}; correct its floorPolygon") from error


def _ends(wall: _Wall, path: Path) -> tuple[tuple[float, float], tuple[float, float], float]:
    """Return the start point, the end point and the height of a wall, in metres."""
    heights = [point.y for point in wall.polygon] or [0.0]
    low = [point for point in wall.polygon if point.y < min(heights) + 0.01]
    if len(low) < 2:
        raise AssetError(f"{path}: the wall {wall.id!r} has no lower edge; correct its polygon")
    first, last = ((round(point.x, 4), round(point.z, 4)) for point in low[:2])
    return first, last, max(heights)


def _opening(
    one: _Opening, ends: dict[str, Any], keys: dict[str, str], is_door: bool, path: Path
) -> PlanOpening:
    corners = one.hole_polygon or ([one.bounding_box.min, one.bounding_box.max] if one.bounding_box else [])
    if one.wall0 not in ends or len(corners) < 2:
        raise AssetError(f"{path}: {one.id!r} has no hole in a wall that is there; correct its wall0")
    start, end, _ = ends[one.wall0]
    along = np.subtract(end, start) / max(math.dist(start, end), 1e-6)
    low, high = (f(point.x for point in corners) for f in (min, max))
    first, last = ((np.array(start) + along * at).round(4).tolist() for at in (low, high))
    bottom, top = (f(point.y for point in corners) for f in (min, max))
    rooms = dict.fromkeys(keys[room] for room in (one.room0, one.room1) if room in keys)
    return PlanOpening((first[0], first[1]), (last[0], last[1]), bottom, top, is_door, tuple(rooms))
