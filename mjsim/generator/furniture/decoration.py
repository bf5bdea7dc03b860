"""Decoration of walls, ceilings and floors: pictures, mirrors, rugs, curtains, radiators and lamps."""

import math

from mjsim.generator.furniture.artwork import carpet, painting
from mjsim.generator.furniture.builder import Builder, numbers
from mjsim.generator.furniture.piece import Piece
from mjsim.generator.values import CEILING_HEIGHT


def picture(b: Builder) -> Piece:
    many = b.pick(1, 1, 1, 1, 2, 3) if b.smaller == 0 else 1
    frame, border = b.pick(b.wood, "black", "white", b.metal), b.pick(0.02, 0.03, 0.05)
    w = b.pick(0.8, 1.0, 0.7) if many == 1 and not b.smaller else b.pick(0.4, 0.5)
    h = round(w * b.pick(0.75, 1.0, 1.33), 2) if w < 0.75 else round(0.75 * w, 2)
    middle, step = b.pick(1.5, 1.55, 1.6), w + b.pick(0.08, 0.12)
    for i in range(many):
        x = (i - (many - 1) / 2) * step
        image = painting(b.rng, b.look, 128, 96 if h < w else 128 if h == w else 160)
        b.box(frame, w, (0.0, 0.022), (middle - h / 2, middle + h / 2), x, seen=True)
        mat = 2 * border
        if border > 0.02 and b.chance(0.5):
            inner = (middle - h / 2 + border, middle + h / 2 - border)
            b.box("white", w - mat, (0.022, 0.025), inner, x, seen=True)
            mat += 0.1
        b.image(b.own(image), w - mat, (middle - h / 2 + mat / 2, middle + h / 2 - mat / 2), 0.03, x, 0.006)
    return b.piece((w + step * (many - 1), 0.03, middle + h / 2), parts=(), stands="hangs")


def wall_mirror(b: Builder) -> Piece:
    if b.chance(0.5):
        r = b.pick(0.28, 0.35)
        b.disc(b.pick(b.metal, b.wood), 0, 0.01, 1.55, r, 0.02)
        b.disc("mirror", 0, 0.022, 1.55, r - 0.03, 0.006)
        return b.piece((2 * r, 0.03, 1.55 + r), parts=(), stands="hangs")
    w, high = b.pick(0.4, 0.5), b.pick(1.2, 1.5)
    b.box(b.pick(b.metal, b.wood), w, (0, 0.02), (0.35, 0.35 + high), seen=True)
    b.image("mirror", w - 0.05, (0.375, 0.325 + high), 0.027, thick=0.007)
    return b.piece((w, 0.03, 0.35 + high), parts=(), stands="hangs")


def clock(b: Builder) -> Piece:
    r = b.pick(0.13, 0.16, 0.19)
    b.disc(b.pick("black", b.metal, b.wood, "white"), 0, 0.015, 1.85, r, 0.03)
    face = f'pos="0 0.031 1.85" size="{numbers(r - 0.012, 0.004)}" xyaxes="-1 0 0 0 0 1"'
    b.add("cylinder", "clock_face", True, face)
    return b.piece((2 * r, 0.036, 1.85 + r), parts=(), stands="hangs")


def pinboard(b: Builder) -> Piece:
    w, h = b.pick(0.6, 0.9), b.pick(0.45, 0.6)
    b.box(b.wood, w, (0, 0.018), (1.3, 1.3 + h), seen=True)
    b.image("pinboard", w - 0.04, (1.32, 1.28 + h), 0.026)
    return b.piece((w, 0.03, 1.3 + h), parts=(), stands="hangs")


def wall_shelf(b: Builder) -> Piece:
    w = b.size(0.5, 0.9, 0.1)
    for z in (1.45, 1.75)[: b.pick(1, 2)]:
        b.box(b.wood, w, (0, 0.2), (z, z + 0.025), seen=True)
        for x in (-w / 2 + 0.1, w / 2 - 0.1):
            b.box(b.metal, 0.02, (0, 0.16), (z - 0.02, z), x, seen=True)
        b.clutter(0.85 * w, (0.05, 0.17), z + 0.025)
    return b.piece((w, 0.2, 2.1), parts=(), stands="hangs")


