"""Decorate rooms with pictures, curtains, lamps, rugs and radiators."""

import itertools
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from mjsim.generator.furniture.appearance import Appearance
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.piece import Piece, Point, Spot, flattened, moved, moved_point, overlap
from mjsim.generator.openings import gaps
from mjsim.generator.poses import WALL_GAP
from mjsim.generator.space import BLINDS, PiecePose, Space, footprint
from mjsim.generator.values import BACK, SIDES, HomePlan, Rectangle, Side, Window
from mjsim.house.catalogue.generated_names import stream

LOW = 1.15  # maximum height of furniture below a wall decoration, in metres
BESIDE_TILES = 0.3  # minimum distance between kitchen tiles and a wall decoration, in metres
LAMPS_APART = 0.8  # minimum distance between a ceiling lamp and a pendant lamp, in metres
LARGE = 15.0  # minimum floor area of a room that gets a large rug, in square metres
LONG = 2.0  # minimum length of free wall that is always decorated, in metres
MOST_HUNG = 4  # maximum number of wall decorations per room, because each picture needs a texture
_WALLS: dict[str, tuple[str, ...]] = {
    "hall": ("picture", "wall_mirror", "picture", "clock"),
    "kitchen": ("clock", "picture", "wall_shelf", "pinboard"),
    "office": ("pinboard", "picture", "wall_shelf", "clock"),
    "child": ("picture", "wall_shelf", "picture", "pinboard"),
    "bathroom": ("picture",),
    "shower_room": ("picture",),
    "utility": ("clock", "picture", "wall_shelf", "picture"),
}
_RUGS: dict[str, tuple[str, ...]] = {
    "hall": ("runner",),
    "living_room": ("rug", "round_rug"),
    "bedroom": ("rug", "round_rug", "runner"),
    "child": ("round_rug", "rug"),
    "office": ("rug", "round_rug"),
    "studio": ("rug", "round_rug"),
    "dining_room": ("round_rug",),
    "bathroom": ("bath_mat",),
    "shower_room": ("bath_mat",),
}


def decorate(
    spaces: Sequence[Space], uses: Mapping[str, str], plan: HomePlan, look: Appearance, seed: int
) -> None:
    """Add decoration to all rooms. Only radiators take up floor space."""
    for door in plan.doors:
        if door.is_front:
            space = next(s for s in spaces if s.room.key == door.rooms[0])
            mat = KINDS["door_mat"].make(stream(seed, "door_mat"), look)
            x, y = space.room.floor.along(door.side, door.center, door.center, 0.15, 0.15).center
            place = PiecePose(x, y, BACK[door.side], door.side, door.center)
            # A mat on the rug of a living room would flicker.
            if not any(overlap(footprint(mat, place), spot) for spot in _rugs(space)):
                space.record(mat, place)
    for space in spaces:
        key, use = space.room.key, uses[space.room.key]
        for window in plan.windows_of(key):
            _dress_window(
                space, window, use, look, stream(seed, "window", key, window.side, f"{window.center:.2f}")
            )
        _hang_lamps(space, look, stream(seed, "lamp", key))
        _lay_rug(space, use, look, stream(seed, "rug", key))
        _hang_on_walls(space, use, look, stream(seed, "wall", key))


def _rugs(space: Space) -> Iterator[Spot]:
    for piece, place in space.stood:
        for member, *pose in flattened(piece, place.x, place.y, place.yaw):
            if member.kind == "rug":
                yield moved((-member.size[0] / 2, 0, member.size[0] / 2, member.size[1]), *pose)


def _at_wall(space: Space, side: Side, along: float) -> PiecePose:
    x, y = space.room.floor.along(side, along, along, 0.0, 0.0).center
    return PiecePose(x, y, BACK[side], side, along)


def _tallest(space: Space, side: Side, start: float, end: float, deep: float) -> float:
    zone = space.room.floor.along(side, start, end, 0.0, deep).spot
    return max((solid[4] for solid in space.solids if overlap(solid, zone)), default=0.0)


