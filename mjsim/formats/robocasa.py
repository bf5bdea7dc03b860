"""Import RoboCasa kitchen layouts from YAML files. All parts become boxes, as layouts contain no meshes."""

import math
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
import yaml
from trimesh.transformations import rotation_matrix, translation_matrix

from mjsim.formats.scene.mesh_files import primitive
from mjsim.formats.scene.source_scene import HouseOptions, ImportDecision, ScenePiece, SourceScene, left_out
from mjsim.formats.scene.surface import Floats
from mjsim.support.files import read_text
from mjsim.values.errors import AssetError, brief

SUFFIXES = (".yaml", ".yml")
# Default width, depth and height of fixtures whose size may be missing from a layout, in metres.
_SIZES = {
    "counter": (1.0, 0.65, 0.92),
    "stove": (0.76, 0.66, 0.92),
    "stove_wide": (1.2, 0.66, 0.92),
    "stovetop": (0.76, 0.55, 0.1),
    "oven": (0.76, 0.6, 0.7),
    "microwave": (0.76, 0.45, 0.42),
    "hood": (0.76, 0.5, 0.6),
    "sink": (0.75, 0.45, 0.2),
    "dishwasher": (0.6, 0.6, 0.85),
    "fridge_french_door": (0.85, 0.8, 1.78),
    "fridge_side_by_side": (0.85, 0.8, 1.75),
    "fridge_bottom_freezer": (0.78, 0.8, 1.75),
    "stool": (0.42, 0.42, 0.72),
    **dict.fromkeys(("stack", "box", "drawer"), (0.6, 0.6, 0.84)),
    **dict.fromkeys(("hinge_cabinet", "single_cabinet", "open_cabinet"), (0.6, 0.4, 0.9)),
    **dict.fromkeys(("panel_cabinet", "housing_cabinet"), (0.6, 0.4, 0.9)),
}
_COLOURS = {"counter": 0xD8D3C8, "wall": 0xEDE8DF, "floor": 0xB08D66, "steel": 0xA9AEB3, "wood": 0xC9B08C}
_STEEL = ("stove", "oven", "microwave", "hood", "dishwasher", "fridge", "sink")
# Types of small wall fixtures that are not imported.
_SMALL = ("window", "window_proc", "wall_accessory", "utensil_rack")
_AXES = (("left", "right"), ("front", "back"), ("bottom", "top"))
# Height of the plinth below a stack, thickness of worktops, and setback of cabinet fronts, in metres.
_BASE, _TOP, _SET_BACK = 0.05, 0.04, 0.12
# For each side of the room, the axis and the sign of the outward direction.
_SIDES = {"left": (0, -1), "right": (0, 1), "back": (1, 1), "front": (1, -1)}
_WALL, _BACKING = 0.02, 0.1  # half thickness of a wall, and half thickness of its backing, in metres


def read_robocasa(path: Path, options: HouseOptions) -> SourceScene:
    """Read a kitchen layout. Raise `AssetError` if the file is damaged or contains an unknown fixture."""
    del options  # layouts always use metres and have z up
    try:
        layout = yaml.safe_load(read_text(path))
    except (OSError, UnicodeDecodeError, yaml.YAMLError, RecursionError) as error:
        raise AssetError(brief(f"cannot read {path}: {error}; is it complete?")) from error
    if not isinstance(layout, dict) or "room" not in layout:
        raise AssetError(f"{path} is YAML without a room; give a kitchen layout of RoboCasa")
    reader = _LayoutReader()
    try:
        pieces = [piece for key, group in layout.items() for piece in reader.group(key, group)]
    except (AssetError, KeyError, TypeError, ValueError, AttributeError, IndexError) as error:
        said = error if isinstance(error, AssetError) else f"{type(error).__name__}: {error}"
        raise AssetError(brief(f"{path}, fixture {reader.name!r}: {said}; correct the layout")) from error
    return SourceScene(tuple(pieces), "RoboCasa layout", reader.notes())


