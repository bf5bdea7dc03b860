"""What the parts of the generator hand to one another, in metres.

The plan lies in x (east) and y (north). A `Room` is the free floor between its walls; neighbouring rooms lie `WALL`
apart, the thickness of the wall between them. Furniture is written in its own frame: the origin on the floor in the
middle of the back edge, +x along the wall, +y into the room, +z up. `quarter_turns` counter-clockwise turn that frame
into the house's: 0 for a piece with its back to the south wall, 1 to the east, 2 to the north, 3 to the west wall (see
`BACK`).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

WALL = 0.12  # between two rooms
OUTER_WALL = 0.21  # beyond the floor
HEIGHT = 2.6  # of the ceilings

Side = Literal["south", "east", "north", "west"]
SIDES: tuple[Side, ...] = ("south", "east", "north", "west")
BACK: Mapping[Side, int] = {
    "south": 0,
    "east": 1,
    "north": 2,
    "west": 3,
}  # quarter turns of what stands there
Rgb = tuple[float, float, float]


@dataclass(frozen=True)
class Rectangle:
    """An upright rectangle on the floor."""

    x0: float
    y0: float
    x1: float
    y1: float

    @property
    def width(self) -> float:
        """Extent in x."""
        return self.x1 - self.x0

    @property
    def depth(self) -> float:
        """Extent in y."""
        return self.y1 - self.y0

    @property
    def area(self) -> float:
        """In square metres."""
        return self.width * self.depth

    @property
    def center(self) -> tuple[float, float]:
        """The middle (x, y)."""
        return (self.x0 + self.x1) / 2, (self.y0 + self.y1) / 2

    def grown(self, by: float) -> "Rectangle":
        """With every side moved outwards, or inwards where `by` is negative."""
        return Rectangle(self.x0 - by, self.y0 - by, self.x1 + by, self.y1 + by)

    def overlaps(self, other: "Rectangle", slack: float = 1e-6) -> bool:
        """Whether they have more in common than a border."""
        return (
            self.x0 < other.x1 - slack
            and other.x0 < self.x1 - slack
            and self.y0 < other.y1 - slack
            and other.y0 < self.y1 - slack
        )

    def contains(self, x: float, y: float) -> bool:
        """Whether a point lies in it or on its border."""
        return self.x0 <= x <= self.x1 and self.y0 <= y <= self.y1

    def wall(self, side: Side) -> tuple[float, float]:
        """Where the wall of a side begins and ends, in x (south, north) or y (east, west)."""
        return (self.x0, self.x1) if side in ("south", "north") else (self.y0, self.y1)

    def along(self, side: Side, start: float, end: float, near: float, far: float) -> "Rectangle":
        """What lies along a wall from `start` to `end` (coordinates as of `wall`), `near` to `far` away from it."""
        if side == "south":
            return Rectangle(start, self.y0 + near, end, self.y0 + far)
        if side == "north":
            return Rectangle(start, self.y1 - far, end, self.y1 - near)
        if side == "west":
            return Rectangle(self.x0 + near, start, self.x0 + far, end)
        return Rectangle(self.x1 - far, start, self.x1 - near, end)


@dataclass(frozen=True)
class Room:
    """A room: all of its floor between the walls, which is one rectangle.

    Keys are `hall`, `living_room`, `kitchen`, `dining_room`, `bedroom`, `bedroom_2`, `bedroom_3`, `bathroom`,
    `shower_room`, `office`, `utility` and `studio`. Uses are the keys without numbers.
    """

    key: str
    use: str
    label: str  # shown to people
    floor: Rectangle


@dataclass(frozen=True)
class Leaf:
    """A door leaf that stands open, flat against a wall of `room`; furniture may not stand in `floor`."""

    room: str
    side: Side
    floor: Rectangle


@dataclass(frozen=True)
class Door:
    """A way between two rooms, or the front door, which is closed and has one room.

    The first room sees it in `side`, the second in the opposite one; `center` is x (south, north) or y (east, west).
    """

    rooms: tuple[str, ...]
    side: Side
    center: float
    width: float  # clear
    height: float
    leaf: Leaf | None = None

    @property
    def is_front(self) -> bool:
        """Whether it leads outside."""
        return len(self.rooms) == 1

    def side_in(self, room: str) -> Side:
        """The wall in which one of its rooms has it."""
        return self.side if room == self.rooms[0] else opposite(self.side)


@dataclass(frozen=True)
class Window:
    """A window in an outer wall of a room; `center` as of a door. Nothing higher than the sill stands before it."""

    room: str
    side: Side
    center: float
    width: float
    sill: float
    top: float


@dataclass(frozen=True)
class FloorPlan:
    """Rooms with all openings in their walls."""

    rooms: tuple[Room, ...]
    doors: tuple[Door, ...]
    windows: tuple[Window, ...]

    def room(self, key: str) -> Room:
        """The room of a key."""
        return next(room for room in self.rooms if room.key == key)

    def doors_of(self, room: str) -> tuple[Door, ...]:
        """The ways into a room, the front door included."""
        return tuple(door for door in self.doors if room in door.rooms)

    def windows_of(self, room: str) -> tuple[Window, ...]:
        """The windows of a room."""
        return tuple(window for window in self.windows if window.room == room)

    @property
    def area(self) -> float:
        """All floors, in square metres."""
        return sum(room.floor.area for room in self.rooms)


@dataclass(frozen=True)
class Asset:
    """A material or texture that a piece brings along.

    Every material of `models/houses/apartment/materials.xml` can be named without an asset, and its texture files too.
    Names are the same only where the content is; begin them with the kind's name, such as `rug_stripes_3f2a`.

    Attributes:
        name: Of the element.
        xml: One `<material .../>` or `<texture .../>`; textures name a file of the package's textures, or `image`.
        image: PNG bytes of a texture that is drawn for this house, written as `textures/<name>.png`.
    """

    name: str
    xml: str
    image: bytes | None = None


@dataclass(frozen=True)
class Palette:
    """The colours of a house, chosen once, so that its pieces go together."""

    woods: tuple[Rgb, ...]  # of furniture, the usual one first
    fronts: tuple[Rgb, ...]  # painted doors and drawers
    fabrics: tuple[Rgb, ...]  # upholstery, bedding, curtains
    accents: tuple[Rgb, ...]  # small bright things
    metal: Rgb  # legs, handles, taps


@dataclass(frozen=True)
class Placement:
    """A piece that stands in a room: MJCF of its geoms in its own frame, and where that lies."""

    name: str  # of the kind, such as "sofa"; bodies are named by room, kind and number
    room: str
    geoms: str
    position: tuple[float, float, float]
    quarter_turns: int
    footprint: Rectangle | None  # in the house, of what stands on the floor; None for what hangs or lies flat
    assets: tuple[Asset, ...] = ()
    turn: float = 0.0  # rad, in addition, for a chair that somebody left


@dataclass(frozen=True)
class Mount:
    """Where a bin stands: its origin is the middle of its base, and it is used from its local -y.

    The shell turns it by `quarter_turns` + 2, so that 0 has its back to the south wall, as for pieces.
    """

    receptacle: str  # key in the catalogue
    room: str
    place: str  # as people read it: "on the counter, beside the sink"
    position: tuple[float, float, float]
    quarter_turns: int


@dataclass(frozen=True)
class Furnishing:
    """All that `furnish(plan, bins, palette, seed)` put into a plan; it raises `HouseError` where a must does not fit.

    `bins` are receptacle keys of the apartment's catalogue, 3 to 6 by size of home. What `furnish` places for each (a
    desk with the office box, a run of kitchen units with the dish bin) is its own business. After a `HouseError` the
    caller tries another plan. Chance comes from `chance.stream(seed, "furniture", room.key)` and the like.
    """

    placements: tuple[Placement, ...]
    mounts: tuple[Mount, ...]


def opposite(side: Side) -> Side:
    """The side across."""
    return SIDES[(SIDES.index(side) + 2) % 4]
