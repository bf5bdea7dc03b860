"""Furniture for bathrooms and laundry rooms."""

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Member, Piece, group


def toilet(b: Builder) -> Piece:
    w, d = b.pick(0.37, 0.4), b.pick(0.62, 0.68) if b.smaller < 2 else 0.58
    b.shadow(w, (0, d))
    hung = b.chance(0.4)
    if hung:
        b.box(b.pick("tile", "white"), 0.5, (0, 0.14), (0, 1.1))
        b.box("chrome", 0.2, (0.14, 0.146), (0.92, 1.02), seen=True)
        d = round(d + 0.04, 2)
    else:
        b.box("ceramic", w, (0, 0.2), (0.38, 0.78))
        b.box("ceramic", w + 0.02, (0, 0.21), (0.78, 0.81), seen=True)
        b.post("chrome", 0, 0.1, (0.81, 0.82), 0.025)
    b.guard(w - 0.02, (0.1, d - 0.02), (0, 0.4))
    y, r = (0.14 + d) / 2 + 0.04, (d - 0.2) / 2
    if not hung:
        b.box("ceramic", 0.24, (0.02, d - 0.16), (0, 0.3), seen=True)
    b.soft("ceramic", (0, y, 0.3), (w / 2 - 0.01, r, 0.12 if hung else 0.14))
    b.soft("white", (0, y, 0.41), (w / 2, r + 0.01, 0.025))
    b.soft("ceramic_shade", (0, y, 0.414), (w / 2 - 0.05, r - 0.05, 0.028))
    if b.smaller == 0:
        b.rod("chrome", (-w / 2 - 0.12, 0.0, 0.7), (-w / 2 - 0.12, 0.08, 0.7), 0.008)
        b.rod("linen", (-w / 2 - 0.17, 0.08, 0.7), (-w / 2 - 0.07, 0.08, 0.7), 0.05)
    wide, aside = 0.5 if hung else w + 0.02, 0.35 - 0.05 * b.smaller
    top = 1.1 if hung else 0.82
    parts = [(-wide / 2, 0.0, wide / 2, d, top)]
    if b.smaller == 0:
        parts.append((-w / 2 - 0.17, 0.0, -wide / 2, 0.14, top))
    if b.smaller == 0:
        wide = max(wide, w + 0.34)
    return b.piece((wide, d, top), use=((-aside, d, aside, d + 0.55),), parts=parts)


def _tap(b: Builder, x: float, y: float, z: float) -> None:
    b.post("chrome", x, y, (z, z + 0.15), 0.013)
    b.rod("chrome", (x, y, z + 0.15), (x, y + 0.12, z + 0.13), 0.012)


