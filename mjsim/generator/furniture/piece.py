"""Pieces of furniture as values, and groups of them.

The frame of a piece: the origin is the middle of its back edge on the floor, +y points into the room, z up; metres.
"""

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from mjsim.generator.values import Asset

Spot = tuple[float, float, float, float]  # x0, y0, x1, y1 on the floor


@dataclass(frozen=True)
class Part:
    """A part of the floor that a piece stands on, or hangs over, with the height of what is there."""

    spot: Spot  # m
    top: float  # m
    stem: float = (
        0.0  # m, half the width of what people bump into, where leaves or a shade reach farther; 0: all of it
    )

    @property
    def hit(self) -> Spot:
        """What people bump into."""
        x0, y0, x1, y1 = self.spot
        x, y, r = (x0 + x1) / 2, (y0 + y1) / 2, self.stem
        return (x - r, y - r, x + r, y + r) if r else self.spot


@dataclass(frozen=True)
class Mount:
    """A place for a bin on a piece."""

    receptacle: str  # its model, such as "dish_bin"
    position: tuple[float, float, float]  # m, of the middle of its base
    yaw: float = math.pi  # of the bin, whose front is its local -y


@dataclass(frozen=True)
class Picture:
    """A texture that a piece brings, and the material of the same name."""

    name: str  # of the material
    png: bytes  # the texture's file

    @property
    def assets(self) -> tuple[Asset, Asset]:
        """Texture and material."""
        image = f"{self.name}_image"
        texture = f'<texture name="{image}" type="2d" file="{image}.png"/>'
        material = f'<material name="{self.name}" texture="{image}"/>'
        return Asset(image, texture, self.png), Asset(self.name, material)


@dataclass(frozen=True)
class Piece:
    """A piece of furniture, or a group that belongs together."""

    kind: str  # name of its kind
    size: tuple[float, float, float]  # along the wall, into the room, up, m
    geoms: str  # MJCF elements in the frame of the piece
    parts: tuple[Part, ...]  # what nobody can walk through
    use: tuple[Spot, ...] = ()  # where somebody stands to use it: stays free, and can be reached
    stands: str = (
        "wall"  # "wall", "left" and "right" (that end in a corner), "free", "hangs", "flat", "recess"
    )
    seats: int = 0  # how many can sit
    mounts: tuple[Mount, ...] = ()  # for bins
    pictures: tuple[Picture, ...] = ()  # its own textures
    members: tuple["Member", ...] = ()  # of a group, which has no geoms of its own


Member = tuple[Piece, float, float, float]  # a piece, and where in its group: x, y, m, and yaw


def moved(spot: Spot, x: float, y: float, yaw: float) -> Spot:
    """The rectangle around a rectangle that is turned by `yaw` and then moved, m."""
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
    """Pieces that belong together as one piece, moved so that its back edge is at y = 0 and its middle at x = 0.

    `use` in the frame of the group; by default the members' own, and so are the `seats`.
    """
    members = list(members)
    parts = [
        Part(moved(part.spot, x, y, yaw), part.top, part.stem) for p, x, y, yaw in members for part in p.parts
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
        tuple(Part(moved(part.spot, dx, dy, 0), part.top, part.stem) for part in parts),
        tuple(moved(spot, dx, dy, 0) for spot in use),
        stands,
        sum(p.seats for p, *_ in members) if seats is None else seats,
        tuple(mounts),
        members=tuple((p, x + dx, y + dy, yaw) for p, x, y, yaw in members),
    )


def flattened(piece: Piece, x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> Iterator[Member]:
    """A piece and all members of groups, each with where it stands."""
    if piece.geoms:
        yield piece, x, y, yaw
    cos, sin = math.cos(yaw), math.sin(yaw)
    for member, u, v, turn in piece.members:
        yield from flattened(member, x + cos * u - sin * v, y + sin * u + cos * v, yaw + turn)