class _LayoutReader:
    def __init__(self) -> None:
        self.name = ""  # name of the current fixture
        self._left_out: dict[str, int] = {}

    def notes(self) -> tuple[ImportDecision, ...]:
        small = ", ".join(f"{n} {kind}" for kind, n in sorted(self._left_out.items()))
        boxes = ImportDecision("fixtures", "boxes", "the layout has sizes and places; meshes are RoboCasa's")
        return (boxes, left_out(small, "on walls and worktops")) if small else (boxes,)

    def group(self, key: str, group: Mapping[str, Any]) -> Iterator[ScenePiece]:
        origin, place = ([*group.get(name, (0, 0)), 0] for name in ("group_origin", "group_pos"))
        turn = rotation_matrix(group.get("group_z_rot", 0.0), [0, 0, 1])
        frame = translation_matrix(place) @ turn @ translation_matrix(-np.array(origin, float))
        known: dict[str, tuple[Floats, Floats]] = {}  # centre and size of each fixture in the group, by name
        for fixtures in group.values():
            for fixture in fixtures if isinstance(fixtures, list) else ():
                if isinstance(fixture, dict) and fixture.get("enable", True):
                    self.name = str(fixture.get("name"))
                    yield from self._fixture(fixture, known, frame, f"{self.name}_{key}")

    def _fixture(
        self, fixture: dict[str, Any], known: dict[str, tuple[Floats, Floats]], frame: Floats, name: str
    ) -> Iterator[ScenePiece]:
        kind = fixture["type"]
        if kind in ("wall", "floor"):
            yield _box(name, kind, *_flat(fixture, kind), np.eye(4))
            return
        if kind in _SMALL or "placement" in fixture:
            self._left_out[kind] = self._left_out.get(kind, 0) + 1
            return
        if kind not in _SIZES:
            raise AssetError(f"its type {kind!r} is not known")
        size = _size(fixture, kind, known)
        inside = fixture.get("interior_obj")
        placed = "pos" in fixture or "align_to" in fixture
        centre = _centre(fixture, size, known)
        known[self.name] = centre, size
        if not placed:  # a fixture without a position is drawn as part of its container
            return
        if "z_rot" in fixture:
            spin = rotation_matrix(fixture["z_rot"], [0, 0, 1])
            frame = frame @ translation_matrix(centre) @ spin @ translation_matrix(-centre)
        if kind == "counter":
            yield from _counter(name, centre, size, frame)
        else:
            base = np.array([0.0, 0.0, _BASE if kind == "stack" else 0.0])
            centre, size = centre - base / 2, size + base
            shown = f"{inside}_{name}" if kind == "housing_cabinet" else name
            yield _box(shown, kind, centre, size, frame)
        if kind == "counter" and inside is not None:
            share = np.array([fixture.get("obj_x_percent", 0.5) - 0.5, 0.0, 0.5])
            lid = np.array([*known[inside][1][:2], 0.02])
            yield _box(f"{inside}_{name}", "sink", centre + share * (size - [*lid[:2], 0.0]), lid, frame)


def _size(fixture: Mapping[str, Any], kind: str, known: Mapping[str, tuple[Floats, Floats]]) -> Floats:
    size = list(_SIZES[kind])
    if kind == "housing_cabinet":
        inner, padding = known[fixture["interior_obj"]][1], fixture.get("padding") or [None] * 3
        size = [float(i + sum(v or 0.0 for v in p or ())) for i, p in zip(inner, padding, strict=True)]
    for axis, given in enumerate(fixture.get("size") or ()):
        if given is not None:
            size[axis] = known[given][1][axis] if isinstance(given, str) else float(given)
    if "stack_height" in fixture:
        size[2] = fixture["stack_height"] - sum(known[name][1][2] for name in fixture["stack_fixtures"])
    if len(size) != 3 or not all(math.isfinite(side) and side > 0 for side in size):
        raise AssetError(f"its size is {size}")
    return np.array(size, float)


def _centre(fixture: Mapping[str, Any], size: Floats, known: Mapping[str, tuple[Floats, Floats]]) -> Floats:
    """Return the centre of a fixture in its group's frame, in metres."""
    if "align_to" not in fixture:
        standing = (0.0, 0.0, size[2] / 2)
        given = fixture.get("pos") or [None] * 3
        return np.array([s if g is None else g for g, s in zip(given, standing, strict=True)], float)
    other, extent = known[fixture["align_to"]]
    centre, side, flush = other.copy(), fixture["side"].lower(), fixture.get("alignment", "").lower()
    for axis, (low, high) in enumerate(_AXES):
        if side in (low, high):
            centre[axis] += (1 if side == high else -1) * (extent[axis] + size[axis]) / 2
        elif low in flush or high in flush:
            centre[axis] += (-1 if low in flush else 1) * (extent[axis] - size[axis]) / 2
    return np.asarray(centre + np.array(fixture.get("offset", (0, 0, 0)), float))


def _flat(fixture: Mapping[str, Any], kind: str) -> tuple[Floats, Floats]:
    """Compute the centre and size of a wall or floor, in metres, from the position of its inner face."""
    centre, half = np.array(fixture["pos"], float), np.array(fixture["size"], float)
    backing = bool(fixture.get("backing"))
    depth = half[2] + 2 * _WALL * backing
    if kind == "floor":
        centre[2] -= depth
        return centre, 2 * half
    axis, out = _SIDES[fixture.get("wall_side", "back")]
    centre[axis] += out * depth
    half[0] += 2 * _WALL + _BACKING * backing
    size = np.array([half[0], half[2], half[1]]) if axis else np.array([half[2], half[0], half[1]])
    return centre, 2 * size


def _counter(name: str, centre: Floats, size: Floats, frame: Floats) -> Iterator[ScenePiece]:
    """Yield a worktop, a cabinet below it that is set back, and one collision shape for both."""
    yield _box(name, "counter", centre, size, frame, seen=False)
    top = np.array([0.0, 0.0, (size[2] - _TOP) / 2])
    yield _box(name, "counter", centre + top, np.array([*size[:2], _TOP]), frame, solid=False)
    less = np.array([0.0, min(_SET_BACK, size[1] / 4), _TOP])
    yield _box(name, "wood", centre + less * [0.0, 0.5, -0.5], size - less, frame, solid=False)


def _box(
    name: str,
    kind: str,
    centre: Floats,
    size: Floats,
    frame: Floats,
    *,
    seen: bool = True,
    solid: bool = True,
) -> ScenePiece:
    key = kind if kind in _COLOURS else "steel" if kind.startswith(_STEEL) else "wood"
    colour = np.array([_COLOURS[key] >> shift & 255 for shift in (16, 8, 0)]) / 255
    mesh = trimesh.creation.box(size).apply_translation(centre).apply_transform(frame)
    return ScenePiece(name, primitive(mesh, colour), seen=seen, solid=solid)