def _dress_window(space: Space, window: Window, use: str, look: Appearance, rng: np.random.Generator) -> None:
    side, half = window.side, window.width / 2
    fit = (window.width, window.sill, window.top)
    low, high = space.room.floor.wall(side)
    below = _tallest(space, side, window.center - half, window.center + half, 0.5)
    if below == 0.0 and window.sill > 0.55 and use != "kitchen":
        radiator = KINDS["radiator"].make(rng, look, fit=fit)
        place = _at_wall(space, side, window.center)
        spots = [moved(part.spot, place.x, place.y, place.yaw) for part in radiator.parts]
        if space.is_clear(radiator, place) and space.connected(spots):
            space.stand(radiator, place, spots, (), spots)
            below = radiator.size[2]
    reach = half + 0.33
    room = window.center - reach > low and window.center + reach < high
    dry = use not in BLINDS
    top = _tallest(space, side, window.center - reach, window.center + reach, 0.15)
    if dry and room and top < window.sill - 0.2 and rng.random() < 0.8:
        beside = max(
            _tallest(space, side, window.center + a, window.center + b, 0.15)
            for a, b in ((-reach, -half), (half, reach))
        )
        curtains = KINDS["curtains"].make(rng, look, smaller=int(beside > 0 or rng.random() < 0.25), fit=fit)
        if space.is_clear(curtains, _at_wall(space, side, window.center)):
            space.record(curtains, _at_wall(space, side, window.center))
            return
    if rng.random() < 0.8:
        blind = KINDS[("blind", "roller_blind")[int(rng.integers(2))]].make(rng, look, fit=fit)
        space.record(blind, _at_wall(space, side, window.center))


def _hang_lamps(space: Space, look: Appearance, rng: np.random.Generator) -> None:
    floor = space.room.floor
    hanging = [
        moved_point((0.0, 0.3, 0.0), x, y, yaw)
        for piece, at in space.stood
        for member, x, y, yaw in flattened(piece, at.x, at.y, at.yaw)
        if member.kind == "pendant_lamp"
    ]
    longer = max(floor.width, floor.depth)
    lamp = KINDS["ceiling_lamp"].make(rng, look)
    count = 2 if longer > 4.8 and longer > 1.5 * min(floor.width, floor.depth) else 1
    for i in range(count):
        share = (i + 0.5) / count
        x, y = floor.center
        if floor.width >= floor.depth:
            x = floor.x0 + share * floor.width
        else:
            y = floor.y0 + share * floor.depth
        if all(max(abs(x - u), abs(y - v)) > LAMPS_APART for u, v, _ in hanging):
            space.record(lamp, PiecePose(x, y, 0 if floor.width >= floor.depth else 1, None))


def _lay_rug(space: Space, use: str, look: Appearance, rng: np.random.Generator) -> None:
    if use not in _RUGS or any(_rugs(space)) or (rng.random() > 0.85 and space.room.floor.area < LARGE):
        return
    kinds = _RUGS[use]
    kind = kinds[int(rng.integers(len(kinds)))] if space.room.floor.area < LARGE else kinds[0]
    taken = [*space.solids, *(footprint(piece, at) for piece, at in space.stood if piece.kind == "door_mat")]
    sizes: list[tuple[int, tuple[float, float, float] | None]] = [(0, None), (1, None)]
    if space.room.floor.area > LARGE and kind == "rug":
        sizes = [(0, (2.8, 1.9, 0.0)), (0, (2.2, 1.5, 0.0)), *sizes]
    for smaller, fit in sizes:
        rug = KINDS[kind].make(rng, look, smaller=smaller, fit=fit)
        if kind == "bath_mat":
            baths = [(p, at) for p, at in space.stood if p.kind in ("bathtub", "shower")]
            places = [PiecePose(*_before(p, at)[:2], at.turns, None) for p, at in baths]
        else:
            places = _rug_poses(space, rug)
        for place in places:
            spot = footprint(rug, place)
            if not any(overlap(spot, other) for other in taken):
                space.record(rug, place)
                return


