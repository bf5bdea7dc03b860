"""Sofas, armchairs, chairs, stools and benches. The back edge of each seat is at y = 0."""

import math

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Piece


def _arms(b: Builder, w: float, d: float, form: str, cloth: str) -> float:
    wide = {"box": 0.17, "round": 0.2, "thin": 0.1, "none": 0.0}[form]
    for side in (-1, 1) if wide else ():
        x = side * (w - wide) / 2
        if form == "round":
            b.box(cloth, wide, (0.02, d - 0.04), (0.06, 0.54), x)
            b.rod(cloth, (x, 0.12, 0.54), (x, d - 0.12, 0.54), wide / 2, shape="capsule")
        elif form == "thin":
            b.box(b.wood, wide, (0.05, d - 0.03), (0.56, 0.6), x)
            for y in (0.08, d - 0.1):
                b.box(b.wood, 0.05, (y, y + 0.05), (0, 0.56), x, seen=True)
        else:
            b.box(cloth, wide, (0.02, d), (0.06, 0.6), x)
    return wide


def _cushions(b: Builder, w: float, y: tuple[float, float], count: int, cloth: str, x: float = 0.0) -> None:
    wide = w / count
    for i in range(count):
        u = x + w * ((i + 0.5) / count - 0.5)
        b.box(cloth, wide - 0.012, y, (0.28, 0.45), u)
        b.places.append((u, y[1] - 0.2, 0.45))
        b.soft(cloth, (u, sum(y) / 2, 0.42), (wide / 2 - 0.01, (y[1] - y[0]) / 2 - 0.01, 0.045))
        b.pillow(cloth, (u, y[0] + 0.07, 0.62), (wide / 2 - 0.015, 0.11, 0.2), -0.18)


def _loose(b: Builder, w: float, y: float, most: int) -> None:
    for side in (-1, 1)[: int(b.rng.integers(0, most + 1))]:
        cloth = b.pick(*b.look.cloths, "linen")
        b.pillow(cloth, (side * (w / 2 - 0.22), y, 0.6), (0.19, 0.075, 0.18), -0.35)


def sofa(b: Builder) -> Piece:
    w, d = b.size(1.5, 2.2, 0.1), b.pick(0.86, 0.92, 0.96)
    form = b.pick("box", "round", "thin", "none")
    back = b.pick(0.76, 0.82, 0.86)
    b.shadow(w, (0, d))
    wide = _arms(b, w, d, form, b.cloth)
    seat = w - 2 * wide
    low = 0.04 if b.chance(0.4) else 0.13
    b.box(b.cloth, seat, (0.02, d - 0.02), (low, 0.28))
    b.box(b.cloth, seat - 0.004, (0, 0.2), (low, back))
    if b.chance(0.5):
        b.rod(b.cloth, (-seat / 2 + 0.09, 0.1, back), (seat / 2 - 0.09, 0.1, back), 0.095, shape="capsule")
        back += 0.1
    if low > 0.1:
        b.legs(b.pick(b.wood, b.metal), w, (0, d), low, 0.08, 0.024)
    _cushions(b, seat, (0.2, d), 2 if w < 1.9 else b.pick(2, 3), b.pick(b.cloth, b.cloth, b.cloth2))
    _loose(b, seat, 0.36, 2)
    return b.piece((w, d, back), use=0.65, seats=2 if w < 1.75 else 3)


def corner_sofa(b: Builder) -> Piece:
    w, d, long, side = b.size(2.1, 2.6, 0.1), 0.92, b.pick(1.45, 1.6), b.pick(-1, 1)
    b.shadow(w, (0, d))
    end = 0.92
    x = side * (w - end) / 2
    b.shadow(end, (d, long), x)
    rest = w - end
    b.box(b.cloth, rest, (0, d - 0.02), (0.06, 0.28), x - side * w / 2)
    b.box(b.cloth, end, (0, long), (0.06, 0.28), x)
    b.box(b.cloth, w, (0, 0.2), (0.28, 0.78))
    b.box(b.cloth, 0.17, (0.2, d), (0.28, 0.6), -side * (w - 0.17) / 2)
    b.box(b.cloth, 0.17, (0.2, long - 0.3), (0.28, 0.62), side * (w - 0.17) / 2)
    top = b.pick(b.cloth, b.cloth, b.cloth2)
    _cushions(b, rest - 0.17, (0.2, d), b.pick(1, 2), top, -side * (end - 0.17) / 2)
    b.box(top, end - 0.18, (0.2, long), (0.28, 0.43), x - side * 0.09)
    b.pillow(top, (x - side * 0.09, 0.27, 0.62), (0.36, 0.11, 0.2), -0.18)
    _loose(b, w - 0.4, 0.38, 2)
    inner = x - side * end / 2
    parts = ((-w / 2, 0, w / 2, d, 0.85), (x - end / 2, d, x + end / 2, long, 0.62))
    free = (min(inner, -side * w / 2), d, max(inner, -side * w / 2), d + 0.65)
    return b.piece((w, long, 0.85), use=(free,), parts=parts, seats=4)


