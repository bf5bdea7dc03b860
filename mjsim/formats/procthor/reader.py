"""Import ProcTHOR houses. Objects are replaced by mjsim furniture of the same size."""

import math
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator
from pathlib import Path
from xml.sax.saxutils import quoteattr

import numpy as np
from trimesh.transformations import rotation_matrix

from mjsim.formats.mjcf_reader import read_mjcf
from mjsim.formats.procthor.furniture import AssetDatabase, FurnitureLibrary, in_our_style
from mjsim.formats.procthor.plan import PlanOpening, PlanWall, ProcthorPlan, Thing, read_plan
from mjsim.formats.scene.source_scene import HouseOptions, ImportDecision, NamedRoom, SourceScene, left_out
from mjsim.formats.scene.surface import Floats
from mjsim.generator.files import used_materials
from mjsim.generator.palette import surfaces
from mjsim.generator.programme import use_of
from mjsim.generator.values import WALL, HomePlan, Rectangle, Room
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.validation.object_rules import SIZE

SUFFIXES = (".json",)
_ON = 0.05  # maximum distance between an opening and its wall, in metres
_THICK = {"door": 0.04, "window": 0.02}  # thickness of door and window panels, in metres


def read_procthor(path: Path, options: HouseOptions) -> SourceScene:
    """Read a ProcTHOR house. Raise `AssetError` if the file is not valid or its floor plan cannot be used."""
    plan, things = read_plan(path)
    assets = AssetDatabase.read(options.models)
    types = [(thing, assets.type_of(thing)) for thing in _flat(things)]
    with tempfile.TemporaryDirectory() as folder:
        library = FurnitureLibrary({kind for _, kind in types}, Path(folder))
        shell = read_mjcf(_write_shell(plan, Path(folder) / "shell.xml"), options)
        library.take(read_mjcf(library.file, options).pieces)
    pieces = list(shell.pieces)
    ours: Counter[str] = Counter()
    boxes: Counter[str] = Counter()
    small: list[str] = []
    for thing, kind in types:
        size = assets.size_of(thing, kind)
        lifted = size is not None and not kind and thing.position.y - size[2] / 2 > 0.1
        if size is None or size.max() <= SIZE[1] or lifted:
            small.append(thing.id.split("|")[0])
            continue
        found, like = library.placed(thing, kind, size, _frame(thing))
        (ours if like else boxes)[like or kind or "other"] += 1
        pieces += found
    doors = [opening for opening in plan.openings if opening.is_door]
    front = sum(len(door.rooms) < 2 for door in doors)
    notes = [
        ImportDecision(
            "plan",
            f"{len(plan.rooms)} rooms, {len(doors)} doors, {len(plan.openings) - len(doors)} windows",
            f"walls are {WALL} m thick; doors between rooms stand open, {front} to the outside are shut",
        ),
        ImportDecision("furniture", f"{ours.total()} of our kinds", f"in the source's size: {_listed(ours)}"),
        ImportDecision("sizes", assets.source, "a house's JSON names assets, not their sizes"),
    ]
    if boxes:
        reason = f"no kind of ours is similar: {_listed(boxes)}"
        notes.append(ImportDecision("boxes", str(boxes.total()), reason))
    if small:
        notes.append(left_out(f"{len(small)} small or unknown", _listed(Counter(small))))
    return SourceScene(tuple(pieces), "ProcTHOR house", tuple(notes), plan.rooms)


def _listed(counts: Counter[str]) -> str:
    return ", ".join(f"{count} {name}" for name, count in sorted(counts.items())[:12]) or "none"


def _flat(things: Iterable[Thing]) -> Iterator[Thing]:
    for thing in things:
        yield thing
        yield from _flat(thing.children)


def _frame(thing: Thing) -> Floats:
    """Return the transform (4, 4) from the frame at an object's centre to the frame of the house."""
    frame: Floats = np.asarray(rotation_matrix(-math.radians(thing.rotation.y), [0, 0, 1]))
    frame[:3, 3] = thing.position.x, thing.position.z, thing.position.y
    return frame