def _before(piece: Piece, place: PiecePose) -> Point:
    return moved_point((0, piece.size[1] + 0.04, 0), place.x, place.y, place.yaw)


def _rug_poses(space: Space, rug: Piece) -> list[PiecePose]:
    floor, found = space.room.floor, []
    for turns in (0, 1):
        w, d = (rug.size[0], rug.size[1]) if turns == 0 else (rug.size[1], rug.size[0])
        xs = np.arange(floor.x0 + w / 2 + 0.12, floor.x1 - w / 2 - 0.12, 0.1).tolist()
        ys = np.arange(floor.y0 + d / 2 + 0.12, floor.y1 - d / 2 - 0.12, 0.1).tolist()
        for x, y in itertools.product(xs, ys):
            away = abs(x - floor.center[0]) + abs(y - floor.center[1])
            at = PiecePose(x, y - d / 2, 0, None) if turns == 0 else PiecePose(x + w / 2, y, 1, None)
            found.append((round(away, 3), at.x, at.y, turns, at))
    return [at for *_, at in sorted(found, key=lambda f: f[:4])]


def _hang_on_walls(space: Space, use: str, look: Appearance, rng: np.random.Generator) -> None:
    kinds = _WALLS.get(use, ("picture", "picture", "wall_shelf", "picture"))
    if use in ("bedroom", "living_room"):
        kinds = ("picture", "wall_lamp", "picture", "wall_mirror")
    hung = 0
    found = [
        (side, *stretch)
        for side in (SIDES[i] for i in rng.permutation(4))
        for stretch in _stretches(space, side, *space.room.floor.wall(side))
    ]
    # Start with long stretches of wall, which would look bare without decoration.
    found.sort(key=lambda stretch: stretch[2] - stretch[1] < LONG)
    for side, start, end in found:
        if hung >= MOST_HUNG or (rng.random() > 0.75 and end - start < LONG):
            continue
        kind = kinds[hung % len(kinds)]
        piece = KINDS[kind].make(rng, look, smaller=int(end - start < 1.5))
        if piece.size[0] + 0.3 > end - start:
            continue
        middle = _over(space, side, start + piece.size[0] / 2 + 0.1, end - piece.size[0] / 2 - 0.1)
        if kind == "wall_mirror" and _tallest(space, side, middle - 0.4, middle + 0.4, 0.4) > 0.3:
            piece = KINDS["picture"].make(rng, look, smaller=1)
        if space.is_clear(piece, _at_wall(space, side, middle)):
            space.record(piece, _at_wall(space, side, middle))
            hung += 1


def _stretches(space: Space, side: Side, low: float, high: float) -> list[tuple[float, float]]:
    blocked = [(a, b) for s, a, b, _ in space.hung if s == side]
    deep = space.room.floor.along(side, low, high, 0.0, 0.4).spot
    tiled = [
        (*moved(part.spot, at.x, at.y, at.yaw), LOW + 1)  # keeps the wall tiles above the worktop free
        for piece, at in space.stood
        for part in piece.parts
        if "kitchen" in piece.kind
    ]
    for x0, y0, x1, y1, top in (*space.solids, *tiled):
        if top > LOW and overlap((x0, y0, x1, y1), deep):
            apart = BESIDE_TILES if top == LOW + 1 else 0.05
            start, end = Rectangle(x0, y0, x1, y1).wall(side)
            blocked.append((start - apart, end + apart))
    return [(a, b) for a, b in gaps(low + WALL_GAP, high, blocked) if b - a > 0.7]


def _over(space: Space, side: Side, first: float, last: float) -> float:
    for piece, place in space.stood:
        if place.side == side and piece.parts and first <= place.along <= last and piece.size[0] > 0.7:
            return place.along
    return (first + last) / 2