def armchair(b: Builder) -> Piece:
    w, d = b.size(0.74, 0.9), b.pick(0.78, 0.84)
    form = b.pick("box", "round", "thin", "shell", "none")
    back = b.pick(0.78, 0.88, 1.0)
    b.shadow(w, (0, d), round_one=form == "shell")
    if form == "shell":  # a round seat whose back consists of upright rolls
        r = min(w, d) / 2 - 0.02
        b.post(b.cloth, 0, d / 2, (0.14, 0.3), r, seen=False)
        for i in range(11):
            a = math.pi * (0.1 * i)
            x, y = (r - 0.07) * math.cos(a), d / 2 - (r - 0.07) * math.sin(a)
            b.rod(b.cloth, (x, y, 0.26), (x, y, 0.62 + 0.1 * math.sin(a)), 0.07, shape="capsule")
        b.guard(2 * r, (d / 2 - r, d / 2 - 0.1), (0.3, 0.75))
        b.soft(b.cloth2, (0, d / 2 + 0.04, 0.36), (r - 0.1, r - 0.08, 0.09))
        b.legs(b.wood, 1.5 * r, (d / 2 - 0.7 * r, d / 2 + 0.7 * r), 0.16, 0.05)
        return b.piece((w, d, 0.8), use=0.5, seats=1)
    wide = _arms(b, w, d, form, b.cloth)
    seat = w - 2 * wide
    b.box(b.cloth, seat, (0.03, d - 0.03), (0.13, 0.3))
    b.box(b.cloth, seat - 0.004, (0.0, 0.14), (0.13, back))
    b.rod(b.cloth, (0.06 - seat / 2, 0.07, back), (seat / 2 - 0.06, 0.07, back), 0.07, shape="capsule")
    b.box(b.cloth2, seat - 0.02, (0.14, d - 0.02), (0.3, 0.43))
    b.places.append((0.0, d - 0.22, 0.43))
    b.soft(b.cloth2, (0, d / 2 + 0.05, 0.41), (seat / 2 - 0.02, d / 2 - 0.12, 0.035))
    b.legs(b.wood, w, (0, d), 0.14, 0.07)
    if b.chance(0.6):
        b.pillow(b.pick(*b.look.cloths, "linen"), (0, 0.22, 0.6), (0.18, 0.075, 0.17), -0.3)
    return b.piece((w, d, back + 0.07), use=0.5, seats=1)


def pouf(b: Builder) -> Piece:
    r, h = b.pick(0.22, 0.26, 0.3), b.pick(0.36, 0.42)
    b.shadow(2 * r, (0, 2 * r), round_one=True)
    if b.chance(0.6):
        b.post(b.cloth, 0, r, (0.02, h - 0.05), r - 0.005, seen=False)
        b.soft(b.cloth, (0, r, h - 0.06), (r - 0.002, r - 0.002, 0.06))
    else:
        b.box(b.cloth, 2 * r, (0, 2 * r), (0.06, h - 0.04))
        b.soft(b.cloth, (0, r, h - 0.05), (r - 0.005, r - 0.005, 0.05))
        b.legs(b.wood, 2 * r, (0, 2 * r), 0.06, 0.05)
    return b.piece((2 * r, 2 * r, h), seats=1)


def dining_chair(b: Builder) -> Piece:
    w, d, h = 0.44, 0.48, b.pick(0.82, 0.9, 0.96)
    form = b.pick("padded", "bars", "ladder", "shell")
    b.guard(w, (0.02, d), (0, 0.46))
    b.guard(w, (0.0, 0.06), (0.46, h))
    if form == "shell":
        paint = b.pick("white", b.front, b.cloth)
        b.soft(paint, (0, 0.27, 0.44), (0.22, 0.21, 0.04))
        b.soft(paint, (0, 0.06, 0.66), (0.21, 0.05, 0.2), (0.12, 0, 0))
        for x in (-0.15, 0.15):
            for y in (0.12, 0.42):
                b.rod(b.pick(b.wood, b.metal), (1.2 * x, y, 0.006), (0.7 * x, 0.27, 0.43), 0.014)
        return b.piece((w, d, h), seats=1)
    b.box(b.wood, w, (0.04, d), (0.42, 0.455), seen=True)
    b.legs(b.wood, w, (0.02, d), 0.42, 0.03, 0.018)
    for x in (-w / 2 + 0.025, w / 2 - 0.025):
        b.box(b.wood, 0.035, (0.02, 0.055), (0.42, h), x, seen=True)
    if form == "padded":
        b.box(b.cloth, w - 0.08, (0.015, 0.06), (0.56, h - 0.02), seen=True)
        b.soft(b.cloth, (0, d / 2 + 0.02, 0.46), (w / 2 - 0.02, d / 2 - 0.04, 0.035))
        return b.piece((w, d, h), seats=1)
    b.box(b.wood, w, (0.018, 0.052), (h - 0.1, h + 0.003), seen=True)
    if form == "ladder":
        for z in (0.55, 0.68):
            b.box(b.wood, w - 0.06, (0.024, 0.046), (z, z + 0.05), seen=True)
    else:
        for x in (-0.1, 0.0, 0.1):
            b.box(b.wood, 0.022, (0.026, 0.048), (0.455, h - 0.1), x, seen=True)
    if b.chance(0.6):
        b.soft(b.cloth, (0, d / 2 + 0.02, 0.462), (w / 2 - 0.03, d / 2 - 0.05, 0.025))
    return b.piece((w, d, h), seats=1)