def wall_lamp(b: Builder) -> Piece:
    b.box(b.metal, 0.08, (0, 0.02), (1.62, 1.74), seen=True)
    b.rod(b.metal, (0, 0.02, 1.68), (0, 0.13, 1.7), 0.01)
    if b.chance(0.5):
        b.soft("bulb", (0, 0.14, 1.74), (0.08, 0.08, 0.08))
    else:
        b.post("shade", 0, 0.14, (1.67, 1.85), 0.09)
    return b.piece((0.18, 0.24, 1.86), parts=(), stands="hangs")


def _on_floor(b: Builder, w: float, d: float, material: str, round_one: bool = False) -> Piece:
    """Create a flat piece on the floor. Its height of 3.5 mm keeps it below the underside of a plate."""
    if round_one:
        b.post(material, 0, d / 2, (0.0005, 0.0035), d / 2)
    else:
        b.box(material, w, (0, d), (0.0005, 0.0035), seen=True)
    return b.piece((w, d, 0.0035), parts=(), stands="flat")


def rug(b: Builder) -> Piece:
    w, d = b.pick((1.2, 0.8), (1.6, 1.1), (2.0, 1.4)) if b.smaller == 0 else (1.0, 0.7)
    if b.fit is not None:
        w, d, _ = b.fit
    return _on_floor(b, w, d, b.own(carpet(b.rng, b.look)))


def runner(b: Builder) -> Piece:
    w, d = b.pick((2.2, 0.7), (1.8, 0.6)) if b.smaller == 0 else (1.3, 0.6)
    return _on_floor(b, w, d, b.own(carpet(b.rng, b.look)))


def round_rug(b: Builder) -> Piece:
    d = b.pick(1.2, 1.5) if b.smaller == 0 else 0.9
    return _on_floor(b, d, d, b.own(carpet(b.rng, b.look, True)), True)


def bath_mat(b: Builder) -> Piece:
    return _on_floor(b, b.pick(0.7, 0.8), b.pick(0.45, 0.5), b.pick("towel_a", "towel_b", "towel_white"))


def door_mat(b: Builder) -> Piece:
    return _on_floor(b, b.pick(0.7, 0.8), 0.45, b.pick("soil", "wicker", "dark"))


def _window(b: Builder) -> tuple[float, float, float]:
    return b.fit or (1.4, 0.95, 2.15)


def curtains(b: Builder) -> Piece:
    """Create curtains on both sides of a window. The smaller version ends just below the sill."""
    w, low, high = _window(b)
    long = b.smaller == 0
    side, top = b.pick(0.24, 0.3), min(high + 0.14, CEILING_HEIGHT - 0.05)
    end = 0.03 if long else low - 0.15
    total = w + 2 * side
    for sign in (-1, 1):
        for i in range(2):
            x = sign * (w / 2 - 0.02 + side * (i + 0.5) / 2)
            depth = (0.07 + 0.012 * i, 0.115 + 0.012 * i)
            b.box("curtain", side / 2 - 0.004, depth, (end, top), x, seen=True)
    size = numbers(0.013, total / 2 + 0.05)
    b.add("cylinder", b.metal, True, f'pos="{numbers(0, 0.1, top + 0.012)}" size="{size}" euler="0 1.5708 0"')
    return b.piece((total + 0.1, 0.14, top + 0.03), parts=(), stands="hangs")


def roller_blind(b: Builder) -> Piece:
    w, low, high = _window(b)
    down = round(b.pick(0.2, 0.35) * (high - low), 2)
    b.box("white", w - 0.004, (-0.07, -0.01), (high - 0.07, high - 0.002), seen=True)
    cloth = b.pick("curtain", "linen", b.cloth)
    b.box(cloth, w - 0.03, (-0.044, -0.036), (high - down, high - 0.07), seen=True)
    b.box("white", w - 0.02, (-0.05, -0.03), (high - down - 0.02, high - down), seen=True)
    return b.piece((w, 0.0, high), parts=(), stands="recess")


def blind(b: Builder) -> Piece:
    w, low, high = _window(b)
    down = round(b.pick(0.15, 0.25, 0.35) * (high - low), 2)
    b.box("white", w - 0.004, (-0.07, -0.01), (high - 0.05, high - 0.002), seen=True)
    count = max(3, round(down / 0.05))
    slat = b.pick("white", "white", b.wood)
    for i in range(count):
        z = high - 0.05 - down * (i + 0.5) / count
        b.box(slat, w - 0.02, (-0.065, -0.02), (z, z + 0.008), seen=True)
    return b.piece((w, 0.0, high), parts=(), stands="recess")


