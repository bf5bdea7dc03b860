"""Furniture for living rooms and halls."""

import math

from mjsim.generator.furniture import decoration, seats, storage, tables
from mjsim.generator.furniture.artwork import painting
from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.piece import Piece, group, pushed_in

FREE = 1.2  # minimum depth of the free floor between a television and the seats, in metres
VIEW = 3.4  # maximum distance from the front of a television to the front of the seats, in metres
OFF_GRID = 0.0005  # offset of a rug's edges from the faces of legs, which would flicker with them, in metres


def television(b: Builder) -> Piece:
    stand = b.draw(storage.tv_stand, b.smaller)
    w, h = b.pick(1.1, 1.25, 1.4), stand.size[2]
    y, tall = 0.14, 0.57 * w
    b.box("black", 0.5, (0.06, 0.26), (h, h + 0.012), seen=True)
    b.box("black", 0.08, (y - 0.02, y + 0.02), (h + 0.012, h + 0.08), seen=True)
    b.box("black", w, (y - 0.02, y + 0.02), (h + 0.07, h + 0.07 + tall))
    b.image(b.own(painting(b.rng, b.look)), w - 0.03, (h + 0.085, h + 0.055 + tall), y + 0.024)
    b.clutter(0.1, (0.12, 0.3), h, 1, stand.size[0] / 2 - 0.16 if w + 0.4 < stand.size[0] else 0.0)
    if w + 0.4 >= stand.size[0]:
        b.geoms = b.geoms[:4]
    screen = b.piece((w, 0.2, h + tall + 0.1), parts=((-w / 2, 0.1, w / 2, 0.18, h + 0.07 + tall),))
    return group(b.kind, [(stand, 0, 0, 0), (screen, 0, 0.02, 0)], use=stand.use)


def lounge(b: Builder) -> Piece:
    """Create seats around a table that face a television or stove, which is `fit[1]` beside their middle.

    If the distance allows it, the seats stand at the opposite wall, which is `fit[0]` away.
    """
    focus = b.draw(stove if b.chance(0.2) else television, b.smaller)
    corner = b.smaller == 0 and b.chance(0.4)
    kind = seats.corner_sofa if corner else seats.sofa if b.smaller < 3 else seats.armchair
    sofa = b.draw(kind, b.smaller)
    deep, gap = focus.size[1], (b.pick(2.1, 2.4, 2.7), b.pick(2.0, 2.2), 1.7, 1.4)[min(b.smaller, 3)]
    depth, aside, _ = b.fit or (0.0, 0.0, 0.0)
    seat = sofa.parts[0].spot[3]
    longest = VIEW - (deep - focus.parts[0].spot[3]) - (sofa.size[1] - seat)
    across = depth - deep - sofa.size[1]
    gap = across if FREE < across < longest else min(gap, longest)
    back = deep + gap + sofa.size[1]
    members = [(focus, aside, 0.0, 0.0), (sofa, 0.0, back, math.pi)]
    front = back - seat
    # A full-size table would reach into the long part of a corner sofa.
    table = b.draw(tables.coffee_table, b.smaller + corner)
    long = sofa.parts[-1].spot
    # The sofa is rotated by half a turn, which swaps left and right.
    x = math.copysign(0.46, long[0] + long[2]) if corner else 0.0
    y = front - 0.64 - table.size[1]
    if y - deep > 0.7:
        members.append((table, x, y, 0.0))
    if b.smaller < 3 and b.chance(0.85):
        wide, half = min(b.pick(2.0, 2.4), sofa.size[0]), min(gap / 2 - 0.1, b.pick(0.7, 0.85))
        rug = b.draw(decoration.rug, fit=(wide + 2 * OFF_GRID, 2 * (half + OFF_GRID), 0.0))
        members.append((rug, 0.0, (deep + front) / 2 + 0.25 - half - OFF_GRID, 0.0))
    use = (aside - 0.4, deep, aside + 0.4, deep + 0.6)
    return group(b.kind, members, use=(use,))


def piano(b: Builder) -> Piece:
    w, d, h = 1.42, 0.6, b.pick(1.1, 1.18)
    paint = b.pick("black", b.wood, "white")
    b.shadow(w, (0, d))
    b.box(paint, w, (0, 0.34), (0, h))
    b.box(paint, w, (0.34, d), (0.56, 0.68))
    for x in (-w / 2 + 0.04, w / 2 - 0.04):
        b.box(paint, 0.08, (0.34, d), (0, 0.56), x)
        b.box(paint, 0.08, (0.34, d), (0.68, 0.76), x, seen=True)
    b.box("piano_keys", w - 0.16, (0.4, d - 0.02), (0.68, 0.705), seen=True)
    b.image("linen", 0.34, (0.84, 1.05), 0.35, thick=0.006)
    b.clutter(0.8 * w, (0.08, 0.26), h, 2)
    base, stool = b.piece((w, d, h + 0.3), use=0.7), b.draw(seats.stool)
    members = [(base, 0.0, 0.0, 0.0)]
    return group(b.kind, [*members, pushed_in(members, stool, 0.0, d - 0.1, math.pi)], use=())


