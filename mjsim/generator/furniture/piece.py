"""Data types for pieces of furniture and for groups of pieces.

The origin of a piece is on the floor in the middle of its back edge. The +y axis points into the
room, and the +z axis points up. Lengths are in metres.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from mjsim.generator.furniture.drawn_boxes import Boxes, drawn_boxes
from mjsim.generator.values import Asset

Spot = tuple[float, float, float, float]  # rectangle on the floor (x0, y0, x1, y1), in metres
Point = tuple[float, float, float]
PUSHED = (0.24, 0.3, 0.36, 0.42, 0.5, 0.58)  # distances of a seat's back from a table's edge, in metres
SLACK = 0.003  # depth by which drawn geoms may overlap, such as table legs on a rug, in metres
BIN_SIZES = {  # width, depth and height of bins, in metres
    "dish_bin": (0.49, 0.48, 0.21),
    "laundry_hamper": (0.52, 0.53, 0.56),
    "office_box": (0.43, 0.35, 0.17),
    "recycling_bin": (0.51, 0.45, 0.5),
    "toy_box": (0.62, 0.47, 0.4),
    "bookshelf": (0.9, 0.34, 0.75),
}


@dataclass(frozen=True)
class Obstacle:
    """A rectangle of the floor that a piece of furniture covers or overhangs."""

    spot: Spot
    top: float  # height of the piece above the rectangle, in metres
    # Half width of the pot or stand below wider parts, in metres. 0 if the whole rectangle is an obstacle.
    stem: float = 0.0

    @property
    def hit(self) -> Spot:  # rectangle that people can bump into
        x0, y0, x1, y1 = self.spot
        x, y, r = (x0 + x1) / 2, (y0 + y1) / 2, self.stem
        return (x - r, y - r, x + r, y + r) if r else self.spot


@dataclass(frozen=True)
class Mount:
    """A place for a bin on a piece of furniture."""

    receptacle: str  # catalogue key of the bin, such as "dish_bin"
    position: tuple[float, float, float]  # centre of the bin's base, in metres
    yaw: float = math.pi  # yaw of the bin in radians; the bin faces its local -y direction

    @property
    def spot(self) -> Spot:
        w, d, _ = BIN_SIZES[self.receptacle]
        return moved((-w / 2, -d / 2, w / 2, d / 2), *self.position[:2], self.yaw)

    @property
    def stand(self) -> Spot:
        """The floor where a person stands to use the bin."""
        front = -BIN_SIZES[self.receptacle][1] / 2
        return moved((-0.2, front - 0.45, 0.2, front - 0.05), *self.position[:2], self.yaw)


@dataclass(frozen=True)
class DrawnTexture:
    """A texture for a single piece. Its material has the same name."""

    name: str
    draw: Callable[[], bytes] = field(compare=False)  # returns the PNG file

    @property
    def assets(self) -> tuple[Asset, Asset]:
        image = f"{self.name}_image"
        texture = f'<texture name="{image}" type="2d" file="{image}.png"/>'
        material = f'<material name="{self.name}" texture="{image}"/>'
        return Asset(image, texture, self.draw()), Asset(self.name, material)


@dataclass(frozen=True)
class Piece:
    """A piece of furniture, or a group of pieces such as a table with chairs."""

    kind: str
    size: tuple[float, float, float]  # width along the wall, depth into the room and height, in metres
    geoms: str  # MJCF elements in the frame of the piece
    parts: tuple[Obstacle, ...]
    use: tuple[Spot, ...] = ()  # floor that must stay free so that people can use the piece
    # Position of the piece: "wall", "left", "right", "free", "hangs", "flat", "recess" or "ceiling".
    # Pieces with "left" or "right" stand at a wall, with that end in a corner of the room.
    stands: str = "wall"
    seats: int = 0
    mounts: tuple[Mount, ...] = ()
    pictures: tuple[DrawnTexture, ...] = ()
    places: tuple[Point, ...] = ()  # free positions on top of the piece where objects can lie, in metres
    members: tuple["Member", ...] = ()  # pieces of a group, which has no geoms of its own

    @property
    def reached(self) -> list[Spot]:
        """The obstacles that people must be able to approach, which do not stand on another obstacle."""
        return [
            part.spot
            for part in self.parts
            if not any(other.top < part.top and overlap(other.spot, part.spot) for other in self.parts)
        ]

    @cached_property
    def drawn(self) -> Boxes:
        """The bounding boxes of all drawn geoms and bins, as rows of x0, y0, z0, x1, y1, z1 in metres."""
        boxes = [drawn_boxes(self.geoms), *(moved_boxes(p.drawn, x, y, yaw) for p, x, y, yaw in self.members)]
        for mount in self.mounts if not self.members else ():
            x0, y0, x1, y1 = mount.spot
            z = mount.position[2]
            boxes.append(np.array([[x0, y0, z, x1, y1, z + BIN_SIZES[mount.receptacle][2]]]))
        return np.concatenate(boxes)


# A piece and its pose in a group, with x and y in metres and yaw in radians.
Member = tuple[Piece, float, float, float]


def moved(spot: Spot, x: float, y: float, yaw: float) -> Spot:
    """Rotate and translate a rectangle. Return the bounding rectangle of the result, in metres."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = [(u, v) for u in (spot[0], spot[2]) for v in (spot[1], spot[3])]
    xs = [x + cos * u - sin * v for u, v in corners]
    ys = [y + sin * u + cos * v for u, v in corners]
    return round(min(xs), 4), round(min(ys), 4), round(max(xs), 4), round(max(ys), 4)