def washbasin(b: Builder) -> Piece:
    forms = ("cupboard", "foot", "bowl", "double")
    form = b.pick(*forms) if b.smaller == 0 else b.pick(*forms[:3])
    widths = {"cupboard": b.size(0.6, 0.8, 0.1), "foot": 0.55, "bowl": b.size(0.7, 0.9, 0.1), "double": 1.2}
    w, d = widths[form], 0.46
    if b.smaller > 1:
        form, w, d = "foot", 0.45, 0.4
    b.shadow(w, (0, d))
    if form == "foot":
        b.guard(0.4, (0.02, 0.38), (0, 0.75))
        b.post("ceramic", 0, 0.2, (0, 0.75), 0.09)
        b.box("ceramic", w, (0, d), (0.75, 0.86))
        b.soft("ceramic_shade", (0, d / 2 + 0.03, 0.853), (w / 2 - 0.055, d / 2 - 0.075, 0.018))
    else:
        paint, low = b.pick(b.wood, b.front, "white"), b.pick(0.0, 0.3)
        top = 0.78 if form == "bowl" else 0.8
        b.box(paint, w, (0, d - 0.045), (low, top))
        b.fronts(paint, w, (low + 0.02, top - 0.02), d - 0.045, 1 if w < 0.75 else 2, b.pick(1, 2))
        b.box(b.pick("stone", b.wood2) if form == "bowl" else "ceramic", w + 0.02, (0, d), (top, top + 0.05))
        for x in (-0.3, 0.3) if form == "double" else (0.0,):
            if form == "bowl":
                b.post("ceramic", x, 0.24, (0.83, 0.94), 0.19, seen=False)
                b.post("ceramic_shade", x, 0.24, (0.94, 0.944), 0.165)
            else:
                b.soft("ceramic_shade", (x, 0.25, 0.843), (0.22, 0.15, 0.018))
    for x in (-0.3, 0.3) if form == "double" else (0.0,):
        _tap(b, x, 0.06, 0.83)
    b.post(b.pick(*b.look.accents), w / 2 - 0.1, 0.1, (0.84, 0.98), 0.03)
    mirror = b.pick("square", "round", "cabinet")
    if mirror == "round":
        b.disc(b.metal, 0, 0.012, 1.55, 0.33, 0.016)
        b.disc("mirror", 0, 0.022, 1.55, 0.31, 0.008)
    elif mirror == "cabinet":
        b.box("white", w, (0, 0.13), (1.2, 1.85))
        for side in (-1, 1):
            b.image("mirror", w / 2 - 0.01, (1.205, 1.845), 0.138, side * w / 4)
    else:
        b.box(b.metal, w, (0, 0.015), (1.17, 1.93), seen=True)
        b.image("mirror", w - 0.03, (1.185, 1.915), 0.021)
    if mirror != "cabinet":
        b.rod("bulb", (-0.2, 0.06, 2.0), (0.2, 0.06, 2.0), 0.025, shape="capsule")
    aside = 0.35 - 0.05 * b.smaller
    return b.piece((w + 0.02, d, 2.03), use=((-aside, d, aside, d + 0.6),))


def bathtub(b: Builder) -> Piece:
    w, d, h = (b.pick(1.6, 1.7, 1.8), 1.6, 1.5)[min(b.smaller, 2)], b.pick(0.72, 0.76), 0.57
    side = b.pick(-1, 1)
    b.shadow(w, (0, d))
    if b.chance(0.5):
        b.box(b.pick("tile", b.wood, "white"), w - 0.02, (d - 0.03, d - 0.005), (0, h - 0.04), seen=True)
    for low, high in ((0.0, 0.07), (d - 0.07, d)):
        b.box("ceramic", w, (low, high - (0.01 if high == d else 0)), (0, h))
    for x in (-w / 2 + 0.06, w / 2 - 0.06):
        b.box("ceramic", 0.12, (0.07, d - 0.07), (0, h), x)
    b.box("ceramic_shade", w - 0.24, (0.07, d - 0.07), (0, 0.2))
    for y in (0.035, d - 0.045):
        b.rod("ceramic", (-w / 2 + 0.04, y, h - 0.005), (w / 2 - 0.04, y, h - 0.005), 0.035, shape="capsule")
    b.box("water", w - 0.24, (0.07, d - 0.07), (0.38, 0.384), seen=True)
    x = side * (w / 2 - 0.06)
    b.rod("chrome", (x, d / 2, 0.72), (x - side * 0.14, d / 2, 0.7), 0.018)
    b.post("chrome", x, d / 2, (h, 0.74), 0.015)
    parts = [(-w / 2, 0.0, w / 2, d, 0.62)]
    high = 0.0  # length of the part of the tub with a shower or a screen, measured from the taps, in metres
    if b.smaller < 2 and b.chance(0.6):
        high = 0.4
        b.post("chrome", x, d / 2, (0.74, 2.05), 0.011)
        b.rod("chrome", (x, d / 2, 2.05), (x - side * 0.22, d / 2, 2.09), 0.011)
        b.post("chrome", x - side * 0.24, d / 2, (2.05, 2.07), 0.1)
        if b.chance(0.6):
            high = 0.82
            b.box("pane", 0.8, (d - 0.045, d - 0.037), (h, 1.98), side * (w / 2 - 0.4), seen=True)
            b.box("chrome", 0.02, (d - 0.05, d - 0.03), (h, 1.98), side * (w / 2 - 0.8), seen=True)
    if high:
        middle = side * (w / 2 - high)
        tops = (0.62, 2.1) if side > 0 else (2.1, 0.62)
        parts = [(-w / 2, 0.0, middle, d, tops[0]), (middle, 0.0, w / 2, d, tops[1])]
    stands = "left" if side < 0 else "right"
    return b.piece((w, d, 2.1), use=((-0.4, d, 0.4, d + 0.55),), parts=parts, stands=stands)


