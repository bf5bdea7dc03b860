"""Kitchens that are composed of modules with a width of 0.6 m, and single pieces of kitchen furniture."""

import math

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Mount, Piece, group

# Lengths are in metres. Heights are measured from the floor, and depths from the wall.
WIDE = 0.6  # width of a kitchen module
SIZES = 4  # number of available kitchen sizes
DEEP = 0.62
TOP = 0.9
ON_TOP = 1.09  # maximum height of objects on the worktop, just below the sill of a kitchen window
TALL = 2.05  # height of fridges and tall ovens
LOW, HIGH = 1.5, 2.15  # bottom and top of wall cabinets; the bin that stands in the dish rack fits below
HOOD = 2.5  # top of the duct above a cooker hood
FRONT = 0.57  # distance from the wall to the cabinet fronts
GAP = 0.012  # gap between the doors of a fridge


class KitchenRun:
    """A row of kitchen modules along a wall. The method `_NAME(x)` adds the module NAME at x."""

    def __init__(self, b: Builder, modules: tuple[str, ...], hanging: bool) -> None:
        self.b, self.modules, self.hanging = b, modules, hanging
        self.w = WIDE * len(modules)
        self.mounts: list[Mount] = []
        self.parts: list[tuple[float, float, float, float, float]] = []

    def write(self) -> Piece:
        self.b.shadow(self.w, (0, DEEP))
        for i, name in enumerate(self.modules):
            x = WIDE * (i + 0.5) - self.w / 2
            top = getattr(self, f"_{name}")(x)
            if self.hanging and name in ("drawers", "doors", "dishwasher", "sink") and self.b.chance(0.85):
                top = self._hang(x)
            if name not in ("fridge", "tall_oven"):  # tiles that end below the window sill
                self.b.box("tile", WIDE, (0.0, 0.008), (TOP, LOW if top > LOW else TOP + 0.05), x, seen=True)
            self.parts.append((x - WIDE / 2, 0.0, x + WIDE / 2, DEEP, top))
        use = ((-self.w / 2, DEEP, self.w / 2, DEEP + 0.9),)
        size = (self.w, DEEP, max(LOW, *(part[4] for part in self.parts)))
        return self.b.piece(size, use=use, parts=self.parts, mounts=self.mounts)

    def _base(self, x: float, top: float = 0.86) -> float:
        self.b.box("dark", WIDE, (0.02, FRONT - 0.04), (0, 0.1), x)
        self.b.box("front_dark", WIDE, (0.0, FRONT), (0.1, top), x)
        if top == 0.86:
            self.b.box("stone", WIDE, (0.0, DEEP), (0.86, TOP), x)
        return TOP

    def _hang(self, x: float) -> float:
        b = self.b
        b.box("front_dark", WIDE - 0.004, (0, 0.32), (LOW, HIGH), x)
        b.fronts(b.front, WIDE - 0.004, (LOW, HIGH), 0.32, 1, 1, x, doors=True)
        return HIGH

    def _drawers(self, x: float) -> float:
        self.b.fronts(self.b.front, WIDE, (0.1, 0.85), FRONT, 1, 3, x)
        self._base(x)
        return self._top(x)

    def _top(self, x: float) -> float:
        self.b.top(WIDE, (0.0, DEEP), TOP, x, low=True)
        return ON_TOP

    def _doors(self, x: float) -> float:
        self.b.fronts(self.b.front, WIDE, (0.1, 0.85), FRONT, self.b.pick(1, 2), 1, x, doors=True)
        self._base(x)
        if not self.b.chance(0.6):
            return self._top(x)
        self.b.places.append((x, DEEP - 0.19, TOP))
        paint = self.b.pick("steel", "white", "accent_a", "black")  # material of a kettle or toaster
        if self.b.chance(0.5):
            self.b.post(paint, x, 0.14, (TOP, ON_TOP), 0.075)
            self.b.box("black", 0.03, (0.21, 0.25), (TOP + 0.04, ON_TOP - 0.02), x, seen=True)
        else:
            self.b.box(paint, 0.28, (0.06, 0.22), (TOP, ON_TOP - 0.02), x, seen=True)
        return ON_TOP

    def _rack(self, x: float) -> float:
        self.b.fronts(self.b.front, WIDE, (0.1, 0.85), FRONT, 1, 1, x, doors=True)
        self.mounts.append(Mount("dish_bin", (x, DEEP / 2 + 0.02, TOP)))
        return self._base(x)

    def _dishwasher(self, x: float) -> float:
        b = self.b
        paint = b.pick("steel", "white")
        b.box(paint, WIDE - 0.01, (FRONT, FRONT + 0.018), (0.11, 0.73), x, seen=True)
        b.box("dark", WIDE - 0.01, (FRONT, FRONT + 0.018), (0.735, 0.85), x, seen=True)
        b.box("chrome", 0.42, (FRONT + 0.018, FRONT + 0.04), (0.69, 0.71), x, seen=True)
        self._base(x)
        return self._top(x)

    def _sink(self, x: float) -> float:
        b, y = self.b, 0.3
        b.fronts(b.front, WIDE, (0.1, 0.85), FRONT, 2, 1, x, doors=True)
        self._base(x, 0.7)
        for side in (-1, 1):
            b.box("stone", 0.05, (0.0, DEEP), (0.7, TOP), x + side * (WIDE / 2 - 0.025))
            b.box("steel", 0.012, (0.11, 0.5), (0.715, TOP + 0.003), x + side * 0.244)
        for low, high in ((0.0, 0.11), (0.5, DEEP)):
            b.box("stone", WIDE - 0.1, (low, high), (0.7, TOP), x)
        for edge in (0.116, 0.494):
            b.box("steel", 0.476, (edge - 0.006, edge + 0.006), (0.715, TOP + 0.003), x)
        b.box("steel", 0.476, (0.122, 0.488), (0.7, 0.715), x, seen=True)
        b.post("dark", x, y, (0.715, 0.719), 0.035)
        b.post("chrome", x, 0.06, (TOP, TOP + 0.15), 0.014)
        b.rod("chrome", (x, 0.06, TOP + 0.15), (x, 0.2, TOP + 0.175), 0.012)
        b.rod("chrome", (x, 0.2, TOP + 0.175), (x, 0.26, TOP + 0.13), 0.012)
        b.post(b.pick(*b.look.accents), x + 0.22, 0.06, (TOP, TOP + 0.16), 0.028)
        return ON_TOP

    def _cooker(self, x: float) -> float:
        b = self.b
        b.box("black", 0.56, (0.05, 0.56), (TOP, TOP + 0.008), x, seen=True)
        for u, v, r in ((-0.14, 0.18, 0.075), (0.14, 0.18, 0.095), (-0.14, 0.42, 0.095), (0.14, 0.42, 0.075)):
            b.post("grey", x + u, v, (TOP + 0.008, TOP + 0.011), r)
        if "tall_oven" in self.modules:
            b.fronts(b.front, WIDE, (0.1, 0.85), FRONT, 1, 2, x)
        else:
            b.box("steel", WIDE - 0.01, (FRONT, FRONT + 0.018), (0.11, 0.85), x, seen=True)
            b.box("black", 0.48, (FRONT + 0.018, FRONT + 0.022), (0.2, 0.62), x, seen=True)
            b.box("chrome", 0.46, (FRONT + 0.018, FRONT + 0.045), (0.66, 0.685), x, seen=True)
            for i in range(4):
                b.disc("black", x - 0.18 + 0.12 * i, FRONT + 0.024, 0.775, 0.022, 0.02)
        self._base(x)
        if b.chance(0.5):
            b.post(b.pick("steel", "accent_a", "dark"), x - 0.14, 0.18, (TOP + 0.011, TOP + 0.12), 0.09)
        if self.hanging and b.chance(0.5):
            b.box("steel", WIDE - 0.004, (0, 0.45), (1.58, 1.66), x)
            b.box("steel", 0.26, (0, 0.26), (1.66, 2.5), x, seen=True)
            return HOOD
        if self.hanging:
            b.box("front_dark", WIDE - 0.004, (0, 0.32), (1.62, HIGH), x)
            b.fronts(b.front, WIDE - 0.004, (1.62, HIGH), 0.32, 1, 1, x)
            b.box("steel", WIDE - 0.004, (0, 0.36), (1.57, 1.618), x, seen=True)
            return HIGH
        return ON_TOP

    def _fridge(self, x: float) -> float:
        b = self.b
        paint, tall = b.pick("steel", "white", "front_dark", "black"), b.pick(1.8, 1.9, TALL)
        b.box(paint, WIDE - 0.01, (0.02, FRONT), (0, tall), x)
        split = b.pick(0.62, 0.75, 1.28)
        for low, high in ((0.04, split), (split + GAP, tall - 0.005)):
            b.box(paint, WIDE - 0.015, (FRONT, FRONT + 0.03), (low, high), x, seen=True)
            middle = high - 0.25 if low < 0.1 else low + 0.25
            handle = (middle - 0.16, middle + 0.16)
            b.box("chrome", 0.02, (FRONT + 0.03, FRONT + 0.05), handle, x + 0.24, seen=True)
        return tall

    def _tall_oven(self, x: float) -> float:
        b = self.b
        b.box("front_dark", WIDE, (0, FRONT), (0, TALL), x)
        b.fronts(b.front, WIDE, (0.1, 0.75), FRONT, 1, 2, x)
        for low, high in ((0.76, 1.3), (1.31, 1.66)):  # heights of the oven and the microwave
            b.box("steel", WIDE - 0.01, (FRONT, FRONT + 0.018), (low, high), x, seen=True)
            pane, handle = (low + 0.06, high - 0.12), (high - 0.08, high - 0.06)
            b.box("black", 0.44, (FRONT + 0.018, FRONT + 0.022), pane, x - 0.03, seen=True)
            b.box("chrome", 0.44, (FRONT + 0.018, FRONT + 0.042), handle, x - 0.03, seen=True)
        b.fronts(b.front, WIDE, (1.67, TALL - 0.01), FRONT, 1, 1, x)
        return TALL