def _write_shell(plan: ProcthorPlan, path: Path) -> Path:
    rooms = []
    for room in plan.rooms:
        low, high = np.min(room.boxes, axis=0), np.max(room.boxes, axis=0)
        rooms.append(Room(room.key, use_of(room.key), room.label, Rectangle(*low[:2], *high[2:])))
    daylight = '<material name="daylight" rgba="0.72 0.85 0.95 1"/>'
    materials = [*surfaces(0, HomePlan(tuple(rooms), (), ())), daylight]
    height = max((wall.height for wall in plan.walls), default=2.5)
    geoms: list[str] = []
    for room in plan.rooms:
        for x0, y0, x1, y1 in room.boxes:
            place = f"{(x0 + x1) / 2:.4f} {(y0 + y1) / 2:.4f}"
            half = f"{(x1 - x0) / 2:.4f} {(y1 - y0) / 2:.4f} 0.05"
            for kind, z in (("floor", -0.05), ("ceiling", height + 0.05)):
                material = f"floor_{room.key}" if kind == "floor" else kind
                geoms.append(
                    f'<geom name="{kind} {len(geoms)}" material="{material}" pos="{place} {z:.4f}" size="{half}"/>'
                )
    for wall in plan.walls:
        material = f"wall_{_beside(plan, wall)}"
        for part in _parts(wall, plan.openings):
            geoms.append(_slab(f"wall {len(geoms)}", wall, WALL, material, *part))
    for one in plan.openings:
        if not (one.is_door and len(one.rooms) > 1):
            kind, material = ("door", "entrance") if one.is_door else ("window", "daylight")
            wall = PlanWall(one.start, one.end, 0.0)
            span = (0.0, math.dist(one.start, one.end), one.bottom, one.top)
            name = "front entrance" if one.is_door else "window pane"
            geoms.append(_slab(f"{name} {len(geoms)}", wall, _THICK[kind], material, *span))
    world = "\n".join(geoms)
    used = used_materials(world, materials, (), models_root())
    path.write_text(in_our_style(world, used), encoding="utf-8")
    return path


def _beside(plan: ProcthorPlan, wall: PlanWall) -> str:
    x, y = np.add(wall.start, wall.end) / 2

    def distance(room: NamedRoom) -> float:
        return min(math.hypot(max(a - x, x - c, 0), max(b - y, y - d, 0)) for a, b, c, d in room.boxes)

    return min(plan.rooms, key=distance).key


def _parts(wall: PlanWall, openings: Iterable[PlanOpening]) -> Iterator[tuple[float, float, float, float]]:
    """Yield the solid parts of a wall around its openings as (start, end, bottom, top) in metres."""
    start, length = np.array(wall.start), math.dist(wall.start, wall.end)
    along = np.subtract(wall.end, start) / length
    at = -WALL / 2  # walls extend by half their thickness, to close the corners
    holes = []
    for one in openings:
        ends = np.array([one.start, one.end]) - start
        away = np.abs(ends @ (-along[1], along[0])).max()
        low, high = sorted((ends @ along).tolist())
        if away < _ON and high > 0 and low < length:
            holes.append((max(low, 0.0), min(high, length), one.bottom, one.top))
    for low, high, bottom, top in sorted(holes):
        low = max(low, at)
        if high - low < 0.02:
            continue
        if low - at > 0.001:
            yield at, low, 0.0, wall.height
        if bottom > 0.02:
            yield low, high, 0.0, bottom
        if top < wall.height - 0.02:
            yield low, high, top, wall.height
        at = high
    if length + WALL / 2 - at > 0.001:
        yield at, length + WALL / 2, 0.0, wall.height


def _slab(
    name: str, wall: PlanWall, thickness: float, material: str,
    low: float, high: float, bottom: float, top: float,
) -> str:  # fmt: skip
    along = np.subtract(wall.end, wall.start) / max(math.dist(wall.start, wall.end), 1e-6)
    x, y = np.array(wall.start) + along * (low + high) / 2
    size = f"{(high - low) / 2:.4f} {thickness / 2:.4f} {(top - bottom) / 2:.4f}"
    return (
        f'<geom name={quoteattr(name)} material="{material}" pos="{x:.4f} {y:.4f} {(bottom + top) / 2:.4f}" '
        f'size="{size}" euler="0 0 {math.atan2(along[1], along[0]):.6f}"/>'
    )