def shower(b: Builder) -> Piece:
    w = d = b.pick(0.8, 0.9) if b.smaller else b.pick(0.9, 1.0)
    side = b.pick(-1, 1)
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0, 1.95))
    b.box("ceramic", w, (0, d), (0, 0.05), seen=True)
    b.box("ceramic_shade", w - 0.12, (0.06, d - 0.06), (0.05, 0.053), seen=True)
    b.box("pane", w - 0.02, (d - 0.012, d - 0.004), (0.05, 1.95), seen=True)
    b.box("pane", 0.008, (0, d - 0.012), (0.05, 1.95), -side * (w / 2 - 0.008), seen=True)
    edge = side * (w / 2 - 0.01)
    for x, y in ((-edge, d - 0.01), (edge, d - 0.01), (-edge, 0.01)):
        b.box(b.metal, 0.02, (y - 0.01, y + 0.01), (0.05, 1.97), x, seen=True)
    b.box(b.metal, w, (d - 0.02, d), (1.95, 1.97), seen=True)
    b.box("chrome", 0.02, (d, d + 0.03), (0.95, 1.15), -side * 0.2, seen=True)
    x = side * (w / 2 - 0.12)
    b.post("chrome", x, 0.04, (0.9, 2.05), 0.011)
    b.rod("chrome", (x, 0.04, 2.05), (x, 0.3, 2.08), 0.011)
    b.post("chrome", x, 0.32, (2.05, 2.07), b.pick(0.09, 0.13))
    b.box("chrome", 0.16, (0.02, 0.06), (1.05, 1.09), x, seen=True)
    stands = "left" if side < 0 else "right"
    return b.piece((w, d + 0.03, 2.09), use=((-0.35, d + 0.03, 0.35, d + 0.58),), stands=stands)


def wash_corner(b: Builder) -> Piece:
    row = [b.draw(kind, 1) for kind in (shower, toilet, washbasin)]
    side = 1 if row[0].stands == "left" else -1
    members: list[Member] = []
    at = 0.0
    for piece in row:
        members.append((piece, side * (at + piece.size[0] / 2), 0.0, 0.0))
        at += piece.size[0] + 0.02
    b.box(b.pick(b.wood, b.front, "white"), 0.04, (0, 1.2), (0, 2.0))
    members.append((b.piece((0.04, 1.2, 2.0)), side * (at + 0.05), 0.0, 0.0))
    return group(b.kind, members, stands=row[0].stands)


def _machine(b: Builder, z: float, glass: str) -> None:
    b.box("white", 0.59, (0, 0.56), (z, z + 0.85))
    b.disc("chrome", 0, 0.565, z + 0.4, 0.19, 0.03)
    b.disc(glass, 0, 0.582, z + 0.4, 0.15, 0.012)
    b.box("grey", 0.57, (0.56, 0.566), (z + 0.72, z + 0.83), seen=True)
    b.disc("chrome", 0.04, 0.575, z + 0.775, 0.03, 0.02)
    b.box("black", 0.14, (0.566, 0.57), (z + 0.75, z + 0.8), 0.19, seen=True)


def washing_machine(b: Builder) -> Piece:
    b.shadow(0.6, (0, 0.6))
    _machine(b, 0, b.pick("dark", "black"))
    if b.chance(0.5):
        b.box("wicker", 0.26, (0.12, 0.4), (0.85, 1.03), -0.15, seen=True)
        b.places.append((0.11, 0.36, 0.85))
    else:
        b.box("towel_a", 0.28, (0.12, 0.44), (0.85, 0.91), 0.1, seen=True)
        b.box("towel_white", 0.26, (0.13, 0.43), (0.911, 0.97), 0.1, seen=True)
        b.post(b.pick("accent_a", "accent_b"), -0.16, 0.25, (0.85, 1.05), 0.06)
    return b.piece((0.6, 0.6, 1.05), use=0.6)


