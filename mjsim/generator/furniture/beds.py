"""Beds and bedside tables."""

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Piece, Spot, group

SIDE = 0.62  # width of the free floor next to a bed, in metres


def _headboard(b: Builder, w: float) -> float:
    top = b.size(0.85, 1.15)
    form = b.pick("panel", "padded", "slats", "channels")
    if form == "panel":
        b.box(b.wood, w, (0, 0.05), (0, top))
    elif form == "slats":
        b.box(b.wood, w, (0.005, 0.045), (0, 0.5))
        b.box(b.wood, w, (0, 0.05), (top - 0.08, top), seen=True)
        count = max(5, round(w / 0.16))
        for i in range(count):
            x = (w - 0.04) * (i / (count - 1) - 0.5)
            b.box(b.wood, 0.035, (0.01, 0.04), (0.5, top - 0.08), x, seen=True)
    else:
        b.box(b.cloth, w, (0, 0.07), (0, top))
        count = 2 if form == "padded" else max(4, round(w / 0.22))
        for i in range(count):
            middle = (w * ((i + 0.5) / count - 0.5), 0.07, (top + 0.45) / 2)
            b.soft(b.cloth, middle, (w / count / 2, 0.03, top / 2 - 0.24))
    return top


def _mattress(b: Builder, w: float, y: tuple[float, float], z: float, pillows: int) -> None:
    quilt = b.pick(*b.look.quilts)
    b.box("linen", w - 0.04, (y[0] + 0.02, y[1] - 0.02), (z, z + 0.18))
    start = y[0] + b.pick(0.45, 0.55, 0.62)
    # Avoid quilt_c, whose texture would look stretched on the narrow sides of the bed.
    side = "quilt_a" if quilt == "quilt_c" else quilt
    b.box(side, w + 0.01, (start, y[1] - 0.005), (z + 0.05, z + 0.205))
    b.box(quilt, w + 0.01, (start, y[1] - 0.005), (z + 0.205, z + 0.215))
    if b.chance(0.5):
        half = w / 2 - 0.05
        b.rod("linen", (-half, start, z + 0.19), (half, start, z + 0.19), 0.045, shape="capsule")
    foot = z + 0.225 if b.chance(0.5) else z + 0.215
    if foot > z + 0.215:
        b.box(b.cloth2, w + 0.02, (y[1] - 0.55, y[1] - 0.15), (z + 0.04, foot))
    for x in (w / 2 - 0.22, 0.22 - w / 2):
        b.places += [(x, y[1] - 0.97, z + 0.215), (x, y[1] - 0.35, foot)]
    each = w / pillows
    for i in range(pillows):
        x = w * ((i + 0.5) / pillows - 0.5)
        b.soft("linen", (x, y[0] + 0.26, z + 0.235), (min(0.34, each / 2 - 0.03), 0.21, 0.07), (-0.2, 0, 0))
        if pillows > 1 and b.smaller == 0:
            b.pillow(b.cloth, (x, y[0] + 0.42, z + 0.27), (0.22, 0.09, 0.15), 0.6)


def _bed(b: Builder, w: float, pillows: int, sides: tuple[int, ...]) -> Piece:
    length = 2.08
    b.shadow(w, (0, length))
    top = _headboard(b, w + 0.04)
    if b.chance(0.5):
        b.box(b.wood, w + 0.02, (0.05, length), (0.03, 0.28))
    else:
        b.box(b.wood, w + 0.02, (0.05, length), (0.16, 0.28))
        b.legs(b.pick(b.wood, b.metal), w, (0.1, length), 0.16, 0.07, 0.03)
    _mattress(b, w, (0.06, length), 0.28, pillows)
    half = w / 2 + 0.02
    use: list[Spot] = [
        (half, 0.5, half + SIDE, 1.8) if side > 0 else (-half - SIDE, 0.5, -half, 1.8) for side in sides
    ]
    return b.piece((2 * half, length + 0.01, top), use=use)