def stove(b: Builder) -> Piece:
    w, d, h = b.pick(0.45, 0.5), b.pick(0.4, 0.45), b.pick(0.95, 1.1)
    paint = b.pick("black", "dark", "cream")
    b.shadow(w, (0.1, 0.1 + d))
    b.box("dark", w + 0.3, (0.0, d + 0.3), (0.001, 0.004), seen=True)
    b.box(paint, w, (0.1, 0.1 + d), (0.08, h))
    b.legs("black", w, (0.1, 0.1 + d), 0.08, 0.05)
    y = 0.1 + d
    b.box("black", w - 0.1, (y, y + 0.012), (0.42, 0.85), seen=True)
    b.box("orange", w - 0.2, (y + 0.004, y + 0.014), (0.46, 0.6), seen=True)
    for x, tall in ((-0.06, 0.05), (0.0, 0.075), (0.06, 0.045)):
        b.soft("shade", (x, y + 0.012, 0.47 + tall), (0.025, 0.008, tall))
    b.box("chrome", 0.012, (y + 0.01, y + 0.04), (0.55, 0.72), w / 2 - 0.07, seen=True)
    b.post("black", 0, 0.2, (h, 2.6), 0.07)
    for i in range(5):
        b.rod(b.wood, (w / 2 + 0.12, 0.1, 0.07 + 0.1 * i), (w / 2 + 0.12, 0.38, 0.07 + 0.1 * i), 0.05)
    b.guard(0.14, (0.1, 0.38), (0, 0.5), w / 2 + 0.12)
    parts = ((-w / 2, 0.0, w / 2, y, 2.6), (w / 2, 0.0, w / 2 + 0.19, 0.38, 0.5))
    return b.piece((w + 0.38, d + 0.3, 2.6), use=((-w / 2, y, w / 2, y + 0.6),), parts=parts)


def aquarium(b: Builder) -> Piece:
    w, d, h = b.pick(0.8, 1.0), 0.42, 0.72
    b.carcass(b.wood, w, d, (0, h))
    b.fronts(b.wood2, w, (0.05, h - 0.02), d - 0.035, 2, 1, doors=True)
    b.guard(w - 0.04, (0.02, d - 0.03), (h, h + 0.48))
    b.box("soil", w - 0.06, (0.03, d - 0.04), (h, h + 0.05), seen=True)
    b.box("accent_d", w - 0.06, (0.025, 0.03), (h + 0.05, h + 0.4), seen=True)
    for i in range(4):
        at = (float(b.rng.uniform(-0.35, 0.35)) * w, float(b.rng.uniform(0.12, 0.3)), h + 0.12 + 0.07 * i)
        b.soft(b.pick("accent_a", "accent_b", "accent_c"), at, (0.05, 0.015, 0.025))
    for x in (-0.3 * w, 0.1 * w, 0.36 * w):
        b.soft("leaves", (x, 0.12, h + 0.16), (0.03, 0.03, 0.13))
    b.box("water", w - 0.05, (0.031, d - 0.035), (h + 0.4, h + 0.403), seen=True)
    b.box("pane", w - 0.04, (d - 0.035, d - 0.03), (h, h + 0.44), seen=True)
    b.box("black", w - 0.02, (0.01, d - 0.02), (h + 0.44, h + 0.49), seen=True)
    return b.piece((w, d, h + 0.49), use=0.6)


def coat_rack(b: Builder) -> Piece:
    w = b.size(0.8, 1.2, 0.1)
    b.box(b.wood, w, (0.0, 0.02), (1.45, 1.75), seen=True)
    b.box(b.wood, w, (0.0, 0.26), (1.75, 1.775), seen=True)
    b.guard(w, (0, 0.24), (0, 1.75))
    count = round(w / 0.2)
    for i in range(count):
        x = w * ((i + 0.5) / count - 0.5)
        b.rod(b.metal, (x, 0.02, 1.6), (x, 0.09, 1.62), 0.01)
        if b.chance(0.65):
            cloth, long = b.pick(*b.look.cloths, *b.look.accents), b.pick(0.4, 0.55)
            b.rod(cloth, (x, 0.13, 1.5), (x, 0.13, 1.6 - 2 * long), 0.07, shape="capsule")
            for u in (-0.07, 0.07):
                b.rod(cloth, (x + u, 0.14, 1.46), (x + u, 0.14, 1.0), 0.03, shape="capsule")
    b.box("wicker", 0.3, (0.04, 0.22), (1.775, 1.9), -0.2 * w, seen=True)
    b.box(b.wood, w, (0.02, 0.24), (0.18, 0.2), seen=True)
    b.legs(b.wood, w, (0.02, 0.24), 0.19, 0.02, 0.012)
    for i in range(count):
        x = w * ((i + 0.5) / count - 0.5)
        if b.chance(0.7):
            shoe, z = b.pick("dark", "white", b.cloth, "accent_a"), b.pick(0.0, 0.2)
            for u in (-0.04, 0.04):
                b.soft(shoe, (x + u, 0.13, z + 0.05), (0.035, 0.1, 0.05))
    return b.piece((w, 0.26, 1.9), use=0.62)


def umbrella_stand(b: Builder) -> Piece:
    r = 0.13
    b.shadow(2 * r, (0, 2 * r), round_one=True)
    b.guard(2 * r - 0.04, (0.02, 2 * r - 0.02), (0, 0.5))
    b.post(b.pick(b.metal, "pot_a", "pot_b"), 0, r, (0, 0.48), r - 0.005)
    b.post("dark", 0, r, (0.48, 0.483), r - 0.02)
    for i in range(b.pick(1, 2)):
        x = 0.05 - 0.1 * i
        b.rod(b.pick(*b.look.accents), (0.5 * x, r, 0.4), (x, r, 0.78), 0.025)
        b.rod(b.wood, (x, r, 0.78), (x, r, 0.9), 0.01)
    return b.piece((2 * r, 2 * r, 0.9))