def moved_point(point: Point, x: float, y: float, yaw: float) -> Point:
    u, v, _, _ = moved((*point[:2], *point[:2]), x, y, yaw)
    return u, v, point[2]


def moved_boxes(boxes: Boxes, x: float, y: float, yaw: float) -> Boxes:
    """Rotate and translate boxes. Return the bounding boxes of the results, in metres."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    turn = np.array([[cos, -sin], [sin, cos]])
    middle, half = (boxes[:, :3] + boxes[:, 3:]) / 2, (boxes[:, 3:] - boxes[:, :3]) / 2
    middle[:, :2] = middle[:, :2] @ turn.T + (x, y)
    half[:, :2] = half[:, :2] @ np.abs(turn).T
    return np.hstack([middle - half, middle + half])


def intersect(boxes: Boxes, others: Boxes) -> bool:
    """Return True if any of `boxes` and any of `others` overlap by more than `SLACK`."""
    low, high = np.maximum(boxes[:, None, :3], others[:, :3]), np.minimum(boxes[:, None, 3:], others[:, 3:])
    return bool((high - low > SLACK).all(axis=-1).any())


def overlap(a: Sequence[float], b: Sequence[float]) -> bool:
    """Return True if two rectangles (x0, y0, x1, y1) overlap. Sharing an edge does not count."""
    return a[0] < b[2] and b[0] < a[2] and a[1] < b[3] and b[1] < a[3]


def pushed_in(members: list["Member"], seat: Piece, x: float, y: float, yaw: float) -> "Member":
    """Push a seat below the table in `members` as far as its geoms allow.

    The centre of the table's edge is at (x, y), and `yaw` is the direction in which a person would sit.
    """
    there = np.concatenate([moved_boxes(p.drawn, *pose) for p, *pose in members])
    for out in PUSHED:
        pose = x + out * math.sin(yaw), y - out * math.cos(yaw), yaw
        if not intersect(moved_boxes(seat.drawn, *pose), there):
            break
    return (seat, *pose)


def group(
    kind: str,
    members: Iterable[Member],
    *,
    use: tuple[Spot, ...] | None = None,
    stands: str = "wall",
    seats: int | None = None,
) -> Piece:
    """Combine pieces into a group whose back edge is at y = 0 and whose centre is at x = 0.

    `use` is in the same frame as the poses of the members. By default, `use` and `seats` are taken from the
    members.
    """
    members = list(members)
    parts = [
        Obstacle(moved(part.spot, x, y, yaw), part.top, part.stem)
        for p, x, y, yaw in members
        for part in p.parts
    ]
    spots = [part.spot for part in parts]
    left, right = min(s[0] for s in spots), max(s[2] for s in spots)
    back, front = min(s[1] for s in spots), max(s[3] for s in spots)
    dx, dy = -(left + right) / 2, -back
    if use is None:
        use = tuple(moved(spot, x, y, yaw) for p, x, y, yaw in members for spot in p.use)
    mounts = []
    for p, x, y, yaw in members:
        for mount in p.mounts:
            at = moved_point(mount.position, x + dx, y + dy, yaw)
            mounts.append(Mount(mount.receptacle, at, mount.yaw + yaw))
    places = [moved_point(at, x + dx, y + dy, yaw) for p, x, y, yaw in members for at in p.places]
    return Piece(
        kind,
        (right - left, front - back, max(p.size[2] for p, *_ in members)),
        "",
        tuple(Obstacle(moved(part.spot, dx, dy, 0), part.top, part.stem) for part in parts),
        tuple(moved(spot, dx, dy, 0) for spot in use),
        stands,
        sum(p.seats for p, *_ in members) if seats is None else seats,
        tuple(mounts),
        places=tuple(places),
        members=tuple((p, x + dx, y + dy, yaw) for p, x, y, yaw in members),
    )


def flattened(piece: Piece, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Iterator[Member]:
    """Yield a piece and the members of its nested groups, together with their poses."""
    if piece.geoms:
        yield piece, x, y, yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    for member, u, v, turn in piece.members:
        yield from flattened(member, x + cos * u - sin * v, y + sin * u + cos * v, yaw + turn)
