"""Pieces of furniture, and groups of pieces.

The origin of a piece is on the floor in the middle of its back edge. +y points into the room and
+z up. Lengths are in metres.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mjsim.generator.values import Asset

Spot = tuple[float, float, float, float]  # rectangle on the floor: x0, y0, x1 and y1 in metres


@dataclass(frozen=True)
class Obstacle:
    """A rectangle of floor that a piece covers or overhangs, with the height of the piece there."""

    spot: Spot
    top: float  # height in metres
    # Half width, in metres, of the pot or stand below leaves or a lampshade. 0 if the whole rectangle is an obstacle.
    stem: float = 0.0

    @property
    def hit(self) -> Spot:  # rectangle that people can bump into
        x0, y0, x1, y1 = self.spot
        x, y, r = (x0 + x1) / 2, (y0 + y1) / 2, self.stem
        return (x - r, y - r, x + r, y + r) if r else self.spot


@dataclass(frozen=True)
class Mount:
    """A position on a piece of furniture where a bin is placed."""

    receptacle: str  # catalogue key of the bin, such as "dish_bin"
    position: tuple[float, float, float]  # middle of the bin's base, in metres
    yaw: float = math.pi  # yaw of the bin in radians; the bin's front is its local -y side


@dataclass(frozen=True)
class DrawnTexture:
    """A texture drawn for one piece. Its material has the same name."""

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
    """A piece of furniture, or a group of pieces that belong together."""

    kind: str
    size: tuple[float, float, float]  # width along the wall, depth into the room and height, in metres
    geoms: str  # MJCF elements in the piece's frame
    parts: tuple[Obstacle, ...]
    use: tuple[Spot, ...] = ()  # floor where people stand to use the piece, which stays free and reachable
    # "wall", "left" or "right" (at a wall, with that end in a corner), "free", "hangs", "flat", "recess" or "ceiling"
    stands: str = "wall"
    seats: int = 0
    mounts: tuple[Mount, ...] = ()
    pictures: tuple[DrawnTexture, ...] = ()
    members: tuple["Member", ...] = ()  # members of a group, which has no geoms of its own


# A piece with its pose in the group: x and y in metres, and yaw in radians.
Member = tuple[Piece, float, float, float]


def moved(spot: Spot, x: float, y: float, yaw: float) -> Spot:
    """Rotate a rectangle by `yaw`, move it, and return its bounding rectangle in metres."""
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
    """Combine pieces into one whose back edge is at y = 0 and whose middle is at x = 0.

    `use` is in the frame of the group. `use` and `seats` default to those of the members.
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
    """Yield a piece and all members of groups, each with its pose."""
    if piece.geoms:
        yield piece, x, y, yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    for member, u, v, turn in piece.members:
        yield from flattened(member, x + cos * u - sin * v, y + sin * u + cos * v, yaw + turn)
