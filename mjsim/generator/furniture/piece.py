"""Data types for pieces of furniture and for groups of pieces.

The origin of a piece is on the floor in the middle of its back edge. The +y axis points into the
room, and the +z axis points up. Lengths are in metres.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mjsim.generator.values import Asset

Spot = tuple[float, float, float, float]  # rectangle on the floor (x0, y0, x1, y1), in metres


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


@dataclass(frozen=True)
class DrawnTexture:
    """A texture that is drawn for a single piece. Its material has the same name."""

    name: str
    png: bytes

    @property
    def assets(self) -> tuple[Asset, Asset]:
        image = f"{self.name}_image"
        texture = f'<texture name="{image}" type="2d" file="{image}.png"/>'
        material = f'<material name="{self.name}" texture="{image}"/>'
        return Asset(image, texture, self.png), Asset(self.name, material)


@dataclass(frozen=True)
class Piece:
    """A piece of furniture, or a group of pieces such as a table with chairs."""

    kind: str
    size: tuple[float, float, float]  # width along the wall, depth into the room and height, in metres
    geoms: str  # MJCF elements in the frame of the piece
    parts: tuple[Obstacle, ...]
    use: tuple[Spot, ...] = ()  # free floor that people need to use the piece
    # Position of the piece: "wall", "left", "right", "free", "hangs", "flat", "recess" or "ceiling".
    # Pieces with "left" or "right" stand at a wall, with that end in a corner of the room.
    stands: str = "wall"
    seats: int = 0
    mounts: tuple[Mount, ...] = ()
    pictures: tuple[DrawnTexture, ...] = ()
    members: tuple["Member", ...] = ()  # members of a group; a group has no geoms


# A piece and its pose in a group, with x and y in metres and yaw in radians.
Member = tuple[Piece, float, float, float]


def moved(spot: Spot, x: float, y: float, yaw: float) -> Spot:
    """Rotate and translate a rectangle. Return the bounding rectangle of the result, in metres."""
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = [(u, v) for u in (spot[0], spot[2]) for v in (spot[1], spot[3])]
    xs = [round(x + cos * u - sin * v, 4) for u, v in corners]
    ys = [round(y + sin * u + cos * v, 4) for u, v in corners]
    return min(xs), min(ys), max(xs), max(ys)


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
            u, v, _, _ = moved((*mount.position[:2], *mount.position[:2]), x + dx, y + dy, yaw)
            mounts.append(Mount(mount.receptacle, (u, v, mount.position[2]), mount.yaw + yaw))
    return Piece(
        kind,
        (right - left, front - back, max(p.size[2] for p, *_ in members)),
        "",
        tuple(Obstacle(moved(part.spot, dx, dy, 0), part.top, part.stem) for part in parts),
        tuple(moved(spot, dx, dy, 0) for spot in use),
        stands,
        sum(p.seats for p, *_ in members) if seats is None else seats,
        tuple(mounts),
        members=tuple((p, x + dx, y + dy, yaw) for p, x, y, yaw in members),
    )


def flattened(piece: Piece, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Iterator[Member]:
    """Yield a piece and the members of its nested groups, together with their poses."""
    if piece.geoms:
        yield piece, x, y, yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    for member, u, v, turn in piece.members:
        yield from flattened(member, x + cos * u - sin * v, y + sin * u + cos * v, yaw + turn)