def radiator(b: Builder) -> Piece:
    w, low, _ = _window(b)
    w, top = min(w, 1.4) - 0.1, min(low - 0.12, b.pick(0.6, 0.72))
    paint = b.pick("white", "white", "cream", "dark")
    b.box(paint, w, (0.03, 0.09), (0.12, top))
    if b.chance(0.5):
        count = round(w / 0.09)
        for i in range(count):
            b.box(paint, 0.05, (0.02, 0.1), (0.11, top + 0.01), w * ((i + 0.5) / count - 0.5), seen=True)
    else:
        b.box("ceramic_shade", w - 0.03, (0.035, 0.095), (0.16, top - 0.04), seen=True)
        b.box(paint, w + 0.02, (0.025, 0.1), (top - 0.02, top + 0.005), seen=True)
    b.post("chrome", w / 2 + 0.03, 0.06, (0.01, 0.2), 0.012)
    return b.piece((w + 0.1, 0.105, top + 0.01))


def ceiling_lamp(b: Builder) -> Piece:
    """Create a flat ceiling lamp. It is above the light source, so that it casts no shadow into the room."""
    form, z = b.pick("disc", "bowl", "square", "bar", "star"), CEILING_HEIGHT
    if form == "disc":
        b.post("bulb", 0, 0, (z - 0.05, z), b.pick(0.18, 0.24))
        b.post(b.metal, 0, 0, (z - 0.02, z), 0.27)
    elif form == "bowl":
        b.soft(b.pick("shade", "bulb"), (0, 0, z - 0.028), (0.24, 0.24, 0.03))
        b.post(b.metal, 0, 0, (z - 0.052, z), 0.02)
    elif form == "square":
        b.box(b.pick("white", b.wood), 0.5, (-0.25, 0.25), (z - 0.04, z), seen=True)
        b.box("bulb", 0.44, (-0.22, 0.22), (z - 0.05, z - 0.04), seen=True)
    else:
        for i in range(3):
            if form == "bar":
                b.post("bulb", 0.32 * (i - 1), 0, (z - 0.05, z - 0.02), 0.09)
            else:
                x, y = 0.2 * math.cos(2.1 * i), 0.2 * math.sin(2.1 * i)
                b.soft("bulb", (x, y, z - 0.024), (0.11, 0.11, 0.025))
        b.box(b.metal, 0.8 if form == "bar" else 0.12, (-0.06, 0.06), (z - 0.025, z), seen=True)
    b.on_ceiling()
    return b.piece((0.8, 0.62, z), parts=(), stands="ceiling")


def floor_lamp(b: Builder) -> Piece:
    form, tall, r = b.pick("stem", "tripod", "globe", "uplight"), b.pick(1.4, 1.55), 0.2
    b.shadow(0.32, (0.04, 0.36), round_one=True)
    b.guard(0.14, (r - 0.07, r + 0.07), (0, tall))
    if form == "tripod":
        for a in (0.5, 2.6, 4.7):
            b.rod(b.wood, (0.2 * math.cos(a), r + 0.16 * math.sin(a), 0), (0, r, tall - 0.2), 0.014)
    else:
        b.post(b.metal, 0, r, (0, 0.025), 0.15)
        b.post(b.metal, 0, r, (0.025, tall), 0.014)
    if form == "globe":
        b.soft("bulb", (0, r, tall + 0.1), (0.14, 0.14, 0.14))
    elif form == "uplight":
        b.soft(b.metal, (0, r, tall + 0.03), (0.17, 0.16, 0.05))
        b.post("bulb", 0, r, (tall + 0.055, tall + 0.07), 0.12)
    else:
        b.post("shade", 0, r, (tall - 0.1, tall + 0.18), b.pick(0.16, 0.2))
    return b.piece((0.4, 0.4, tall + 0.24), parts=((-0.17, 0, 0.17, 2 * r, tall + 0.24),), stem=0.07)


def standing_mirror(b: Builder) -> Piece:
    w, h = b.pick(0.45, 0.55, 0.65), b.pick(1.6, 1.75)
    b.shadow(w, (0, 0.08))
    b.box(b.pick(b.wood, b.metal), w, (0.01, 0.05), (0, h))
    b.image("mirror", w - 0.07, (0.035, h - 0.035), 0.058)
    return b.piece((w, 0.06, h), use=0.6)
