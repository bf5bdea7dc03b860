"""Convert a floor plan to MJCF elements of the floors, walls, ceilings, doors and windows.

The elements use the default classes of the apartment. A wall between two rooms consists of two halves, each
in the colour of its room. Outer walls are outside the rooms.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from mjsim.generator.openings import LEAF_DEPTH, NARROW_SILL, gaps, wall_stretches
from mjsim.generator.palette import WET
from mjsim.generator.values import (
    CEILING_HEIGHT,
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

HALF = WALL / 2
TILED = NARROW_SILL  # height of wall tiles, in metres
_NORMAL = {"south": "y", "north": "y", "east": "x", "west": "x"}
_SHADOW_TURN = {"south": 0.0, "north": math.pi, "west": -math.pi / 2, "east": math.pi / 2}


@dataclass(frozen=True)
class _Hole:
    start: float
    end: float
    bottom: float
    top: float


def shell(plan: HomePlan) -> Iterator[str]:
    """Yield the MJCF elements of all rooms, and panels that show the view outside."""
    for room in plan.rooms:
        cell = room.floor.grown(HALF)
        (x, y), w, d = cell.center, cell.width / 2, cell.depth / 2
        yield (
            f'<body name="{room.key}/structure">\n{room_shell(plan, room)}\n'
            f'<geom name="{room.key}/floor" class="floor" material="floor_{room.key}" '
            f'pos="{_n(x)} {_n(y)} -0.05" size="{_n(w)} {_n(d)} 0.05"/>\n'
            f'<geom name="{room.key}/ceiling" class="ceiling" '
            f'pos="{_n(x)} {_n(y)} {_n(CEILING_HEIGHT + 0.05)}" size="{_n(w)} {_n(d)} 0.05"/>\n</body>'
        )
        yield f'<site name="room:{room.key}" class="room" pos="{_n(x)} {_n(y)} 1" size="{_n(w)} {_n(d)} 1"/>'
    yield from _outside(plan)


def room_shell(plan: HomePlan, room: Room) -> str:
    """Return the MJCF geoms of a room's walls, doors and windows."""
    return "\n".join(_RoomShell(plan, room).elements())


