"""Potted plants that stand on the floor."""

import math

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Piece

_GREENS = ("leaves", "leaves_dark", "leaves_pale")


def _pot(b: Builder, r: float, h: float, y: float) -> str:
    b.shadow(2 * r, (y - r, y + r), round_one=True)
    paint, form = b.pick("pot_a", "pot_b", "wicker"), b.pick("round", "round", "square", "raised")
    if form == "square":
        b.box(paint, 1.8 * r, (y - 0.9 * r, y + 0.9 * r), (0, h))
    else:
        low = 0.12 if form == "raised" else 0.0
        b.post(paint, 0, y, (low, h), r - 0.005, seen=False)
        if low:
            b.legs(b.wood, 2 * r, (y - r, y + r), h - 0.06, 0.02, 0.014)
    b.post("soil", 0, y, (h, h + 0.004), 0.82 * r)
    return b.pick(*_GREENS)


def _potted(b: Builder, r: float, wide: float, tall: float) -> Piece:
    """Create a plant with a pot of radius `r` and leaves of radius `wide`. Only the pot is an obstacle."""
    reach = max(r, 0.8 * wide)  # keeps other furniture out of the leaves
    return b.piece(
        (2 * wide, 2 * wide, tall), parts=((-reach, wide - reach, reach, wide + reach, tall),), stem=r
    )


def bush(b: Builder) -> Piece:
    r, h = b.pick(0.16, 0.19, 0.22), b.pick(0.26, 0.34)
    wide = 1.25 * r
    green = _pot(b, r, h, wide)
    b.soft(green, (0, wide, h + wide), (wide, wide, 1.1 * wide))
    b.soft(green, (0.3 * r, wide + 0.2 * r, h + 2.1 * wide), (0.7 * wide, 0.7 * wide, 0.8 * wide))
    return _potted(b, r, wide, h + 3 * wide)


def tree(b: Builder) -> Piece:
    r, h, tall, y = b.pick(0.17, 0.2), b.pick(0.3, 0.38), b.size(1.3, 1.8, 0.1), 0.3
    green = _pot(b, r, h, y)
    b.rod("wood_b", (0, y, h), (0.02, y + 0.02, tall - 0.2), 0.02)
    for u, v, up, size in ((0.0, 0.0, 0.0, 0.26), (-0.1, 0.06, -0.22, 0.18), (0.1, -0.06, 0.16, 0.19))[
        : b.pick(2, 3)
    ]:
        b.soft(green, (u, y + v, tall - 0.1 + up), (size, size, size))
    return _potted(b, r, y, tall + 0.35)


def snake_plant(b: Builder) -> Piece:
    r, h, tall, y = b.pick(0.14, 0.17), b.pick(0.24, 0.3), b.pick(0.5, 0.65), 0.22
    green = _pot(b, r, h, y)
    for i in range(7):
        a, out, long = 2.4 * i, 0.02 + 0.012 * i, tall / 2 * (1 - 0.05 * i)
        at = (1.5 * out * math.cos(a), y + out * math.sin(a), h + long)
        b.soft(green, at, (0.035, 0.014, long), (0, 0.12 * math.cos(a), a))
    return _potted(b, r, y, h + tall)


def palm(b: Builder) -> Piece:
    r, h, tall, y = b.pick(0.16, 0.19), b.pick(0.28, 0.34), b.pick(1.0, 1.25), 0.42
    green = _pot(b, r, h, y)
    for i in range(9):
        a, reach, top = 0.7 * i, 0.27 if i % 2 else 0.2, tall - 0.08 * (i % 3)
        u, v = reach * math.cos(a), reach * math.sin(a)
        b.rod(green, (0, y, h), (0.5 * u, y + 0.5 * v, top), 0.007)
        b.soft(green, (0.8 * u, y + 0.8 * v, top), (0.2, 0.05, 0.02), (0, 0.5, a))
    return _potted(b, r, y, tall + 0.15)


def cactus(b: Builder) -> Piece:
    r, h, tall, y = b.pick(0.13, 0.16), b.pick(0.22, 0.28), b.pick(0.5, 0.75), 0.2
    _pot(b, r, h, y)
    b.rod("leaves_dark", (0, y, h), (0, y, h + tall), 0.07, shape="capsule")
    for side in (-1, 1)[: b.pick(1, 2)]:
        z = h + tall * b.pick(0.4, 0.55)
        b.rod("leaves_dark", (0, y, z), (side * 0.14, y, z), 0.04, shape="capsule")
        b.rod("leaves_dark", (side * 0.14, y, z), (side * 0.14, y, z + 0.2), 0.04, shape="capsule")
    return _potted(b, r, y, h + tall + 0.07)


def fern_stand(b: Builder) -> Piece:
    r, h, y = 0.16, b.pick(0.7, 0.85), 0.3
    b.shadow(2 * r, (y - r, y + r), round_one=True)
    b.guard(2 * r, (y - r, y + r), (0, h + 0.2))
    b.post(b.wood, 0, y, (h - 0.025, h), r)
    b.legs(b.wood, 2 * r, (y - r, y + r), h - 0.025, 0.05, 0.014)
    b.post(b.pick("pot_a", "pot_b"), 0, y, (h, h + 0.17), 0.11)
    green = b.pick(*_GREENS)
    b.soft(green, (0, y, h + 0.24), (0.2, 0.19, 0.1))
    for i in range(6):
        a = 1.05 * i
        at = (0.19 * math.cos(a), y + 0.18 * math.sin(a), h + 0.17)
        b.soft(green, at, (0.11, 0.035, 0.03), (0, 0.6, a))
    return _potted(b, r, y, h + 0.36)