_STRAIGHT = (  # alternative module rows for each kitchen size, starting with the largest size
    (
        "fridge drawers sink rack cooker doors dishwasher",
        "tall_oven doors cooker drawers rack sink fridge",
        "fridge doors cooker drawers sink rack doors",
    ),
    (
        "fridge sink rack doors cooker drawers",
        "fridge cooker drawers rack sink dishwasher",
        "tall_oven cooker drawers rack sink fridge",
    ),
    ("fridge sink rack cooker drawers", "fridge cooker drawers sink rack"),
    ("fridge cooker sink rack", "fridge cooker rack sink"),
)


def straight_kitchen(b: Builder) -> Piece:
    size = _size(b)
    modules = tuple(b.pick(*_STRAIGHT[size]).split())
    b.handle = b.pick("bar", "knob", "none")
    return KitchenRun(b, modules if b.chance(0.5) else modules[::-1], b.smaller < SIZES).write()


def _size(b: Builder) -> int:
    """Return a size index. The two smallest sizes are tried again without wall cabinets if nothing fits."""
    return b.smaller if b.smaller < SIZES else b.smaller - 2


def kitchenette(b: Builder) -> Piece:
    modules = b.pick(("sink", "rack", "cooker"), ("cooker", "rack", "sink"), ("rack", "sink", "cooker"))
    return KitchenRun(b, modules, b.smaller < 2).write()


