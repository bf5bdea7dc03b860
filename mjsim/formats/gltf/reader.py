"""Import houses from mesh files such as glTF, GLB and OBJ, and from Habitat scenes."""

import math
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from trimesh.transformations import quaternion_matrix, scale_matrix

from mjsim.formats.gltf.house_marks import HouseMarks, read_marks
from mjsim.formats.scene.mesh_files import GLTF, SCENE_SUFFIXES, Y_TO_Z, read_parts
from mjsim.formats.scene.source_scene import (
    MAX_SIDE,
    UNITS,
    Bin,
    HouseOptions,
    ImportDecision,
    MissingFiles,
    NamedRoom,
    ScenePiece,
    SourceScene,
    boxes_of,
    left_out,
    moved,
    numbers,
    unit_of,
)
from mjsim.formats.scene.surface import Floats
from mjsim.support.files import read_json, read_text
from mjsim.values.errors import AssetError

INSTANCE = ".scene_instance.json"
SEMANTICS = ".semantic_config.json"
# Key in the user_defined section of a Habitat template that marks an exported mjsim bin.
RECEPTACLE = "mjsim_receptacle"


def read_mesh_scene(path: Path, options: HouseOptions) -> SourceScene:
    """Read a house from a mesh file. Each node of the scene becomes a piece."""
    parts = read_parts(path)
    points = np.concatenate([part.surface.corners.reshape(-1, 3) for part in parts])
    sides = np.ptp(points, axis=0)
    frame = np.eye(4)
    notes: list[ImportDecision] = []
    known = path.suffix.lower() in (*GLTF, ".dae")  # True if the format defines unit and vertical axis
    given = options.up or _stage_up(path)
    up = given or ("z" if known else "y" if sides[1] <= sides[2] else "z")
    if up == "y" and not known:
        frame = Y_TO_Z
        notes.append(ImportDecision("up", "y", "given" if given else "the house is lowest along it"))
    elif known and given == ("z" if path.suffix.lower() in GLTF else "y"):
        frame = np.linalg.inv(Y_TO_Z) if up == "z" else Y_TO_Z
    unit, longest = options.units, float(sides.max())
    # Many glTF files use other units than metres, contrary to the standard.
    if unit is None and (not known or longest > MAX_SIDE):
        unit = unit_of(longest) or "m"
        notes.append(ImportDecision("unit", unit, f"then its longest side is {longest * UNITS[unit]:.1f} m"))
    frame = scale_matrix(UNITS[unit or "m"] * options.scale) @ frame
    pieces = tuple(moved(parts, frame))
    marks = (
        read_marks(path) if path.suffix.lower() in GLTF and np.allclose(frame, np.eye(4)) else HouseMarks()
    )
    return SourceScene(
        pieces, f"{path.suffix[1:].upper()} scene", tuple(notes), marks.rooms(), marks.places()
    )


def read_habitat(path: Path, options: HouseOptions) -> SourceScene:
    """Read a Habitat scene with its objects. Raise `AssetError` if a template or its mesh is missing."""
    scene = _read(path)
    missing = MissingFiles(options.skip_missing)
    reader = _HabitatReader(path, missing)
    stage = scene.get("stage_instance")
    if not isinstance(stage, dict):
        raise AssetError(f"{path} has no stage_instance; give the scene of a house")
    pieces = list(reader.instance(stage, "stage"))
    for item in scene.get("object_instances", []):
        pieces += reader.instance(item, "object")
    notes = list(missing.notes())
    if found := scene.get("articulated_object_instances", []):
        notes.append(left_out(f"{len(found)} articulated objects", "URDF is not read"))
    if not pieces:
        raise AssetError(f"{path}: none of its meshes is there; add its stages and objects")
    named = str(scene.get("semantic_scene_instance") or path.name.removesuffix(INSTANCE))
    rooms = reader.rooms(named.rpartition("/")[2])
    return SourceScene(tuple(pieces), "Habitat scene", tuple(notes), rooms, tuple(reader.bins))


def _stage_up(path: Path) -> str | None:
    config = path.with_suffix(".stage_config.json")
    if not config.is_file():
        return None
    return "z" if _is_z_up(_read(config)) else "y"


def _is_z_up(config: dict[str, Any]) -> bool:
    return int(np.argmax(np.abs(numbers(config.get("up", [0, 1, 0]), 3, Path("stage_config.json"))))) == 2


