"""Choose the rooms of a home at random, with their target areas and the doors between them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from mjsim.house.catalogue.generated_names import ROOMS
from mjsim.values.errors import HouseError


@dataclass(frozen=True)
class RoomNeeds:
    """Requirements for a room type. Their sources are listed in docs/generated-houses.md."""

    label: str
    area: tuple[float, float]  # minimum and maximum floor area, in square metres
    side: float  # minimum length of the shorter side, in metres
    aspect: float  # maximum ratio of the longer to the shorter side
    daylight: bool  # True if the room needs an outer wall with a window


NEEDS: Mapping[str, RoomNeeds] = {
    "studio": RoomNeeds("Studio", (28.0, 40.0), 3.8, 1.9, True),
    "living_room": RoomNeeds("Living room", (14.0, 32.0), 3.4, 1.9, True),
    "kitchen": RoomNeeds("Kitchen", (7.5, 16.0), 2.4, 2.0, True),
    "dining_room": RoomNeeds("Dining room", (9.0, 16.0), 2.75, 1.8, True),
    "hall": RoomNeeds("Hall", (4.0, 15.0), 1.45, 6.5, False),
    "bedroom": RoomNeeds("Bedroom", (11.5, 20.0), 2.75, 1.8, True),
    "bedroom_2": RoomNeeds("Second bedroom", (8.0, 15.0), 2.45, 1.8, True),
    "bedroom_3": RoomNeeds("Third bedroom", (7.5, 14.0), 2.25, 1.9, True),
    "office": RoomNeeds("Office", (7.0, 13.0), 2.25, 1.9, True),
    "bathroom": RoomNeeds("Bathroom", (4.4, 9.0), 1.85, 2.1, False),
    "shower_room": RoomNeeds("Shower room", (3.6, 6.0), 1.65, 2.4, False),
    "utility": RoomNeeds("Utility room", (3.0, 7.0), 1.45, 2.5, False),
}
_SMALL: Mapping[int, Sequence[tuple[str, ...]]] = {
    1: (("studio",),),
    2: (("studio", "bathroom"),),
    3: (
        ("living_room", "bedroom", "bathroom"),
        ("studio", "bathroom", "hall"),
        ("studio", "kitchen", "bathroom"),
    ),
    4: (
        ("living_room", "kitchen", "bedroom", "bathroom"),
        ("hall", "living_room", "bedroom", "bathroom"),
        ("hall", "studio", "kitchen", "bathroom"),
        ("living_room", "bedroom", "bedroom_2", "bathroom"),
        ("living_room", "bedroom", "office", "bathroom"),
    ),
    5: (
        ("hall", "living_room", "kitchen", "bedroom", "bathroom"),
        ("hall", "living_room", "kitchen", "bedroom", "bathroom"),
        ("hall", "living_room", "bedroom", "bedroom_2", "bathroom"),
        ("living_room", "kitchen", "bedroom", "bedroom_2", "bathroom"),
        ("living_room", "kitchen", "bedroom", "office", "bathroom"),
    ),
}
_CORE = ("hall", "living_room", "kitchen", "bedroom", "bathroom")
# Additional rooms in larger homes, with their relative probabilities.
_MORE = {
    "bedroom_2": 3.0,
    "office": 2.0,
    "shower_room": 1.5,
    "dining_room": 1.5,
    "bedroom_3": 1.5,
    "utility": 1.2,
}
_LIVELY = ("living_room", "studio", "hall")
HALL_PER_DOOR = (1.2, 1.9)  # range of a hall's floor area per door, in square metres
COOKING = 7.0  # additional floor area of a living room that contains the kitchen, in square metres
DOOR, WIDE = 1.3, 2.0  # minimum length of a wall with a door, and of a wall with a passage, in metres


@dataclass(frozen=True)
class Way:
    """A door or open passage between two rooms."""

    a: str
    b: str
    is_wide: bool = False  # True for an open passage, which has no door leaf

    @property
    def wall(self) -> float:
        """The minimum length of the wall that the two rooms share, in metres."""
        return WIDE if self.is_wide else DOOR


@dataclass(frozen=True)
class Programme:
    """Requirements that a floor plan has to meet."""

    areas: Mapping[str, float]  # target floor area of each room in square metres, by room key
    ways: tuple[Way, ...]  # doors and passages that connect all rooms
    hub: str  # key of the room with the front door


def use_of(key: str) -> str:
    """Return the use of a room, which is the room key without its number."""
    return key.rstrip("0123456789").rstrip("_")


def draw_programme(rooms: int, rng: np.random.Generator) -> Programme:
    """Choose rooms, areas and doors at random. Raise `HouseError` if the number of rooms is out of range."""
    if not ROOMS[0] <= rooms <= ROOMS[1]:
        raise HouseError(f"a home of {rooms} rooms cannot be generated; ask for {ROOMS[0]} to {ROOMS[1]}")
    keys = _keys(rooms, rng)
    # The rooms of a home tend to be either all large or all small.
    size = rng.uniform(0.1, 0.7) if rooms < 9 else rng.uniform(0.1, 0.4)
    areas = {}
    for key in keys:
        low, high = NEEDS[key].area
        low += COOKING if key == "living_room" and "kitchen" not in keys else 0.0
        areas[key] = low + (high - low) * float(np.clip(rng.normal(size, 0.15), 0.03, 0.97))
    hub = next(key for key in ("hall", *_LIVELY) if key in keys)
    ways = _ways(keys, hub, rng)
    if hub == "hall":  # the area of a hall depends on its number of doors
        doors = sum("hall" in (way.a, way.b) for way in ways)
        areas[hub] = float(np.clip(rng.uniform(*HALL_PER_DOOR) * doors, *NEEDS[hub].area))
    return Programme(areas, tuple(ways), hub)


def _keys(rooms: int, rng: np.random.Generator) -> tuple[str, ...]:
    if rooms in _SMALL:
        choices = _SMALL[rooms]
        return choices[int(rng.integers(len(choices)))]
    weights = np.array(list(_MORE.values()))
    chosen = rng.choice(list(_MORE), rooms - len(_CORE), replace=False, p=weights / weights.sum())
    more = [str(key) for key in chosen]
    if "bedroom_3" in more and "bedroom_2" not in more:
        more[more.index("bedroom_3")] = "bedroom_2"
    return (*_CORE, *more)


def _ways(keys: Sequence[str], hub: str, rng: np.random.Generator) -> list[Way]:
    ways = []
    for key in keys:
        if key == hub:
            continue
        behind, chance = {
            "kitchen": ("living_room", 0.45),
            "dining_room": ("kitchen" if rng.random() < 0.6 else "living_room", 0.8),
            "utility": ("kitchen", 0.5),
            "shower_room": ("bedroom", 0.55),
            "office": ("living_room", 0.25),
            "bedroom": ("living_room", 0.1),
        }.get(key, ("", 0.0))
        other = behind if behind in keys and behind != hub and rng.random() < chance else hub
        lively = {key, other} <= {"living_room", "kitchen", "dining_room", "hall", "studio"}
        ways.append(Way(key, other, lively and rng.random() < 0.5))
    return ways
