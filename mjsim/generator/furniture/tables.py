"""Tables and desks, some of which have seats."""

import math
from collections.abc import Callable

from mjsim.generator.furniture import seats
from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Mount, Piece, group, pushed_in


def _table(b: Builder, w: float, d: float, h: float) -> None:
    form = b.pick("posts", "blocks", "trestle", "splayed")
    top = 0.045 if form == "blocks" else 0.03
    b.box(b.wood, w, (0, d), (h - top, h))
    if form == "trestle":
        for x in (-w / 2 + 0.22, w / 2 - 0.22):
            b.box(b.metal, 0.06, (0.06, d - 0.06), (h - top - 0.04, h - top), x, seen=True)
            b.box(b.metal, 0.06, (0.06, d - 0.06), (0, 0.04), x, seen=True)
            b.box(b.metal, 0.06, (d / 2 - 0.05, d / 2 + 0.05), (0.04, h - top - 0.04), x, seen=True)
    elif form == "splayed":
        for x in (-w / 2 + 0.06, w / 2 - 0.06):
            for y in (0.06, d - 0.06):
                b.rod(b.wood2, (x, y, 0.008), (0.82 * x, d / 2 + 0.7 * (y - d / 2), h - top), 0.022)
    else:
        wood, radius = (b.wood, 0.035) if form == "blocks" else (b.pick(b.wood2, b.metal), 0.022)
        b.legs(wood, w, (0, d), h - top, 0.06, radius)
        b.box(b.wood, w - 0.16, (0.05, d - 0.05), (h - top - 0.07, h - top), seen=True)


def _round(b: Builder, r: float, h: float) -> None:
    b.post(b.pick(b.wood, b.wood, "stone"), 0, r, (h - 0.03, h), r, seen=False)
    if b.chance(0.5):
        b.post(b.pick(b.metal, b.wood2), 0, r, (0.02, h - 0.03), 0.05 if r > 0.3 else 0.025, seen=False)
        b.post(b.metal, 0, r, (0, 0.02), 0.55 * r)
    else:
        b.legs(b.wood2, 1.42 * r, (0.29 * r, 1.71 * r), h - 0.03, 0.05, 0.02)


def table(b: Builder) -> Piece:
    w, d = b.size(1.1, 1.8, 0.1), b.pick(0.75, 0.8, 0.9)
    b.shadow(w, (0, d))
    _table(b, w, d, 0.74)
    _laid(b, w, d / 2)
    return b.piece((w, d, 1.1), stands="free")


def _laid(b: Builder, w: float, y: float) -> None:
    if b.chance(0.5):
        b.box(b.pick("linen", b.cloth2), 0.6 * w, (y - 0.16, y + 0.16), (0.74, 0.743), seen=True)
    b.clutter(0.5 * w, (y - 0.1, y + 0.1), 0.744, 2)
    b.places += [(side * (w / 2 - 0.19), y, 0.74) for side in (-1, 1)]


def round_table(b: Builder) -> Piece:
    r = b.pick(0.45, 0.5, 0.55)
    b.shadow(2 * r, (0, 2 * r), round_one=True)
    _round(b, r, 0.74)
    b.clutter(0.3, (r - 0.1, r + 0.1), 0.74, 1)
    b.places += [(0.5 * r * u, r + 0.5 * r * v, 0.74) for u in (-1, 1) for v in (-1, 1)]
    return b.piece((2 * r, 2 * r, 1.1), stands="free")


def pendant_lamp(b: Builder) -> Piece:
    form, low, y = b.pick("dome", "drum", "balls"), 1.72, 0.3
    paint = b.pick(*b.look.accents, "white", "black")
    for x in (-0.25, 0.25) if form == "balls" else (0.0,):
        b.post("black", x, y, (low + 0.1, 2.58), 0.006)
        if form == "balls":
            b.soft("bulb", (x, y, low + 0.1), (0.11, 0.11, 0.11))
    if form == "dome":
        b.soft(paint, (0, y, low + 0.12), (0.24, 0.24, 0.1))
        b.soft("bulb", (0, y, low + 0.05), (0.09, 0.09, 0.05))
    elif form == "drum":
        b.post("shade", 0, y, (low, low + 0.22), 0.22)
    b.on_ceiling()
    return b.piece((0.8, 0.6, 2.6), parts=(), stands="ceiling")


def _seat(b: Builder, draw: Callable[[Builder], Piece]) -> Piece:
    """Create a seat that is used several times. It has its own random generator."""
    rng = type(b.rng)(type(b.rng.bit_generator)(int(b.rng.integers(2**31))))
    return draw(Builder(draw.__name__, rng, b.look))