class _HabitatReader:
    def __init__(self, path: Path, missing: MissingFiles) -> None:
        self._path = path
        self._missing = missing
        self.bins: list[Bin] = []
        root = path.resolve().parent.parent
        self._files = {
            p.name: p for p in sorted(root.rglob("*")) if p.name.endswith(("_config.json", *SCENE_SUFFIXES))
        }

    def rooms(self, name: str) -> tuple[NamedRoom, ...]:
        """Return the rooms from a semantic_config.json file, or no rooms if the file is missing."""
        found: dict[str, NamedRoom] = {}
        if (file := self._files.get(name + SEMANTICS)) is None:
            return ()
        for region in _read(file).get("region_annotations") or []:
            text = str(region.get("name", "room")).partition(":")[0]
            key = re.sub(r"[^a-z0-9]+", "_", text.lower()).strip("_") or "room"
            loop = np.array([numbers(point, 3, file) for point in region.get("poly_loop", [])]).reshape(-1, 3)
            try:
                boxes = boxes_of(np.column_stack((loop[:, 0], -loop[:, 2])))
            except ValueError as error:
                raise AssetError(f"{file}: the region {text!r} {error}; correct its poly_loop") from error
            if key in found:
                found[key] = replace(found[key], boxes=(*found[key].boxes, *boxes))
                continue
            label = str(region.get("label") or text)
            label = label[:1].upper() + label[1:]
            same = sum(room.label.rstrip(" 0123456789") == label for room in found.values())
            found[key] = NamedRoom(key, f"{label} {same + 1}" if same else label, boxes)
        return tuple(found.values())

    def instance(self, item: dict[str, Any], kind: str) -> Iterator[ScenePiece]:
        """Yield the pieces of a stage or an object. Their poses are those in the scene, with z up."""
        name = str(item.get("template_name", "")).rpartition("/")[2]
        config_file = self._files.get(f"{name}.{kind}_config.json")
        config = _read(config_file) if config_file else {}
        asset = str(config.get("render_asset", f"{name}.glb"))
        mesh = self._mesh(config_file, asset)
        if mesh is None:
            if not self._missing.skip:
                raise AssetError(
                    f"{self._path} names the {kind} {name!r}, whose mesh {asset} is not there; add it, or leave out "
                    "what is missing with --skip-missing"
                )
            self._missing.files.append(name)
            return
        frame = np.eye(4)
        if (rotation := item.get("rotation")) is not None:
            frame = quaternion_matrix(numbers(rotation, 4, self._path))
        frame[:3, 3] = numbers(item.get("translation", [0, 0, 0]), 3, self._path)
        scale = numbers(config.get("scale", [1, 1, 1]), 3, config_file or self._path)
        scale = scale * float(item.get("uniform_scale", 1.0))
        upright = np.eye(4)
        if _is_z_up(config):  # Habitat rotates meshes with z up so that y is up
            upright = np.linalg.inv(Y_TO_Z)
        own: Floats = Y_TO_Z @ frame @ np.diag([*scale, 1.0]) @ upright @ np.linalg.inv(Y_TO_Z)
        marks = config.get("user_defined")
        mark = marks.get(RECEPTACLE) if isinstance(marks, dict) else None
        if isinstance(mark, dict):
            (x, y, z), yaw = own[:3, 3].tolist(), math.atan2(own[1, 0], own[0, 0])
            key, room, place = (str(mark.get(of)) for of in ("key", "room", "place"))
            self.bins.append(Bin(key, room, x, y, yaw, z, place))
            return
        loose = kind == "object" and str(item.get("motion_type", "dynamic")).lower() == "dynamic"
        collision = self._mesh(config_file, str(config.get("collision_asset", "")))
        for file, seen in ((mesh, True), (collision, False)):
            if file is None:
                continue
            whole = own if file.suffix.lower() in GLTF else own @ Y_TO_Z
            for part in read_parts(file, whole):
                solid, title = not seen or collision is None, part.name if kind == "stage" else name
                yield ScenePiece(title, part.surface, seen and part.seen, solid, loose)

    def _mesh(self, config: Path | None, asset: str) -> Path | None:
        mesh = (config or self._path).parent / asset
        found = mesh if mesh.is_file() else self._files.get(Path(asset).name)
        return found if found and found.name.endswith(SCENE_SUFFIXES) else None


def _read(path: Path) -> dict[str, Any]:
    try:
        found = read_json(read_text(path))
    except (OSError, ValueError) as error:
        raise AssetError(f"cannot read {path}: {error}; is it complete?") from error
    if not isinstance(found, dict):
        raise AssetError(f"{path} is not a JSON object; export it again")
    return found
