"""Values exchanged by the parts of the generator. All lengths are in metres.

The plan lies in x (east) and y (north). A `Room` is the free floor between its walls, and neighbouring rooms are `WALL`
apart. Furniture is written in its own frame: the origin on the floor in the middle of the back edge, +x along the wall,
+y into the room, +z up. Counter-clockwise `quarter_turns` turn that frame into the house's (see `BACK`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

WALL = 0.12
OUTER_WALL = 0.21  # distance from the edge of the floor to the outside of an outer wall
CEILING_HEIGHT = 2.6

Side = Literal["south", "east", "north", "west"]
SIDES: tuple[Side, ...] = ("south", "east", "north", "west")
# Number of quarter turns of a piece whose back is to the wall.
BACK: Mapping[Side, int] = {"south": 0, "east": 1, "north": 2, "west": 3}
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Rectangle:
    """An axis-aligned rectangle on the floor."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        return self.y1 - self.y0

    @property
    def area(self) -> float:
        return self.width * self.depth

    @property
    def center(self) -> tuple[float, float]:
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    def grown(self, by: float) -> "Rectangle":
        """Return the rectangle with every side moved outwards by a distance, or inwards if it is negative."""
        return Rectangle(self.x0 - by, self.y0 - by, self.x1 + by, self.y1 + by)

    def overlaps(self, other: "Rectangle", slack: float = 1e-6) -> bool:
        """Return True if the rectangles share an area, not just an edge."""
        return (
            self.x0 < other.x1 - slack
            and other.x0 < self.x1 - slack
            and self.y0 < other.y1 - slack
            and other.y0 < self.y1 - slack
        )

    def contains(self, x: float, y: float) -> bool:
        """Return True if a point is inside or on the border."""
        return self.x0 <= x <= self.x1 and self.y0 <= y <= self.y1

    def wall(self, side: Side) -> tuple[float, float]:
        """Return the start and end of the wall on a side. They are x coordinates for south and north, otherwise y."""
        return (self.x0, self.x1) if side in ("south", "north") else (self.y0, self.y1)

    def along(self, side: Side, start: float, end: float, near: float, far: float) -> "Rectangle":
        """Return the rectangle from `start` to `end` along a wall, and from `near` to `far` away from it."""
        if side == "south":
            return Rectangle(start, self.y0 + near, end, self.y0 + far)
        if side == "north":
            return Rectangle(start, self.y1 - far, end, self.y1 - near)
        if side == "west":
            return Rectangle(self.x0 + near, start, self.x0 + far, end)
        return Rectangle(self.x1 - far, start, self.x1 - near, end)


@dataclass(frozen=True)
class Room:
    """A room with a rectangular floor.

    Keys are `hall`, `living_room`, `kitchen`, `dining_room`, `bedroom`, `bedroom_2`, `bedroom_3`, `bathroom`,
    `shower_room`, `office`, `utility` and `studio`. Uses are the keys without numbers.
    """

    key: str
    use: str
    label: str  # name shown to participants
    floor: Rectangle


@dataclass(frozen=True)
class Leaf:
    """An open door leaf, flat against a wall of `room`. Furniture must not cover `floor`."""

    room: str
    side: Side
    floor: Rectangle


@dataclass(frozen=True)
class Door:
    """A doorway between two rooms, or the closed front door, which belongs to one room.

    The door is in the wall `side` of the first room. Its `center` is an x coordinate for south and north walls,
    otherwise a y coordinate.
    """

    rooms: tuple[str, ...]
    side: Side
    center: float
    width: float
    height: float
    leaf: Leaf | None = None

    @property
    def is_front(self) -> bool:
        return len(self.rooms) == 1

    def side_in(self, room: str) -> Side:
        return self.side if room == self.rooms[0] else opposite(self.side)


@dataclass(frozen=True)
class Window:
    """A window in an outer wall. Furniture in front of it is lower than the sill. For `center`, see `Door`."""

    room: str
    side: Side
    center: float
    width: float
    sill: float
    top: float


@dataclass(frozen=True)
class HomePlan:
    """Rooms with their doors and windows."""

    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    windows: tuple[Window, ...]

    def room(self, key: str) -> Room:
        return next(room for room in self.rooms if room.key == key)

    def doors_of(self, room: str) -> tuple[Door, ...]:
        """Return the doors of a room, including the front door."""
        return tuple(door for door in self.doors if room in door.rooms)

    def windows_of(self, room: str) -> tuple[Window, ...]:
        return tuple(window for window in self.windows if window.room == room)

    @property
    def area(self) -> float:
        return sum(room.floor.area for room in self.rooms)


@dataclass(frozen=True)
class Asset:
    """A material or texture of a piece of furniture.

    Materials of `models/houses/apartment/materials.xml` need no asset. Assets of the same name must be equal,
    so names should begin with the furniture type, as in `rug_stripes_3f2a`.

    Attributes:
        xml: One `<material .../>` or `<texture .../>`. A texture names a file of the package, or has an `image`.
        image: PNG bytes of a texture that is drawn for this house, written as `textures/<name>.png`.
    """

    name: str
    xml: str
    image: bytes | None = None


@dataclass(frozen=True)
class Palette:
    """Colours of a house, chosen once so that its furniture matches."""

    woods: tuple[Rgb, ...]  # wood colours, the main one first
    fronts: tuple[Rgb, ...]  # colours of painted doors and drawers
    fabrics: tuple[Rgb, ...]  # colours of upholstery, bedding and curtains
    accents: tuple[Rgb, ...]  # colours of small bright objects
    metal: Rgb  # colour of legs, handles and taps


@dataclass(frozen=True)
class Placement:
    """A piece of furniture placed in a room. Its geoms are MJCF in the piece's own frame."""

    name: str  # type of furniture, such as "sofa"; bodies are named by room, type and number
    room: str
    geoms: str
    position: tuple[float, float, float]
    quarter_turns: int
    footprint: Rectangle | None  # rectangle in the house's frame, or None for pieces that hang or lie flat
    assets: tuple[Asset, ...] = ()
    turn: float = 0.0  # additional yaw in radians, such as that of a chair next to a desk


@dataclass(frozen=True)
class BinPlacement:
    """Pose of a bin. Its origin is in the middle of its base, and people use it from its local -y side.

    The bin is rotated by `quarter_turns` + 2, so that its back is to the south wall at 0, as for furniture.
    """

    receptacle: str  # catalogue key of the receptacle
    room: str
    place: str  # description shown to participants, such as "on the counter, beside the sink"
    position: tuple[float, float, float]
    quarter_turns: int


@dataclass(frozen=True)
class Furnishing:
    """All furniture and bins in a plan."""

    placements: tuple[Placement, ...]
    mounts: tuple[BinPlacement, ...]


def opposite(side: Side) -> Side:
    return SIDES[(SIDES.index(side) + 2) % 4]
