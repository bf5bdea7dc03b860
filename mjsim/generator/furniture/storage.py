"""Wardrobes, chests, shelves and sideboards, with objects on them."""

from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Piece

TALL = 0.32  # minimum height of a compartment for tall objects, in metres


def _wardrobe(b: Builder, mirrored: bool) -> Piece:
    w, d, h = b.size(1.0, 2.2, 0.2), 0.6, b.pick(2.0, 2.1, 2.2)
    doors = max(2, round(w / 0.5))
    carcass = b.pick(b.wood, "white", b.front)
    b.carcass(carcass, w, d, (0, h))
    b.box("dark", w - 0.02, (d - 0.06, d - 0.03), (0, 0.06), seen=True)
    if not mirrored:
        b.handle = b.pick("bar", "bar", "knob")
        b.fronts(b.pick(carcass, b.front), w, (0.07, h - 0.02), d - 0.035, doors, 1, doors=True)
        return b.piece((w, d, h), use=0.7)
    doors = 2 if w < 1.5 else 3
    for i in range(doors):
        wide, x = w / doors, w * ((i + 0.5) / doors - 0.5)
        y = d - 0.022 + 0.014 * (i % 2)
        b.box(carcass, wide + 0.01 * (i % 2), (y - 0.012, y), (0.07, h - 0.03), x, seen=True)
        if i % 2 == 0 or doors == 2:
            b.image("mirror", wide - 0.09, (0.11, h - 0.07), y + 0.004, x, 0.006)
    return b.piece((w, d, h), use=0.65)


def wardrobe(b: Builder) -> Piece:
    return _wardrobe(b, False)


def mirror_wardrobe(b: Builder) -> Piece:
    return _wardrobe(b, True)


def chest_of_drawers(b: Builder) -> Piece:
    w, d, h = b.size(0.7, 1.3, 0.1), b.pick(0.42, 0.48), b.pick(0.75, 0.85, 1.0)
    carcass, low = b.pick(b.wood, "white", b.front), b.pick(0.0, 0.12)
    b.carcass(carcass, w, d, (low, h))
    if low:
        b.legs(b.wood, w, (0, d - 0.03), low, 0.05, 0.02)
    fronts, columns = b.pick(carcass, b.wood2), 1 if w < 0.85 else 2
    b.fronts(fronts, w, (low + 0.03, h - 0.025), d - 0.035, columns, b.pick(3, 4))
    b.top(w, (0, d - 0.035), h)
    return b.piece((w, d, h + 0.3), use=0.65)


def _books(b: Builder, w: float, z: float, high: float, d: float, x: float) -> None:
    b.box("cream", w, (0.05, d - 0.06), (z, z + high - 0.01), x, seen=True)
    b.image("book_spines", w, (z, z + high), d - 0.052, x)


def _filled(b: Builder, w: float, z: float, high: float, d: float, x: float) -> None:
    what = b.pick("books", "books", "books", "basket", "thing", "empty")
    if what == "books":
        wide = w * float(b.rng.uniform(0.6, 0.95))
        _books(b, wide, z, min(high - 0.05, 0.27), d, x - (w - wide) / 2 * b.pick(-1, 1))
    elif what == "basket":
        material = b.pick("wicker", b.cloth2)
        b.box(material, 0.85 * w if w < 0.6 else 0.4, (0.05, d - 0.03), (z, z + 0.7 * high), x, seen=True)
    elif what == "thing":
        b.thing(x, d / 2 + 0.01, z, high < TALL)


def _frame(
    b: Builder, paint: str, size: tuple[float, float, float], columns: int, boards: list[float]
) -> None:
    """Add the back, the sides and the boards of a shelf of width, depth and height `size`."""
    w, d, h = size
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0, h))
    b.box(paint, w, (0, 0.012), (0, h), seen=True)
    for i in range(columns + 1):
        x = -w / 2 + 0.012 + (w - 0.024) * i / columns
        top = h - 0.01 if 0 < i < columns else h
        b.box(paint, 0.024, (0.012, d), (0, top), x, seen=True)
    for z in boards:
        b.box(paint, w - 0.048, (0.012, d - 0.004), (z, z + 0.02), seen=True)


def _shelf(b: Builder, w: float, h: float, d: float, columns: int, rows: int) -> Piece:
    paint, step = b.pick(b.wood, "white", b.wood2), (h - 0.08) / rows
    _frame(b, paint, (w, d, h), columns, [*(0.06 + step * j for j in range(rows)), h - 0.02])
    for i in range(columns):
        for j in range(rows):
            wide = w / columns - 0.05
            _filled(b, wide, 0.08 + step * j, step - 0.03, d, -w / 2 + w * (i + 0.5) / columns)
    if h < 1.4:
        b.top(w, (0, d), h)
        h += 0.3
    return b.piece((w, d, h), use=0.6)