def bedside_table(b: Builder) -> Piece:
    w, d, h = b.size(0.38, 0.48), 0.4, b.size(0.42, 0.56)
    form = b.pick("drawers", "open", "round", "legs")
    b.shadow(w, (0, d), round_one=form == "round")
    if form == "round":
        b.post(b.wood, 0, d / 2, (h - 0.025, h), d / 2 - 0.005, seen=False)
        b.post(b.metal, 0, d / 2, (0, h - 0.025), 0.025, seen=False)
        b.post(b.metal, 0, d / 2, (0, 0.015), 0.14)
        w = d
    elif form == "drawers":
        b.box(b.wood, w, (0, d - 0.035), (0, h))
        b.fronts(b.pick(b.wood2, b.front), w, (0.03, h - 0.02), d - 0.035, 1, 2)
    elif form == "open":
        b.box(b.wood, w, (0, d - 0.02), (h - 0.2, h))
        b.fronts(b.front, w, (h - 0.18, h - 0.02), d - 0.035, 1, 1)
        b.box(b.wood, w, (0, d - 0.02), (0.08, 0.1), seen=True)
        b.legs(b.wood, w, (0, d - 0.02), h - 0.2, 0.022, 0.02)
    else:
        b.box(b.front, w, (0, d - 0.035), (0.2, h))
        b.fronts(b.front, w, (0.22, h - 0.02), d - 0.035, 1, 1)
        b.legs(b.wood, w, (0, d), 0.2, 0.05, 0.018)
    if b.chance(0.65):
        b.lamp(0.03, d / 2 - 0.03, h)
    else:
        b.top(w, (0, d - 0.035), h)
    return b.piece((w, d, h + 0.4))


def _tables(b: Builder, bed: Piece, sides: tuple[int, ...]) -> Piece:
    table = b.draw(bedside_table)
    away = bed.size[0] / 2 + table.size[0] / 2 + 0.03
    return group(b.kind, [(bed, 0, 0, 0), *((table, side * away, 0, 0) for side in sides)], use=bed.use)


def double_bed(b: Builder) -> Piece:
    w = (b.pick(1.6, 1.8), b.pick(1.4, 1.6), 1.4, 1.2)[min(b.smaller, 3)]
    if b.smaller == 0 and b.chance(0.8):
        return _tables(b, _bed(b, w, 2, (-1, 1)), (-1, 1))
    side = b.pick(-1, 1)
    bed = _bed(b, w, 2 if w > 1.3 else 1, (side,))
    return _tables(b, bed, (side,)) if b.smaller == 1 else bed


def single_bed(b: Builder) -> Piece:
    w, side = b.pick(0.9, 1.0, 1.2) if b.smaller == 0 else 0.9, b.pick(-1, 1)
    bed = _bed(b, w, 1, (side,))
    return _tables(b, bed, (side,)) if b.smaller == 0 and b.chance(0.7) else bed


def day_bed(b: Builder) -> Piece:
    w, d = 2.04, b.pick(0.85, 0.95)
    b.shadow(w, (0, d))
    b.box(b.wood, w - 0.01, (0.005, d - 0.005), (0.1, 0.3))
    b.legs(b.wood, w, (0, d), 0.1, 0.06, 0.03)
    for side in (-1, 1):
        b.box(b.wood, 0.04, (0, d), (0.1, 0.68), side * (w / 2 - 0.02))
    b.box(b.wood, w - 0.01, (0, 0.04), (0.1, 0.75))
    b.box(b.pick(*b.look.quilts), w - 0.09, (0.045, d - 0.01), (0.3, 0.45))
    b.places += [(x, d - 0.21, 0.45) for x in (-0.5, 0.5)]
    for i in range(3):
        b.pillow(b.pick(*b.look.cloths), (0.6 * (i - 1), 0.16, 0.62), (0.26, 0.09, 0.2), -0.25)
    return b.piece((w, d, 0.84), use=0.7, seats=2)


def bunk_bed(b: Builder) -> Piece:
    w, d, h = 2.04, b.pick(0.96, 1.02), 1.75
    paint = b.pick(b.wood, b.front, "white")
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0.5, h))
    b.legs(paint, w, (0, d), h, 0.035, 0.035)
    for z in (0.25, 1.3):
        b.box(paint, w - 0.01, (0.01, d - 0.01), (z, z + 0.1))
        b.box("linen", w - 0.1, (0.04, d - 0.04), (z + 0.1, z + 0.22))
        b.box(b.pick(*b.look.quilts), 1.4, (0.03, d - 0.03), (z + 0.12, z + 0.24), 0.265, seen=True)
        b.soft("linen", (-0.72, d / 2, z + 0.25), (0.2, 0.32, 0.08))
    for y in (0.02, d - 0.045):
        for z in (1.55, 1.69):
            b.box(paint, w - 0.01, (y, y + 0.025), (z, z + 0.05), seen=True)
    for x in (0.55, 0.9):
        b.box(paint, 0.04, (d - 0.02, d + 0.02), (0, h), x, seen=True)
    for i in range(5):
        b.box(paint, 0.33, (d - 0.015, d + 0.015), (0.25 + 0.26 * i, 0.29 + 0.26 * i), 0.725, seen=True)
    return b.piece((w, d + 0.02, h), use=0.7)