def washing_tower(b: Builder) -> Piece:
    b.shadow(0.6, (0, 0.6))
    _machine(b, 0, "dark")
    b.box("grey", 0.58, (0, 0.55), (0.85, 0.87), seen=True)
    _machine(b, 0.87, b.pick("black", "dark"))
    return b.piece((0.6, 0.6, 1.72), use=0.6)


def towel_rail(b: Builder) -> Piece:
    w, h, paint = b.pick(0.45, 0.5, 0.6), b.pick(1.4, 1.6), b.pick("chrome", "white", "black")
    b.guard(w, (0.0, 0.1), (0, h))
    for x in (-w / 2 + 0.015, w / 2 - 0.015):
        b.post(paint, x, 0.06, (0.3, h), 0.014)
    for i in range(round((h - 0.4) / 0.15)):
        b.box(paint, w - 0.03, (0.05, 0.07), (0.36 + 0.15 * i, 0.385 + 0.15 * i), seen=True)
    b.box("towel_a", 0.6 * w, (0.07, 0.095), (h - 0.62, h - 0.1), -0.03, seen=True)
    b.box(b.pick("towel_b", "towel_white"), 0.6 * w, (0.07, 0.095), (0.4, 0.72), 0.05, seen=True)
    return b.piece((w, 0.1, h))


def bath_cabinet(b: Builder) -> Piece:
    w, d, h = b.pick(0.35, 0.4, 0.5), 0.35, b.pick(1.3, 1.7)
    paint = b.pick("white", b.wood, b.front)
    b.carcass(paint, w, d, (0.06, h))
    b.legs("dark", w, (0, d - 0.035), 0.06, 0.04, 0.02)
    b.fronts(paint, w, (0.08, 0.7), d - 0.035, 1, 1, doors=True)
    b.fronts(paint, w, (0.7, h - 0.01), d - 0.035, 1, 1, doors=True)
    b.box("towel_white", 0.7 * w, (0.05, d - 0.07), (h, h + 0.07), seen=True)
    return b.piece((w, d, h + 0.07), use=0.6)


def towel_shelf(b: Builder) -> Piece:
    w, d, h = b.size(0.4, 0.6), 0.32, b.pick(0.95, 1.5)
    paint = b.pick(b.wood, b.metal, "white")
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0, h))
    b.legs(paint, w, (0, d), h, 0.016, 0.014)
    rows = round(h / 0.4)
    for i in range(rows + 1):
        z = 0.1 + (h - 0.12) * i / rows
        b.box(paint, w - 0.01, (0.01, d - 0.01), (z, z + 0.018), seen=True)
        if i < rows and b.chance(0.5):
            b.box("wicker", 0.8 * w, (0.04, d - 0.04), (z + 0.018, z + 0.2), seen=True)
        elif i < rows:
            for j, towel in enumerate(("towel_a", "towel_white", "towel_b")):
                height = (z + 0.018 + 0.055 * j, z + 0.071 + 0.055 * j)
                b.box(towel, 0.66 * w, (0.05, d - 0.05), height, seen=True)
    b._plant(0, d / 2, h)
    return b.piece((w, d, h + 0.35), use=0.6)


def drying_rack(b: Builder) -> Piece:
    w, d, h = b.pick(0.9, 1.1), 0.55, 0.95
    b.guard(w, (0, d), (0, h))
    for x in (-w / 2 + 0.01, w / 2 - 0.01):
        b.rod("chrome", (x, 0.06, 0.006), (x, d - 0.06, h), 0.01)
        b.rod("chrome", (x, d - 0.06, 0.006), (x, 0.06, h), 0.01)
    for i in range(6):
        y = 0.03 + (d - 0.06) * i / 5
        b.rod("chrome", (-w / 2, y, h - 0.01), (w / 2, y, h - 0.01), 0.006)
    for i, y in enumerate(0.03 + (d - 0.06) * k / 5 for k in (0, 2, 3, 5)):
        cloth = b.pick("towel_a", "towel_b", b.cloth, b.cloth2, "linen")
        x = 0.2 * w * b.pick(-1, 1)
        b.box(cloth, b.pick(0.3, 0.4), (y - 0.008, y + 0.008), (h - 0.4 - 0.05 * (i % 2), h), x, seen=True)
    return b.piece((w, d, h), use=0.6)