def bookcase(b: Builder) -> Piece:
    return _shelf(b, b.size(0.6, 1.2, 0.1), b.pick(1.6, 1.8, 2.0), b.pick(0.28, 0.32), 1, b.pick(4, 5))


def low_bookcase(b: Builder) -> Piece:
    return _shelf(b, b.size(0.7, 1.3, 0.1), b.pick(0.78, 1.1), b.pick(0.28, 0.32), b.pick(1, 2), b.pick(2, 3))


def cube_shelf(b: Builder) -> Piece:
    columns, rows = (2, b.pick(2, 3, 4)) if b.smaller else (b.pick(2, 3), b.pick(2, 3, 4))
    return _shelf(b, 0.36 * columns + 0.04, 0.36 * rows + 0.06, 0.36, columns, rows)


def ladder_shelf(b: Builder) -> Piece:
    w, d, h = b.size(0.5, 0.7), 0.36, b.pick(1.7, 1.85)
    b.shadow(w, (0, d))
    b.guard(w, (0, d), (0, 0.9))
    b.guard(w, (0, 0.24), (0.9, h))
    for x in (-w / 2 + 0.015, w / 2 - 0.015):
        for y in (0.03, d - 0.03):
            b.rod(b.pick(b.metal, b.wood), (x, y, 0), (x, 0.03 if y < 0.1 else 0.1, h), 0.014)
    for i in range(4):
        z, deep = 0.25 + 0.42 * i, 0.36 - 0.065 * i
        b.box(b.wood, w - 0.03, (0.01, deep), (z, z + 0.022), seen=True)
        b.clutter(w - 0.1, (0.03, deep), z + 0.022, 2)
    return b.piece((w, d, h + 0.25), use=0.6)


def sideboard(b: Builder) -> Piece:
    w, d, h = b.size(1.2, 1.8, 0.1), b.pick(0.42, 0.46), b.pick(0.7, 0.8)
    low, carcass = b.pick(0.04, 0.15), b.pick(b.wood, b.wood, "white", b.front)
    b.carcass(carcass, w, d, (low, h))
    if low > 0.1:
        b.legs(b.pick(b.wood, b.metal), w, (0, d - 0.03), low, 0.08, 0.02)
    third, fronts = w / 3, b.pick(carcass, b.wood2)
    for i in (-1, 1):
        b.fronts(fronts, third, (low + 0.02, h - 0.02), d - 0.035, 1, 1, i * third, doors=True)
    b.fronts(fronts, third, (low + 0.02, h - 0.02), d - 0.035, 1, 3)
    b.top(w, (0, d - 0.035), h)
    return b.piece((w, d, h + 0.3), use=0.65)


def dresser(b: Builder) -> Piece:
    w, d, h = b.size(0.9, 1.2, 0.1), 0.45, b.pick(1.8, 1.9)
    paint = b.pick("cream", b.front, b.wood)
    b.carcass(paint, w, d, (0, 0.86))
    b.fronts(paint, w, (0.06, 0.62), d - 0.035, 2, 1, doors=True)
    b.fronts(paint, w, (0.63, 0.84), d - 0.035, 2)
    b.box(b.wood, w, (0, d), (0.86, 0.89), seen=True)
    b.guard(w, (0, 0.22), (0.89, h))
    b.box(paint, w, (0, 0.015), (0.89, h), seen=True)
    for x in (-w / 2 + 0.012, w / 2 - 0.012):
        b.box(paint, 0.024, (0.015, 0.22), (0.89, h), x, seen=True)
    for z in (1.25, h - 0.03):
        b.box(paint, w - 0.048, (0.015, 0.215), (z, z + 0.025), seen=True)
    for i in range(3):
        x = 0.27 * (i - 1)
        b.disc(b.pick("accent_a", "ceramic", "accent_b"), x, 0.05, 1.4, 0.11)
        b.disc("ceramic", x, 0.062, 1.4, 0.075)
    b.clutter(0.8 * w, (0.05, 0.2), 0.89)
    return b.piece((w, d, h), use=0.65)


def display_cabinet(b: Builder) -> Piece:
    w, d, h = b.size(0.7, 1.0, 0.1), 0.4, b.pick(1.7, 1.9)
    paint = b.pick(b.wood, "white", b.front)
    b.shadow(w, (0, d))
    b.guard(w, (0, d - 0.02), (0.5, h))
    b.box(paint, w, (0, d - 0.035), (0, 0.5))
    b.fronts(paint, w, (0.05, 0.48), d - 0.035, 2, 1, doors=True)
    b.box(paint, w, (0, 0.015), (0.5, h - 0.03), seen=True)
    b.box(paint, w, (0, d - 0.02), (h - 0.03, h), seen=True)
    for x in (-w / 2 + 0.015, w / 2 - 0.015):
        b.box(paint, 0.03, (0.015, d - 0.02), (0.5, h - 0.03), x, seen=True)
    for i in range(3):
        z = 0.5 + (h - 0.53) * i / 3
        if i:
            b.box(paint, w - 0.06, (0.015, d - 0.05), (z, z + 0.015), seen=True)
        b.clutter(w - 0.15, (0.08, d - 0.1), z + 0.015, 2)
    b.box("pane", w - 0.06, (d - 0.028, d - 0.022), (0.52, h - 0.04), seen=True)
    b.box(paint, 0.03, (d - 0.03, d - 0.015), (0.5, h - 0.03), seen=True)
    return b.piece((w, d, h), use=0.62)