def stool(b: Builder) -> Piece:
    r, h = b.pick(0.16, 0.19), b.pick(0.45, 0.48)
    b.shadow(2 * r, (0, 2 * r), round_one=True)
    if b.chance(0.5):
        b.post(b.wood, 0, r, (h - 0.035, h), r, seen=False)
    else:
        b.box(b.wood, 2 * r, (0, 2 * r), (h - 0.035, h))
    if b.chance(0.5):
        b.soft(b.cloth, (0, r, h), (r - 0.01, r - 0.01, 0.03))
    b.legs(b.wood, 2 * r, (0, 2 * r), h - 0.035, 0.06, 0.016)
    return b.piece((2 * r, 2 * r, h + 0.03), seats=1)


def bar_stool(b: Builder) -> Piece:
    r, h = 0.19, b.pick(0.64, 0.72)
    b.guard(2 * r, (0, 2 * r), (0, h))
    b.post(b.pick(b.wood, b.cloth, "black"), 0, r, (h - 0.05, h), r - 0.01)
    if b.chance(0.5):
        b.post(b.metal, 0, r, (0.015, h - 0.05), 0.025)
        b.post(b.metal, 0, r, (0, 0.015), r - 0.01)
    else:
        b.legs(b.pick(b.wood, b.metal), 2 * r, (0, 2 * r), h - 0.05, 0.06, 0.016)
        b.box(b.metal, 0.26, (r - 0.13, r + 0.13), (0.22, 0.235), seen=True)
    if b.chance(0.5):
        b.box(b.cloth, 0.3, (0, 0.04), (h, h + 0.24), seen=True)
        return b.piece((2 * r, 2 * r, h + 0.24), seats=1)
    return b.piece((2 * r, 2 * r, h), seats=1)


def bench(b: Builder) -> Piece:
    w, d, h = b.size(0.8, 1.2, 0.1), b.pick(0.36, 0.4), 0.46
    b.shadow(w, (0, d))
    form = b.pick("box", "baskets", "legs")
    if form == "box":
        b.box(b.wood, w, (0, d - 0.02), (0.02, h - 0.04))
        b.fronts(b.front, w, (0.05, h - 0.06), d - 0.035, 2 if w > 0.9 else 1)
    else:
        b.box(b.wood, w, (0, d), (h - 0.07, h - 0.03))
        b.legs(b.wood, w, (0, d), h - 0.07, 0.04)
        if form == "baskets":
            b.box(b.wood, w - 0.02, (0.02, d - 0.02), (0.06, 0.08), seen=True)
            for x in (-w / 4, w / 4):
                b.box("wicker", w / 2 - 0.12, (0.05, d - 0.04), (0.08, 0.28), x, seen=True)
    b.box(b.cloth, w - 0.03, (0.015, d - 0.015), (h - 0.04, h + 0.02))
    b.places += [(x, d / 2, h + 0.02) for x in (0.19 - w / 2, w / 2 - 0.19)]
    return b.piece((w, d, h + 0.02), use=0.62, seats=2)


def office_chair(b: Builder) -> Piece:
    w, d = 0.56, 0.56
    paint = b.pick(b.cloth, "black", "dark")
    b.shadow(0.44, (0.06, 0.5), round_one=True)
    b.guard(0.46, (0.05, 0.51), (0, 0.5))
    b.guard(0.42, (0.02, 0.08), (0.5, 0.95))
    b.post("chrome", 0, d / 2, (0.06, 0.42), 0.03)
    for angle in range(5):
        x, y = ((0, 1), (0.95, 0.31), (0.59, -0.81), (-0.59, -0.81), (-0.95, 0.31))[angle]
        b.rod("dark", (0, d / 2, 0.09), (0.24 * x, d / 2 + 0.24 * y, 0.05), 0.02, shape="capsule")
        b.soft("black", (0.24 * x, d / 2 + 0.24 * y, 0.03), (0.03, 0.03, 0.03))
    b.box(paint, 0.46, (0.07, 0.52), (0.42, 0.48), seen=True)
    b.soft(paint, (0, 0.3, 0.48), (0.22, 0.21, 0.04))
    b.soft(paint, (0, 0.07, 0.74), (0.22, 0.05, b.pick(0.2, 0.26)))
    if b.chance(0.6):
        for x in (-0.25, 0.25):
            b.box("dark", 0.05, (0.16, 0.42), (0.64, 0.67), x, seen=True)
            b.box("dark", 0.03, (0.26, 0.3), (0.44, 0.64), x, seen=True)
    return b.piece((w, d, 1.0), seats=1)