def corner_kitchen(b: Builder) -> Piece:
    b.handle = b.pick("bar", "knob", "none")
    side = b.pick(-1, 1)
    longer = b.pick(("rack", "sink", "dishwasher", "fridge"), ("sink", "rack", "drawers", "doors", "fridge"))
    size = _size(b)
    if size:
        longer = ("rack", "sink", "fridge") if size < 3 else ("sink", "fridge")
    other = b.pick(("cooker", "drawers"), ("drawers", "cooker", "doors")) if size < 2 else ("cooker",)
    if size == 3:
        other = ("rack", "cooker")
    # The module in the corner of a kitchen has no appliance.
    modules = ("doors", *longer) if side < 0 else (*longer[::-1], "doors")
    run = KitchenRun(Builder("straight_kitchen", b.rng, b.look), modules, b.smaller < SIZES)
    leg = KitchenRun(Builder("straight_kitchen", b.rng, b.look), other if side > 0 else other[::-1], False)
    for r in (run, leg):
        r.b.front, r.b.handle, r.b.metal = b.front, b.handle, b.metal
    x = side * run.w / 2
    members = [(run.write(), 0.0, 0.0, 0.0), (leg.write(), x, DEEP + leg.w / 2, side * math.pi / 2)]
    inner = x - side * DEEP
    use = (
        (min(inner, -x), DEEP, max(inner, -x), DEEP + 0.9),
        (min(inner, inner - side * 0.9), DEEP, max(inner, inner - side * 0.9), DEEP + leg.w),
    )
    return group(b.kind, members, use=use, stands="right" if side > 0 else "left")


def fridge(b: Builder) -> Piece:
    return KitchenRun(b, ("fridge",), False).write()


def kitchen_trolley(b: Builder) -> Piece:
    w, d, h = b.size(0.5, 0.8, 0.1), b.pick(0.4, 0.45), 0.88
    paint = b.pick(b.metal, "white", b.wood)
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0, h - 0.03))
    b.box(b.wood, w, (0, d), (h - 0.04, h))
    b.legs(paint, w, (0, d), h - 0.04, 0.03, 0.016)
    for z in (0.12, 0.45):
        b.box(paint, w - 0.05, (0.03, d - 0.03), (z, z + 0.02), seen=True)
        b.clutter(w - 0.2, (0.1, d - 0.1), z + 0.02, 2)
    b.top(w, (0, d), h)
    return b.piece((w, d, h + 0.3), use=0.6)


def larder(b: Builder) -> Piece:
    w, d, h = b.pick(0.6, 0.9, 1.0), 0.5, b.pick(1.9, TALL)
    b.carcass("front_dark", w, d, (0, h))
    b.fronts(b.front, w, (0.08, 1.2), d - 0.035, 1 if w < 0.7 else 2, 1, doors=True)
    b.fronts(b.front, w, (1.2, h - 0.01), d - 0.035, 1 if w < 0.7 else 2, 1, doors=True)
    return b.piece((w, d, h), use=0.65)