def tv_stand(b: Builder) -> Piece:
    w, d, h = b.size(1.2, 1.8, 0.1), 0.4, b.pick(0.42, 0.5)
    low, carcass = b.pick(0.03, 0.14), b.pick(b.wood, b.wood, "white", b.front)
    b.carcass(carcass, w, d, (low, h))
    if low > 0.1:
        b.legs(b.wood, w, (0, d - 0.03), low, 0.08, 0.02)
    third, fronts = w / 3, b.pick(carcass, b.wood2)
    for i in (-1, 1):
        b.fronts(fronts, third, (low + 0.02, h - 0.02), d - 0.035, 1, b.pick(1, 2), i * third)
    b.box("black", third - 0.02, (d - 0.035, d - 0.028), (low + 0.03, h - 0.03), seen=True)
    b.box("grey", 0.3, (d - 0.03, d - 0.018), (low + 0.04, low + 0.1), seen=True)
    return b.piece((w, d, h), use=0.6)


def shoe_cupboard(b: Builder) -> Piece:
    w, d, h = b.size(0.6, 1.0, 0.1), b.pick(0.24, 0.28), b.pick(0.85, 1.05)
    paint = b.pick("white", b.wood, b.front)
    b.carcass(paint, w, d, (0.02, h))
    b.fronts(paint, w, (0.05, h - 0.02), d - 0.035, 1 if w < 0.75 else 2, b.pick(2, 3))
    b.clutter(0.8 * w, (0.05, d - 0.05), h, 2)
    return b.piece((w, d, h + 0.3), use=0.62)


def filing_cabinet(b: Builder) -> Piece:
    w, d, h = b.pick(0.42, 0.46), 0.5, b.pick(0.68, 1.02, 1.3)
    paint = b.pick("grey", "white", "front_dark", b.wood)
    b.carcass(paint, w, d, (0, h))
    b.handle = "bar"
    b.fronts(paint, w, (0.03, h - 0.02), d - 0.035, 1, round(h / 0.33))
    b.top(w, (0, d - 0.035), h)
    return b.piece((w, d, h + 0.3), use=0.62)


def trunk(b: Builder) -> Piece:
    w, d, h = b.size(0.8, 1.1, 0.1), b.pick(0.42, 0.48), 0.45
    paint = b.pick(b.wood, "wicker", b.front)
    b.shadow(w, (0, d))
    b.box(paint, w, (0, d - 0.01), (0, h - 0.07))
    b.box(paint, w, (0, d), (h - 0.065, h))
    for x in (-0.32 * w, 0.32 * w):
        b.box(b.metal, 0.05, (d - 0.012, d - 0.002), (0, h - 0.07), x, seen=True)
    if b.chance(0.5):
        b.soft(b.cloth, (0, d / 2, h), (w / 2 - 0.03, d / 2 - 0.03, 0.04))
    else:
        b.top(w, (0, d), h)
    return b.piece((w, d, h + 0.3), use=0.6, seats=1)


def toy_shelf(b: Builder) -> Piece:
    w, d, h = b.pick(0.9, 1.1), 0.36, b.pick(0.62, 0.9)
    rows = 2 if h < 0.8 else 3
    boards = [(h - 0.02) * j / rows for j in range(rows + 1)]
    _frame(b, b.pick("white", b.wood), (w, d, h), 1, boards)
    for i in range(3):
        for j in range(rows):
            z, tub = boards[j] + 0.022, b.pick(*b.look.accents, "none")
            if tub != "none":
                b.box(tub, w / 3 - 0.06, (0.04, d - 0.02), (z, z + 0.2), (i - 1) * (w - 0.03) / 3, seen=True)
    for i, paint in enumerate(("accent_a", "accent_c", "accent_b")):
        b.box(paint, 0.09, (0.1, 0.19), (h, h + 0.09), -0.3 * w + 0.095 * i, seen=True)
    b.soft("wicker", (0.3 * w, 0.16, h + 0.1), (0.08, 0.07, 0.1))
    b.soft("wicker", (0.3 * w, 0.16, h + 0.25), (0.065, 0.065, 0.065))
    return b.piece((w, d, h + 0.32), use=0.6)