def dining(b: Builder) -> Piece:
    against = b.smaller >= 1
    kind = table if against or b.chance(0.7) else round_table
    base = b.draw(kind, b.smaller)
    w, d, _ = base.size
    chair = _seat(b, seats.dining_chair)
    # For each seat, the middle of the table edge in front of it, and the yaw of a person who sits there
    edges = []
    each = 2 if w >= 1.15 and b.smaller < 2 and kind is table else 1
    for i in range(each):
        x = (i + 0.5) * w / each - w / 2
        edges += [(x, d, math.pi)] if against else [(x, d, math.pi), (x, 0.0, 0.0)]
    if kind is round_table or (w >= 1.5 and b.chance(0.5)) or b.smaller:
        edges += [(side * w / 2, d / 2, side * math.pi / 2) for side in (-1, 1)]
    members = [(base, 0.0, 0.0, 0.0)]
    for edge in edges:
        members.append(pushed_in(members, chair, *edge))
    if b.chance(0.7):
        members.append((b.draw(pendant_lamp), 0.0, d / 2 - 0.3, 0.0))
    return group(b.kind, members, use=(), stands="wall" if against else "free")


def coffee_table(b: Builder) -> Piece:
    form, h = b.pick("rectangle", "round", "box", "shelf"), b.pick(0.38, 0.42, 0.46)
    if form == "round":
        r = b.pick(0.35, 0.42)
        b.shadow(2 * r, (0, 2 * r), round_one=True)
        _round(b, r, h)
        b.clutter(0.1, (r - 0.1, r + 0.1), h, 1, -0.4 * r)
        b.places.append((0.4 * r, r, h))
        return b.piece((2 * r, 2 * r, h + 0.3), stands="free")
    w, d = b.size(0.8, 1.2, 0.1), b.pick(0.5, 0.6)
    b.shadow(w, (0, d))
    if form == "box":
        b.box(b.wood, w, (0.02, d - 0.02), (0.03, h))
        b.fronts(b.wood2, w, (0.05, h - 0.03), d - 0.035, 2)
    else:
        b.box(b.wood, w, (0, d), (h - 0.035, h))
        b.legs(b.pick(b.wood, b.metal), w, (0, d), h - 0.035, 0.05, 0.022)
        if form == "shelf":
            b.box(b.wood, w - 0.1, (0.05, d - 0.05), (0.12, 0.14), seen=True)
    b.top(w, (0, d), h)
    return b.piece((w, d, h + 0.3), stands="free")


def side_table(b: Builder) -> Piece:
    r, h = b.pick(0.2, 0.24), b.pick(0.5, 0.56)
    b.shadow(2 * r, (0, 2 * r), round_one=True)
    if b.chance(0.6):
        _round(b, r, h)
    else:
        b.box(b.wood, 2 * r, (0, 2 * r), (h - 0.025, h))
        b.legs(b.metal, 2 * r, (0, 2 * r), h - 0.025, 0.03, 0.014)
    if b.chance(0.6):
        b.lamp(0, r, h)
    else:
        b.top(2 * r, (0, 2 * r), h)
    return b.piece((2 * r, 2 * r, h + 0.4))


def console(b: Builder) -> Piece:
    w, d, h = b.size(0.8, 1.2, 0.1), b.pick(0.3, 0.36), b.pick(0.78, 0.85)
    b.shadow(w, (0, d))
    b.box(b.wood, w, (0, d - 0.02), (h - 0.13, h))
    b.fronts(b.wood2, w, (h - 0.12, h - 0.02), d - 0.02 - 0.002, b.pick(2, 3))
    b.legs(b.wood, w, (0, d - 0.02), h - 0.13, 0.04, 0.02)
    if b.chance(0.6):
        b.box(b.wood, w - 0.06, (0.025, d - 0.045), (0.15, 0.17), seen=True)
        b.box("wicker", 0.34, (0.04, d - 0.06), (0.17, 0.36), -0.2, seen=True)
    b.lamp(-w / 2 + 0.18, d / 2 - 0.02, h)
    b.top(w - 0.36, (0, d - 0.02), h, 0.18)
    return b.piece((w, d, h + 0.4), use=0.62)


def _screen(b: Builder, x: float) -> None:
    if b.chance(0.65):
        b.box("black", 0.22, (0.1, 0.25), (0.75, 0.762), x, seen=True)
        b.box("black", 0.05, (0.13, 0.16), (0.762, 0.88), x, seen=True)
        b.box("black", 0.58, (0.15, 0.175), (0.86, 1.2), x, seen=True)
        b.image("screen", 0.55, (0.88, 1.18), 0.179, x)
        b.box("keyboard", 0.4, (0.34, 0.47), (0.75, 0.765), x, seen=True)
    else:
        b.box("grey", 0.34, (0.26, 0.49), (0.75, 0.766), x, seen=True)
        b.box("black", 0.34, (0.245, 0.26), (0.76, 0.98), x, seen=True)
        b.image("screen", 0.31, (0.775, 0.965), 0.263, x)


