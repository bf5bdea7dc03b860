"""Place doors, door leaves and windows in a floor plan."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

import numpy as np

from mjsim.generator.programme import DOOR, NEEDS, Programme, Way
from mjsim.generator.values import (
    OUTER_WALL,
    SIDES,
    WALL,
    Door,
    HomePlan,
    Leaf,
    Rectangle,
    Room,
    Side,
    Window,
)
from mjsim.house.catalogue.generated_names import stream
from mjsim.values.errors import HouseError

# Lengths are in metres.
CLEAR, CLEAR_FRONT = 0.92, 0.95  # clear width of inner doors and of the front door
WIDE_CLEAR = (1.4, 1.6, 1.8)  # possible clear widths of open passages
TOP, WIDE_TOP = 2.05, 2.2  # height of doors and of open passages
JAMB = 0.12  # minimum distance between a door and a corner of the room
LEAF_DEPTH = 0.06
LEAST_GLASS = 1 / 10  # minimum ratio of window area to floor area in rooms that need daylight
WINDOW_TOP = 2.2
BESIDE_SHOWER = 1.85  # minimum length of a wall with both a window and a shower
NARROW_SILL, LOW_SILL, USUAL_SILL, KITCHEN_SILL = 1.4, 0.4, 0.95, 1.1
SECOND_WAY, SECOND_WINDOW = 0.25, 0.45  # probabilities of an extra door and of a second window
EXTRA_WAYS = (  # pairs of rooms between which an extra door may be added
    ("kitchen", "living_room"),
    ("dining_room", "living_room"),
    ("dining_room", "kitchen"),
    ("dining_room", "hall"),
    ("office", "living_room"),
    ("bedroom", "bathroom"),
    ("utility", "kitchen"),
    ("utility", "hall"),
)


def add_openings(seed: int, programme: Programme, rooms: Sequence[Room], attempt: int = 0) -> HomePlan:
    """Add doors and windows to rooms. Raise `HouseError` if a required door or window does not fit."""
    rng = stream(seed, "openings", str(attempt))
    ways = [*programme.ways, *_extra_ways(programme, rooms, rng)]
    by_key = {room.key: room for room in rooms}
    doors = [_front_door(by_key[programme.hub], rooms, rng)]
    for way in ways:
        door = _door(by_key[way.a], by_key[way.b], way, doors, rng)
        if door is not None:
            doors.append(door)
        elif way in programme.ways:
            raise HouseError(f"no place for a door between {way.a} and {way.b}")
    plan = HomePlan(tuple(rooms), tuple(doors), ())
    plan = replace(plan, windows=tuple(w for room in rooms for w in _windows(plan, room, rng)))
    return replace(plan, doors=tuple(_with_leaves(plan, rng)))


def shared_wall(a: Room, b: Room) -> tuple[Side, float, float] | None:
    """Return the wall that two rooms share, as (side of `a`, start, end), or None if they share no wall."""
    for side in SIDES:
        across = a.floor.along(side, *a.floor.wall(side), -2 * WALL, 0.0)
        if b.floor.overlaps(across) and not b.floor.overlaps(a.floor):
            (a0, a1), (b0, b1) = a.floor.wall(side), b.floor.wall(side)
            if min(a1, b1) - max(a0, b0) > 0:
                return side, max(a0, b0), min(a1, b1)
    return None


def wall_stretches(room: Room, side: Side, rooms: Sequence[Room]) -> list[tuple[float, float, bool]]:
    """Divide a wall of a room into inner and outer stretches (start, end, is_outside).

    The stretches reach from corner to corner of the room's cell, which is the floor together with the
    adjacent halves of its walls. The cells of all rooms cover a home without gaps.
    """
    start, end = (value + sign * WALL / 2 for value, sign in zip(room.floor.wall(side), (-1, 1), strict=True))
    cuts = []
    for other in rooms:
        found = shared_wall(room, other) if other is not room else None
        if found and found[0] == side:
            cuts.append((max(start, found[1] - WALL / 2), min(end, found[2] + WALL / 2)))
    outer = [(low, high, True) for low, high in gaps(start, end, cuts) if high - low > 1e-6]
    return sorted([*outer, *((low, high, False) for low, high in cuts)])


def gaps(start: float, end: float, taken: Iterable[tuple[float, float]]) -> Iterator[tuple[float, float]]:
    """Yield the parts of an interval that lie outside all `taken` intervals."""
    for low, high in sorted(taken):
        if low > start:
            yield start, low
        start = max(start, high)
    if end > start:
        yield start, end


def _extra_ways(programme: Programme, rooms: Sequence[Room], rng: np.random.Generator) -> Iterator[Way]:
    by_key = {room.key: room for room in rooms}
    there = {frozenset((way.a, way.b)) for way in programme.ways}
    for a, b in EXTRA_WAYS:
        chance = rng.random()
        if a not in by_key or b not in by_key or {a, b} in there or chance > SECOND_WAY:
            continue
        wall = shared_wall(by_key[a], by_key[b])
        if wall and wall[2] - wall[1] >= DOOR:
            yield Way(a, b)


def _door(a: Room, b: Room, way: Way, doors: Sequence[Door], rng: np.random.Generator) -> Door | None:
    """Place a door between two rooms, if possible away from other doors. Return None if it does not fit."""
    wall = shared_wall(a, b)
    if wall is None:
        return None
    side, low, high = wall
    width = min(float(rng.choice(WIDE_CLEAR)), high - low - 2 * JAMB) if way.is_wide else CLEAR
    near, far = low + JAMB + width / 2, max(low, high) - JAMB - width / 2
    if far < near - 1e-6 or width < CLEAR - 1e-6:
        return None
    # Most doors are placed near a corner, which leaves more wall for furniture.
    ends = [near, far] if rng.random() < 0.5 else [far, near]
    between = list(near + max(0.0, far - near) * rng.random(6))
    places = [*ends, *between] if rng.random() < 0.7 else [*between, *ends]
    top = WIDE_TOP if way.is_wide else TOP
    choices = [Door((a.key, b.key), side, round(float(at), 3), round(width, 3), top) for at in places]
    return _apart(choices, (a, b), doors)


def _front_door(room: Room, rooms: Sequence[Room], rng: np.random.Generator) -> Door:
    reach = CLEAR_FRONT / 2 + JAMB + WALL / 2
    places = [
        (side, at)
        for side in SIDES
        for low, high, is_outside in wall_stretches(room, side, rooms)
        if is_outside and high - low >= 2 * reach - 1e-6
        for at in (low + reach, (low + high) / 2, high - reach)
    ]
    if not places:
        raise HouseError(f"no place for the front door in {room.key}")
    side, at = places[int(rng.integers(len(places)))]
    return Door((room.key,), side, round(at, 3), CLEAR_FRONT, TOP)


def _apart(choices: Sequence[Door], rooms: Sequence[Room], doors: Sequence[Door]) -> Door | None:
    for depth in (0.7, 0.05):
        for choice in choices:
            pairs = ((room, door) for room in rooms for door in doors if room.key in door.rooms)
            if not any(
                _before(room, choice, depth).overlaps(_before(room, door, depth)) for room, door in pairs
            ):
                return choice
    return None


def _before(room: Room, door: Door, depth: float) -> Rectangle:
    half = door.width / 2 + JAMB / 2
    side = door.side_in(room.key)
    return room.floor.along(side, door.center - half, door.center + half, -OUTER_WALL, depth)


def _windows(plan: HomePlan, room: Room, rng: np.random.Generator) -> list[Window]:
    needs_light = NEEDS[room.key].daylight
    outer = [
        (side, low + WALL / 2, high - WALL / 2)
        for side in SIDES
        for low, high, is_outside in wall_stretches(room, side, plan.rooms)
        if is_outside
    ]
    outer.sort(key=lambda wall: wall[1] - wall[2])
    windows: list[Window] = []
    sill = _sill(room, rng)
    for side, low, high in outer:
        chance, shift = rng.random(), rng.random()
        glass = sum(w.width * (w.top - w.sill) for w in windows)
        is_wanted = glass < LEAST_GLASS * room.floor.area if needs_light else not windows and chance < 0.7
        if not is_wanted and (not needs_light or chance > SECOND_WINDOW):
            continue
        for free_low, free_high in _free(plan, room, side, low, high):
            room_for = free_high - free_low - 0.4
            wanted = float(rng.choice((1.2, 1.5, 1.8, 2.2))) if needs_light else 0.7
            if needs_light:
                wanted = max(wanted, LEAST_GLASS * room.floor.area / (WINDOW_TOP - sill))
            width = min(wanted, room_for, 2.6)
            if width < 0.55 or (not needs_light and free_high - free_low < BESIDE_SHOWER):
                continue
            if not needs_light:
                shift = round(shift)  # at one end of the wall, so that a shower fits at the other end
            at = free_low + 0.2 + width / 2 + shift * (room_for - width)
            windows.append(Window(room.key, side, round(at, 3), round(width, 3), sill, WINDOW_TOP))
            break
    if needs_light and not windows:
        raise HouseError(f"no place for a window in {room.key}")
    return windows


def _sill(room: Room, rng: np.random.Generator) -> float:
    low = LOW_SILL if rng.random() < 0.35 else USUAL_SILL
    if room.use in ("kitchen", "studio"):
        return KITCHEN_SILL
    if not NEEDS[room.key].daylight:
        return NARROW_SILL
    return low if room.use == "living_room" else USUAL_SILL


def _free(plan: HomePlan, room: Room, side: Side, low: float, high: float) -> Iterator[tuple[float, float]]:
    at = low
    doors = [door for door in plan.doors_of(room.key) if door.side_in(room.key) == side]
    for door in sorted(doors, key=lambda door: door.center):
        if low < door.center < high:
            yield at, door.center - door.width / 2 - 0.1
            at = door.center + door.width / 2 + 0.1
    yield at, high


def _with_leaves(plan: HomePlan, rng: np.random.Generator) -> Iterator[Door]:
    taken: list[Rectangle] = []
    for door in plan.doors:
        if door.is_front or door.height == WIDE_TOP:
            yield door
            continue
        leaves = [leaf for key in door.rooms for leaf in _leaves(plan.room(key), door)]
        free = [leaf for leaf in leaves if _fits(plan, leaf, door, taken)]
        if not free:
            yield door
            continue
        leaf = free[int(rng.integers(len(free)))]
        taken.append(leaf.floor)
        yield replace(door, leaf=leaf)


def _leaves(room: Room, door: Door) -> Iterator[Leaf]:
    floor, side, half = room.floor, door.side_in(room.key), door.width / 2
    low, high = floor.wall(side)
    left, right = door.center - half, door.center + half
    yield Leaf(room.key, side, floor.along(side, left - 0.03 - door.width, left - 0.03, 0.0, LEAF_DEPTH))
    yield Leaf(room.key, side, floor.along(side, right + 0.03, right + 0.03 + door.width, 0.0, LEAF_DEPTH))
    is_level = side in ("south", "north")
    if left - low < JAMB + 0.02:
        beside: Side = "west" if is_level else "south"
        yield Leaf(room.key, beside, _from_corner(floor, beside, side, door.width))
    if high - right < JAMB + 0.02:
        beside = "east" if is_level else "north"
        yield Leaf(room.key, beside, _from_corner(floor, beside, side, door.width))


def _from_corner(floor: Rectangle, side: Side, corner: Side, width: float) -> Rectangle:
    low, high = floor.wall(side)
    start = low + 0.03 if corner in ("south", "west") else high - 0.03 - width
    end = low + 0.03 + width if corner in ("south", "west") else high - 0.03
    return floor.along(side, start, end, 0.0, LEAF_DEPTH)


def _fits(plan: HomePlan, leaf: Leaf, own: Door, taken: Sequence[Rectangle]) -> bool:
    room = plan.room(leaf.room)
    inside, floor = room.floor, leaf.floor
    limits = inside.grown(1e-6)
    if not (limits.contains(floor.x0, floor.y0) and limits.contains(floor.x1, floor.y1)):
        return False
    others = [door for door in plan.doors_of(room.key) if door is not own]
    if any(_before(room, door, 0.3).overlaps(floor) for door in others):
        return False
    windows = (w for w in plan.windows_of(room.key) if w.side == leaf.side)
    for window in windows:
        half = window.width / 2
        if inside.along(window.side, window.center - half, window.center + half, 0.0, 0.1).overlaps(floor):
            return False
    return not any(floor.grown(0.05).overlaps(other) for other in taken)
