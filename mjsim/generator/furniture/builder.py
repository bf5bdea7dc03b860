"""A builder for the MJCF geoms of a piece of furniture."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from mjsim.generator.furniture.appearance import Appearance
from mjsim.generator.furniture.piece import DrawnTexture, Obstacle, Piece, Point, Spot

Span = tuple[float, float]
T = TypeVar("T")
FRONT = 0.035  # depth of cabinet doors and drawer fronts with their handles, in metres
PANEL = 0.016  # thickness of cabinet doors and drawer fronts, in metres
GAP = 0.008  # gap between cabinet doors or drawer fronts, in metres
_LOW = ("books", "bowl", "box", "candles")
_TALL = ("vase", "plant", "frame")
MAX_GAP = 0.25  # maximum height of a gap below furniture that is closed, in metres
SLOT = 0.36  # width of the surface that an object takes up, in metres
DEEP_TOP, SHALLOW_TOP = 0.5, 0.3  # depths in metres; see `Builder.top`
FACING = 'xyaxes="-1 0 0 0 0 1"'  # MJCF attribute that makes an image face +y


def numbers(*values: float) -> str:
    """Format numbers for MJCF, rounded to four decimals."""
    return " ".join(f"{round(float(v), 4) + 0.0:g}" for v in values)


def _extent(w: float, y: Span, z: Span, x: float) -> str:
    half = numbers(w / 2, (y[1] - y[0]) / 2, (z[1] - z[0]) / 2)
    return f'pos="{numbers(x, sum(y) / 2, sum(z) / 2)}" size="{half}"'


class Builder:
    """A builder that collects the geoms of a piece of furniture, in the frame of the piece.

    In all methods, `w` is the width along x, `x` is the centre, and `y` and `z` are intervals, all in metres.
    Geoms with `seen` are drawn but do not collide. Geoms from `guard` collide but are not drawn.
    """

    def __init__(
        self,
        kind: str,
        rng: np.random.Generator,
        look: Appearance,
        smaller: int = 0,
        fit: Point | None = None,
    ) -> None:
        self.kind, self.rng, self.look, self.smaller, self.fit = kind, rng, look, smaller, fit
        self.geoms: list[str] = []
        self.pictures: list[DrawnTexture] = []
        self.places: list[Point] = []
        self.wood, self.wood2 = self.pick(*look.woods), self.pick(*look.woods)
        self.cloth, self.cloth2 = self.pick(*look.cloths), self.pick(*look.cloths)
        self.front, self.metal = self.pick(*look.fronts), self.pick(*look.metals)
        self.handle = self.pick("bar", "knob", "none", "bar")

    def pick(self, *options: T) -> T:
        return options[int(self.rng.integers(len(options)))]

    def size(self, low: float, high: float, step: float = 0.05) -> float:
        """Draw a random length from `low` to `high`, in metres. Smaller versions have a lower maximum."""
        count = round((high - low) / step)
        drawn = int(self.rng.integers(count + 1))
        return round(low + step * max(0, min(drawn, round(count * (1 - 0.5 * self.smaller)))), 4)

    def chance(self, share: float) -> bool:
        return bool(self.rng.random() < share)

    def add(self, shape: str, material: str, seen: bool, attributes: str) -> None:
        kind = "" if shape == "box" else f' type="{shape}"'
        label = ' class="decor"' if seen else ""
        self.geoms.append(f'<geom{label}{kind} material="{material}" {attributes}/>')

    def box(self, material: str, w: float, y: Span, z: Span, x: float = 0.0, *, seen: bool = False) -> None:
        self.add("box", material, seen, _extent(w, y, z, x))
        if not seen:
            self._close_gap(w, y, z[0], x)

    def guard(self, w: float, y: Span, z: Span, x: float = 0.0) -> None:
        self.geoms.append(f'<geom class="guard" {_extent(w, y, z, x)}/>')

    def _close_gap(self, w: float, y: Span, height: float, x: float) -> None:
        """Close a low gap below a part with an invisible box, because no hand could reach an object in the gap."""
        if 0 < height <= MAX_GAP:
            self.guard(w, y, (0, height), x)

    def post(self, material: str, x: float, y: float, z: Span, radius: float, *, seen: bool = True) -> None:
        half = numbers(radius, (z[1] - z[0]) / 2)
        self.add("cylinder", material, seen, f'pos="{numbers(x, y, sum(z) / 2)}" size="{half}"')
        if not seen:
            self._close_gap(1.5 * radius, (y - 0.75 * radius, y + 0.75 * radius), z[0], x)

    def rod(self, material: str, start: Point, end: Point, radius: float, *, shape: str = "cylinder") -> None:
        self.add(shape, material, True, f'fromto="{numbers(*start, *end)}" size="{numbers(radius)}"')

    def soft(self, material: str, at: Point, half: Point, turn: Point = (0.0, 0.0, 0.0)) -> None:
        euler = f' euler="{numbers(*turn)}"' if any(turn) else ""
        self.add("ellipsoid", material, True, f'pos="{numbers(*at)}" size="{numbers(*half)}"{euler}')

    def disc(self, material: str, x: float, y: float, z: float, radius: float, thick: float = 0.012) -> None:
        """Add a disc that faces the room and has its centre at depth `y`."""
        size = numbers(radius, thick / 2)
        self.add("cylinder", material, True, f'pos="{numbers(x, y, z)}" size="{size}" euler="1.5708 0 0"')

    def image(self, material: str, w: float, z: Span, y: float, x: float = 0.0, thick: float = 0.008) -> None:
        """Add a panel with an image that faces the room and has its front at depth `y`."""
        middle = numbers(x, y - thick / 2, sum(z) / 2)
        half = numbers(w / 2, (z[1] - z[0]) / 2, thick / 2)
        self.add("box", material, True, f'pos="{middle}" size="{half}" {FACING}')

    def shadow(self, w: float, y: Span, x: float = 0.0, *, round_one: bool = False) -> None:
        """Add a contact shadow. Its height varies slightly, so that overlapping shadows do not flicker."""
        height = 0.0038 + 0.0001 * int(self.rng.integers(12))
        material = ' material="shadow_round"' if round_one else ""
        half = numbers(w / 2 + 0.1, (y[1] - y[0]) / 2 + 0.09, 0.1)
        self.geoms.append(
            f'<geom class="shadow"{material} pos="{numbers(x, sum(y) / 2 + 0.02, height)}" size="{half}"/>'
        )

    def legs(
        self, material: str, w: float, y: Span, height: float, inset: float, radius: float = 0.022
    ) -> None:
        square = self.chance(0.5)
        for sx in (-1, 1):
            for v in (y[0] + inset, y[1] - inset):
                u = sx * (w / 2 - inset)
                if square:
                    self.box(material, 2 * radius, (v - radius, v + radius), (0, height), u, seen=True)
                else:
                    self.post(material, u, v, (0, height), radius)

    def fronts(
        self, material: str, w: float, z: Span, y: float, columns: int, rows: int = 1, x: float = 0.0,
        doors: bool = False,
    ) -> None:  # fmt: skip
        """Add a grid of drawer fronts or doors with handles. The backs of the fronts are at depth `y`."""
        wide, high = (w - GAP) / columns, (z[1] - z[0] - GAP) / rows
        for i in range(columns):
            for j in range(rows):
                u, v = x - w / 2 + GAP / 2 + wide * (i + 0.5), z[0] + GAP / 2 + high * (j + 0.5)
                span = (v - high / 2 + GAP / 2, v + high / 2 - GAP / 2)
                self.box(material, wide - GAP, (y, y + PANEL), span, u, seen=True)
                self._handle(u, v, y + PANEL, wide, high, (1 if i % 2 == 0 else -1) if doors else 0)

    def _handle(self, u: float, v: float, y: float, wide: float, high: float, side: int) -> None:
        out = (y - 0.002, y + 0.016)
        if self.handle == "none":
            return
        if side:
            u += side * (wide / 2 - 0.045)
            v += 0.0 if high > 1.2 else (0.2 * high if v < 0.8 else -0.25 * high)
        if self.handle == "knob":
            self.box(self.metal, 0.026, out, (v - 0.013, v + 0.013), u, seen=True)
        elif side:
            length = min(0.16, 0.3 * high)
            self.box(self.metal, 0.014, out, (v - length / 2, v + length / 2), u, seen=True)
        else:
            self.box(self.metal, min(0.18, 0.4 * wide), out, (v - 0.007, v + 0.007), u, seen=True)

    def clutter(self, w: float, y: Span, z: float, most: int = 3, x: float = 0.0) -> None:
        """Add a row of small objects on a surface, as the method `thing` makes them."""
        places = int(np.clip(w // 0.35, 1, most))
        for i in range(int(self.rng.integers(1, places + 1))):
            u = x + w * ((i + 0.5) / places - 0.5) + 0.05 * float(self.rng.uniform(-1, 1))
            self.thing(u, sum(y) / 2, z)

    def top(self, w: float, y: Span, z: float, x: float = 0.0, *, low: bool = False) -> None:
        """Decorate a surface that people can reach, and mark places where further objects can lie.

        The places are in front of the decoration if the surface is deep, and next to it otherwise.
        """
        deep, slots = y[1] - y[0] > DEEP_TOP, max(1, int(w // SLOT))
        first = int(self.rng.integers(2))
        for i in range(slots):
            u, is_decorated = x + w * ((i + 0.5) / slots - 0.5), i % 2 == first
            if y[1] - y[0] >= SHALLOW_TOP and (deep or not is_decorated):
                self.places.append((u, max(y[1] - 0.19, sum(y) / 2), z))
            if self.chance(0.6) if deep else is_decorated:
                self.thing(u, y[0] + 0.15 if deep else sum(y) / 2, z, low)

    def thing(self, x: float, y: float, z: float, low: bool = False) -> None:
        """Add a small object on a surface of height `z`. If `low` is True, it is at most 0.13 m tall."""
        getattr(self, f"_{self.pick(*_LOW, *(() if low else _TALL))}")(x, y, z)

    def _frame(self, x: float, y: float, z: float) -> None:
        self.box(self.wood, 0.15, (y - 0.01, y + 0.01), (z, z + 0.2), x, seen=True)
        picture = self.pick(*self.look.accents, "cream")
        self.box(picture, 0.11, (y + 0.01, y + 0.013), (z + 0.02, z + 0.18), x, seen=True)

    def _vase(self, x: float, y: float, z: float) -> None:
        tall = float(self.rng.uniform(0.07, 0.1))
        self.soft(self.pick(*self.look.accents), (x, y, z + tall), (0.6 * tall, 0.6 * tall, tall))
        if self.chance(0.5):
            self.soft(self.pick("leaves", "accent_a", "accent_b"), (x, y, z + 2.1 * tall), (0.08, 0.08, 0.09))

    def _plant(self, x: float, y: float, z: float) -> None:
        self.post(self.pick("pot_a", "pot_b"), x, y, (z, z + 0.1), 0.055)
        leaves = self.pick("leaves", "leaves_dark", "leaves_pale")
        self.soft(leaves, (x, y, z + 0.18), (0.1, 0.09, self.pick(0.1, 0.12)))

    def _books(self, x: float, y: float, z: float) -> None:
        for i, (w, d) in enumerate(((0.22, 0.15), (0.19, 0.14), (0.17, 0.12))[: self.pick(2, 3)]):
            span = (z + 0.03 * i, z + 0.03 * (i + 1) - 0.001)
            self.box(self.pick(*self.look.accents), w, (y - d / 2, y + d / 2), span, x + 0.01 * i, seen=True)

    def _bowl(self, x: float, y: float, z: float) -> None:
        self.soft(self.pick("ceramic", *self.look.accents), (x, y, z + 0.035), (0.12, 0.11, 0.035))
        if self.chance(0.6):
            for fruit, u, v in (("accent_a", -0.04, 0.01), ("accent_b", 0.04, 0.02), ("accent_c", 0, -0.04)):
                self.soft(fruit, (x + u, y + v, z + 0.075), (0.035, 0.035, 0.035))

    def _box(self, x: float, y: float, z: float) -> None:
        material = self.pick("wicker", self.cloth2, "white")
        self.box(material, 0.22, (y - 0.08, y + 0.08), (z, z + 0.11), x, seen=True)

    def _candles(self, x: float, y: float, z: float) -> None:
        for u, tall in ((-0.05, 0.13), (0.02, 0.09)):
            self.post("cream", x + u, y, (z, z + tall), 0.025)

    def lamp(self, x: float, y: float, z: float) -> None:
        self.soft(self.pick("ceramic", *self.look.accents), (x, y, z + 0.1), (0.07, 0.07, 0.1))
        self.post("shade", x, y, (z + 0.2, z + 0.37), self.pick(0.1, 0.12))

    def pillow(self, material: str, at: Point, half: Point, tilt: float = 0.0) -> None:
        """Add a cushion, which is an ellipsoid around a box so that it looks square."""
        self.soft(material, at, half, (tilt, 0.0, 0.0))
        euler = f' euler="{numbers(tilt, 0, 0)}"' if tilt else ""
        core = numbers(0.9 * half[0], 0.62 * half[1], 0.9 * half[2])
        self.add("box", material, True, f'pos="{numbers(*at)}" size="{core}"{euler}')

    def draw(self, kind: "Callable[[Builder], Piece]", smaller: int = 0, fit: Point | None = None) -> Piece:
        """Create a piece of another kind with the same random generator and materials."""
        return kind(Builder(kind.__name__.strip("_"), self.rng, self.look, smaller, fit))

    def carcass(self, material: str, w: float, d: float, z: Span) -> None:
        """Add the body of a cabinet of depth `d` behind its fronts, and its contact shadow."""
        self.shadow(w, (0, d))
        self.box(material, w, (0, d - FRONT), z)

    def own(self, picture: DrawnTexture) -> str:
        """Register a texture for this piece, and return the name of its material."""
        self.pictures.append(picture)
        return picture.name

    def on_ceiling(self) -> None:
        """Mark all geoms added so far as parts of the ceiling, which top-down views omit."""
        self.geoms = [geom.replace('class="decor"', 'class="lamp"') for geom in self.geoms]

    def piece(
        self,
        size: Sequence[float],
        *,
        use: float | Sequence[Spot] = 0.0,
        parts: Sequence[tuple[float, float, float, float, float]] | None = None,
        stem: float = 0.0,
        **more: Any,
    ) -> Piece:
        """Create a piece of furniture from all geoms added so far.

        Args:
            size: Width along the wall, depth into the room and height, in metres.
            use: Depth of the free floor in front of the piece, or rectangles (x0, y0, x1, y1) of free floor,
                in metres.
            parts: Obstacles (x0, y0, x1, y1, height) in metres. By default, one of the whole size.
            stem: Half width of the pot or stand below wider parts, in metres. Only this is an obstacle.
            more: Values for other fields of `Piece`.
        """
        w, d, h = (float(v) for v in size)
        if parts is None:
            parts = ((-w / 2, 0.0, w / 2, d, h),)
        if isinstance(use, float | int):
            use = ((-w / 2, d, w / 2, d + float(use)),) if use else ()
        return Piece(
            self.kind,
            (w, d, h),
            "".join(self.geoms),
            tuple(Obstacle((a, b, c, e), top, stem) for a, b, c, e, top in parts),
            tuple(use),
            mounts=tuple(more.pop("mounts", ())),
            pictures=tuple(self.pictures),
            places=tuple(self.places),
            **more,
        )


@dataclass(frozen=True)
class Kind:
    """A type of furniture, which can create random pieces."""

    name: str
    draw: Callable[[Builder], Piece]

    def make(
        self, rng: np.random.Generator, look: Appearance, *, smaller: int = 0, fit: Point | None = None
    ) -> Piece:
        """Create a random piece of this type.

        Args:
            rng: Random generator for the size, materials and shape.
            look: Materials of the home's furniture.
            smaller: 0 for the full size, and larger numbers for smaller versions.
            fit: Width, lower end and upper end of the window or gap that the piece has to fit, in metres.
        """
        return self.draw(Builder(self.name, rng, look, smaller, fit))
