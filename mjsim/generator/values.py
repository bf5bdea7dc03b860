"""Data types that are shared by the modules of the house generator. All lengths are in metres.

In floor plans, x points east and y points north. A `Room` is the free floor between its walls, and
neighbouring rooms are `WALL` apart. Each piece of furniture has its own frame. The origin is on the floor in
the middle of the back edge, +x points along the wall, +y into the room, and +z up. The frame is rotated
counter-clockwise by a number of `quarter_turns` (see `BACK`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

WALL = 0.12
OUTER_WALL = 0.21  # distance from the floor's edge to the outer face of an outer wall
CEILING_HEIGHT = 2.6

Side = Literal["south", "east", "north", "west"]
SIDES: tuple[Side, ...] = ("south", "east", "north", "west")
# Number of quarter turns of a piece whose back faces the given wall.
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

    @property
    def spot(self) -> tuple[float, float, float, float]:
        return self.x0, self.y0, self.x1, self.y1

    def grown(self, by: float) -> "Rectangle":
        """Return the rectangle with all sides moved outwards by a distance, which may be negative."""
        return Rectangle(self.x0 - by, self.y0 - by, self.x1 + by, self.y1 + by)

    def overlaps(self, other: "Rectangle", slack: float = 1e-6) -> bool:
        """Return True if the rectangles overlap. Sharing an edge does not count."""
        return (
            self.x0 < other.x1 - slack
            and other.x0 < self.x1 - slack
            and self.y0 < other.y1 - slack
            and other.y0 < self.y1 - slack
        )

    def contains(self, x: float, y: float) -> bool:
        """Return True if a point is inside the rectangle or on its border."""
        return self.x0 <= x <= self.x1 and self.y0 <= y <= self.y1

    def wall(self, side: Side) -> tuple[float, float]:
        """Return the start and end coordinates of a wall, in x for south and north walls, otherwise in y."""
        return (self.x0, self.x1) if side in ("south", "north") else (self.y0, self.y1)

    def along(self, side: Side, start: float, end: float, near: float, far: float) -> "Rectangle":
        """Return the rectangle between two positions along a wall and between two distances from it."""
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

    The possible keys are `hall`, `living_room`, `kitchen`, `dining_room`, `bedroom`, `bedroom_2`,
    `bedroom_3`, `bathroom`, `shower_room`, `office`, `utility` and `studio`. The use of a room is its key
    without the number.
    """

    key: str
    use: str
    label: str  # name that is shown to participants
    floor: Rectangle


@dataclass(frozen=True)
class Leaf:
    """An open door leaf that rests against a wall of `room`. Furniture must not cover `floor`."""

    room: str
    side: Side
    floor: Rectangle


@dataclass(frozen=True)
class Door:
    """A doorway between two rooms, or the closed front door of the home.

    The front door belongs to one room only. A door is in the wall `side` of its first room. Its `center` is
    an x coordinate for south and north walls, otherwise a y coordinate.
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
    """A window in an outer wall. Furniture in front of a window is lower than its sill."""

    room: str
    side: Side
    center: float
    width: float
    sill: float
    top: float


@dataclass(frozen=True)
class HomePlan:
    """The floor plan of a home, with rooms, doors and windows."""

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
    def bounds(self) -> Rectangle:
        """The smallest rectangle that contains the floors of all rooms."""
        floors = [room.floor for room in self.rooms]
        low = min(f.x0 for f in floors), min(f.y0 for f in floors)
        return Rectangle(*low, max(f.x1 for f in floors), max(f.y1 for f in floors))

    @property
    def area(self) -> float:
        return sum(room.floor.area for room in self.rooms)


@dataclass(frozen=True)
class Asset:
    """A MuJoCo material or texture that furniture uses.

    Materials in `models/houses/apartment/materials.xml` need no asset. Assets with the same name must be
    equal, so names should begin with the furniture type, as in `rug_stripes_3f2a`.

    Attributes:
        xml: A `<material .../>` or `<texture .../>` element. A texture names a packaged file or has an image.
        image: PNG bytes of a texture for this house only. They are written to `textures/<name>.png`.
    """

    name: str
    xml: str
    image: bytes | None = None


@dataclass(frozen=True)
class Palette:
    """The colours of a home's furniture, which match each other."""

    woods: tuple[Rgb, ...]  # wood colours, starting with the main colour
    fronts: tuple[Rgb, ...]  # colours of painted doors and drawers
    fabrics: tuple[Rgb, ...]  # colours of upholstery, bedding and curtains
    accents: tuple[Rgb, ...]  # colours of small bright objects
    metal: Rgb  # colour of legs, handles and taps


@dataclass(frozen=True)
class Placement:
    """A piece of furniture in a room, with its MJCF geoms in the frame of the piece."""

    name: str  # type of furniture, such as "sofa"
    room: str
    geoms: str
    position: tuple[float, float, float]
    quarter_turns: int
    assets: tuple[Asset, ...] = ()
    turn: float = 0.0  # additional yaw in radians, for example of a chair at a desk


@dataclass(frozen=True)
class BinPlacement:
    """The pose of a bin in a room. The origin is the centre of its base, and its front faces along -y.

    The bin is rotated by `quarter_turns` + 2, so that its back faces the south wall at 0 quarter turns.
    """

    receptacle: str  # catalogue key of the receptacle
    room: str
    place: str  # description that is shown to participants, such as "on the desk"
    position: tuple[float, float, float]
    quarter_turns: int


@dataclass(frozen=True)
class Furnishing:
    """All furniture and bins in a home."""

    placements: tuple[Placement, ...]
    mounts: tuple[BinPlacement, ...]
    places: tuple[tuple[float, float, float], ...] = ()  # positions on furniture where objects can lie


def opposite(side: Side) -> Side:
    return SIDES[(SIDES.index(side) + 2) % 4]