class _RoomShell:
    def __init__(self, plan: HomePlan, room: Room) -> None:
        self._plan, self._room = plan, room
        self._cells = [other.floor.grown(HALF) for other in plan.rooms]
        self._count = 0

    def elements(self) -> Iterator[str]:
        for side in SIDES:
            holes = sorted(self._holes(side), key=lambda hole: hole.start)
            low, high = self._room.floor.wall(side)
            for up, material in self._bands(holes):
                yield from self._wall(side, (low - HALF, high + HALF), up, (0.0, HALF), material, holes)
            for start, end, is_outside in wall_stretches(self._room, side, self._plan.rooms):
                if is_outside:
                    along = start - self._extension(side, start, -1), end + self._extension(side, end, 1)
                    yield from self._wall(
                        side, along, (0.0, CEILING_HEIGHT), (HALF, OUTER_WALL), "facade", holes
                    )
            yield from self._foot(side, holes)
        for window in self._plan.windows_of(self._room.key):
            yield from self._window(window)
        for door in self._plan.doors_of(self._room.key):
            yield from self._front(door) if door.is_front else self._frame(door)
            if door.leaf and door.leaf.room == self._room.key:
                yield from self._leaf(door.leaf, door)

    def _holes(self, side: Side) -> Iterator[_Hole]:
        for door in self._plan.doors_of(self._room.key):
            if door.side_in(self._room.key) == side:
                yield _Hole(door.center - door.width / 2, door.center + door.width / 2, 0.0, door.height)
        for w in self._plan.windows_of(self._room.key):
            if w.side == side:
                yield _Hole(w.center - w.width / 2, w.center + w.width / 2, w.sill, w.top)

    def _bands(self, holes: list[_Hole]) -> Iterator[tuple[tuple[float, float], str]]:
        """Yield the height range and the material of each horizontal band of a wall.

        Textures are centred on each box, so they have seams around openings. To hide the seams, tiles end
        below windows, and wallpaper is used only on walls without openings.
        """
        paper = f"wall_{self._room.key}"
        if self._room.use in WET:
            yield (0.0, TILED), paper
            yield (TILED, CEILING_HEIGHT), f"{paper}_plain"
        else:
            yield (0.0, CEILING_HEIGHT), f"{paper}_plain" if holes else paper

    def _extension(self, side: Side, end: float, sign: int) -> float:
        """Return how much longer an outer wall must be to close a corner of the house, in metres."""
        edge = {"south": "y0", "north": "y1", "west": "x0", "east": "x1"}[side]
        across = getattr(self._room.floor.grown(HALF), edge)
        points = [(end + sign * 0.05, across + beyond) for beyond in (-0.05, 0.05)]
        if side in ("east", "west"):
            points = [(y, x) for x, y in points]
        is_corner = not any(cell.contains(*point) for cell in self._cells for point in points)
        return OUTER_WALL - HALF if is_corner else 0.0

    def _slab(
        self, side: Side, along: tuple[float, float], up: tuple[float, float], out: tuple[float, float],
        material: str, kind: str = "wall",
    ) -> str:  # fmt: skip
        """Return a box along a wall, at depths from `out[0]` to `out[1]` behind the wall's inner face."""
        box = self._room.floor.along(side, *along, -out[1], -out[0])
        (x, y), z = box.center, sum(up) / 2
        length, depth = (box.width, box.depth) if _NORMAL[side] == "y" else (box.depth, box.width)
        self._count += 1
        return (
            f'<geom name="{self._room.key}/{kind}_{self._count}" class="{kind}_{_NORMAL[side]}" '
            f'material="{material}" pos="{_n(x)} {_n(y)} {_n(z)}" '
            f'size="{_n(length / 2)} {_n((up[1] - up[0]) / 2)} {_n(depth / 2)}"/>'
        )

    def _wall(
        self, side: Side, along: tuple[float, float], up: tuple[float, float], out: tuple[float, float],
        material: str, holes: list[_Hole],
    ) -> Iterator[str]:  # fmt: skip
        at, end = along
        for hole in holes:
            if hole.end < at or hole.start > end or hole.bottom >= up[1] or hole.top <= up[0]:
                continue
            for stretch, height in (
                ((at, hole.start), up),
                ((hole.start, hole.end), (hole.top, up[1])),
                ((hole.start, hole.end), (up[0], hole.bottom)),
            ):
                if min(stretch[1] - stretch[0], height[1] - height[0]) > 1e-6:
                    yield self._slab(side, stretch, height, out, material)
            at = hole.end
        if end > at + 1e-6:
            yield self._slab(side, (at, end), up, out, material)

    def _foot(self, side: Side, holes: list[_Hole]) -> Iterator[str]:
        doors = [(hole.start - 0.05, hole.end + 0.05) for hole in holes if hole.bottom == 0]
        for start, end in gaps(*self._room.floor.wall(side), doors):
            if end - start > 0.1:
                yield self._slab(side, (start, end), (0.0, 0.09), (-0.012, 0.0), "skirting", "trim")
                x, y = self._room.floor.along(side, start, end, 0.0, 0.34).center
                yield (
                    f'<geom class="shadow" material="shadow_edge" pos="{_n(x)} {_n(y)} 0.002" '
                    f'size="{_n((end - start) / 2)} 0.17 0.1" euler="0 0 {_n(_SHADOW_TURN[side])}"/>'
                )

    def _window(self, window: Window) -> Iterator[str]:
        side, half = window.side, window.width / 2
        left, right, sill, top = window.center - half, window.center + half, window.sill, window.top
        yield self._slab(side, (left, right), (sill, top), (0.10, 0.13), "glass", "wall")
        bars = [
            ((left, left + 0.05), (sill, top)),
            ((right - 0.05, right), (sill, top)),
            ((left, right), (sill, sill + 0.05)),
            ((left, right), (top - 0.05, top)),
        ]
        if window.width > 1.0:
            bars.append(((window.center - 0.025, window.center + 0.025), (sill, top)))
        for along, up in bars:
            yield self._slab(side, along, up, (0.08, 0.15), "frame", "trim")
        # The sill ends slightly above the wall below, so that the two surfaces do not flicker.
        board = (left - 0.03, right + 0.03), (sill - 0.03, sill + 0.004)
        yield self._slab(side, *board, (-0.04, 0.15), "frame", "trim")

    def _frame(self, door: Door) -> Iterator[str]:
        side, half = door.side_in(self._room.key), door.width / 2
        left, right, top, out = door.center - half, door.center + half, door.height, (-0.018, HALF)
        yield self._slab(side, (left - 0.06, left + 0.012), (0.0, top + 0.06), out, "frame", "trim")
        yield self._slab(side, (right - 0.012, right + 0.06), (0.0, top + 0.06), out, "frame", "trim")
        yield self._slab(side, (left + 0.012, right - 0.012), (top - 0.012, top + 0.06), out, "frame", "trim")

    def _front(self, door: Door) -> Iterator[str]:
        side, half = door.side, door.width / 2
        left, right, top = door.center - half, door.center + half, door.height
        yield self._slab(side, (left, right), (0.0, top), (0.02, 0.07), "entrance")
        for up in ((0.2, 0.95), (1.15, 1.85)):
            for along in ((left + 0.1, door.center - 0.05), (door.center + 0.05, right - 0.1)):
                yield self._slab(side, along, up, (0.012, 0.02), "entrance_panel", "trim")
        for along in ((left - 0.06, left + 0.004), (right - 0.004, right + 0.06)):
            yield self._slab(side, along, (0.0, top + 0.06), (-0.018, 0.02), "frame", "trim")
        yield self._slab(side, (left, right), (top - 0.004, top + 0.06), (-0.018, 0.02), "frame", "trim")
        x, y = self._room.floor.along(side, right - 0.12, right - 0.06, -0.02, 0.04).center
        yield f'<geom class="decor" type="sphere" material="brass" pos="{_n(x)} {_n(y)} 1.02" size="0.032"/>'

    def _leaf(self, leaf: Leaf, door: Door) -> Iterator[str]:
        low, high = leaf.floor.wall(leaf.side)
        yield self._slab(leaf.side, (low, high), (0.005, door.height - 0.03), (-LEAF_DEPTH, -0.015), "door")
        for up in ((0.2, 0.9), (1.1, 1.8)):
            along = low + 0.13, high - 0.13
            yield self._slab(leaf.side, along, up, (-LEAF_DEPTH - 0.006, -LEAF_DEPTH), "door_panel", "trim")


def _outside(plan: HomePlan) -> Iterator[str]:
    around: Rectangle = plan.bounds.grown(3)
    sides: tuple[Side, ...] = ("north", "south", "west", "east")
    for side in sides:
        low, high = around.wall(side)
        x, y = around.along(side, low, high, 0, 0).center
        length = (high - low) / 2 - (0.02 if _NORMAL[side] == "y" else 0.0)
        yield (
            f'<geom name="outside/{side}" group="1" class="trim_{_NORMAL[side]}" material="view_{side}" '
            f'pos="{_n(x)} {_n(y)} 1.1" size="{_n(length)} 2.6 0.01"/>'
        )


def _n(value: float) -> str:
    return f"{round(value, 4) + 0.0:.4f}".rstrip("0").rstrip(".")