def _desk(b: Builder) -> Piece:
    w, d, h = (b.pick(1.4, 1.5, 1.6), b.pick(1.2, 1.3), 1.0)[min(b.smaller, 2)], b.pick(0.6, 0.66), 0.75
    form, side = b.pick("panels", "pedestal", "legs"), -1
    b.shadow(w, (0, d))
    b.box(b.wood, w, (0, d), (h - 0.03, h))
    x = side * (w / 2 - 0.26)
    if form == "pedestal":
        b.box(b.front, 0.4, (0.03, d - 0.05), (0.04, h - 0.03), x)
        b.fronts(b.front, 0.4, (0.05, h - 0.05), d - 0.05, 1, 3, x)
    else:
        b.box(b.wood2, w - 0.16, (0.03, 0.05), (0.4, h - 0.03), seen=True)
    if form == "legs":
        b.legs(b.metal, w, (0, d), h - 0.03, 0.05, 0.025)
    else:
        for u in (-w / 2 + 0.02, w / 2 - 0.02):
            if form == "panels" or u * side < 0:
                b.box(b.wood, 0.04, (0.02, d - 0.02), (0, h - 0.03), u)
    seat = side * -0.22 if w > 1.1 else 0.25
    _screen(b, seat)
    if w > 1.3:
        b.lamp(w / 2 - 0.14, 0.14, h)
    if b.chance(0.6) and w > 1.1:
        b.post(b.pick(*b.look.accents), seat + 0.34, 0.2, (h, h + 0.1), 0.035)
    mount = Mount("office_box", (side * (w / 2 - 0.22), d / 2 - 0.02, h))
    b.places += [mount.position, (w / 2 - 0.19, d - 0.19, h)] if w > 1.5 else [mount.position]
    return b.piece((w, d, 1.22), mounts=(mount,), seats=0)


def desk(b: Builder) -> Piece:
    base = b.draw(_desk, b.smaller)
    chair = b.draw(seats.office_chair)
    w, d, _ = base.size
    x = 0.22 if w > 1.1 else 0.25
    turn = math.pi + float(b.rng.uniform(-0.35, 0.35))
    use = ((-w / 2, d, -w / 2 + 0.5, d + 0.72),)
    members = [(base, 0.0, 0.0, 0.0)]
    return group(b.kind, [*members, pushed_in(members, chair, x, d, turn)], use=use)


def dressing_table(b: Builder) -> Piece:
    w, d, h = b.size(0.8, 1.0), 0.42, 0.74
    paint = b.pick(b.wood, "white", b.front)
    b.shadow(w, (0, d))
    b.box(paint, w, (0, d - 0.02), (h - 0.14, h))
    b.fronts(paint, w, (h - 0.13, h - 0.02), d - 0.02, 2)
    b.legs(paint, w, (0, d - 0.02), h - 0.14, 0.04, 0.02)
    if b.chance(0.5):
        b.disc(b.metal, 0, 0.02, h + 0.36, 0.3, 0.02)
        b.disc("mirror", 0, 0.032, h + 0.36, 0.275, 0.008)
        b.box(b.metal, 0.05, (0.01, 0.03), (h, h + 0.1), seen=True)
    else:
        b.box(b.wood, 0.56, (0.0, 0.025), (h, h + 0.7), seen=True)
        b.image("mirror", 0.5, (h + 0.03, h + 0.67), 0.032)
    b.clutter(0.7 * w, (0.12, d - 0.08), h, 2)
    b.post(b.cloth, 0, d + 0.02, (0, 0.43), 0.17, seen=False)
    b.soft(b.cloth, (0, d + 0.02, 0.43), (0.17, 0.17, 0.035))
    parts = ((-w / 2, 0, w / 2, d, h + 0.7), (-0.17, d, 0.17, d + 0.19, 0.45))
    return b.piece((w, d + 0.19, h + 0.7), use=0.6, parts=parts, seats=1)


def bar_table(b: Builder) -> Piece:
    w, d, h = b.size(1.0, 1.4, 0.1), b.pick(0.45, 0.55), 1.02
    b.shadow(w, (0, d))
    b.box(b.pick(b.wood, "stone"), w, (0, d), (h - 0.04, h))
    b.legs(b.metal, w, (0, d), h - 0.04, 0.06, 0.025)
    b.box(b.metal, w - 0.12, (0.06, 0.09), (0.2, 0.23), seen=True)
    b.top(w, (0, d), h)
    members = [(b.piece((w, d, h + 0.25)), 0.0, 0.0, 0.0)]
    stool = _seat(b, seats.bar_stool)
    for side in (-1, 1):
        members.append(pushed_in(members, stool, side * w / 4, d, math.pi))
    return group(b.kind, members, use=())
