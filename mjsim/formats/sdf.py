"""Import Gazebo worlds from SDF files, including models, shapes and meshes. All joints become rigid."""

import os
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh

from mjsim.formats.scene.mesh_colours import PLAIN
from mjsim.formats.scene.mesh_files import MAX_TRIANGLES, primitive, read_parts
from mjsim.formats.scene.source_scene import (
    HouseOptions,
    ImportDecision,
    MissingFiles,
    ScenePiece,
    SourceScene,
    left_out,
    numbers,
)
from mjsim.formats.scene.surface import Floats, Surface
from mjsim.formats.sdf_poses import DEPTH, SavedState, is_true, pose_of
from mjsim.support.files import read_text
from mjsim.values.errors import AssetError

SUFFIXES = (".world", ".sdf")
_VARIABLES = ("GZ_SIM_RESOURCE_PATH", "IGN_GAZEBO_RESOURCE_PATH", "GAZEBO_MODEL_PATH")
_BUILT_IN = ("sun", "ground_plane")  # models that are part of Gazebo
_THIN = 0.002  # thickness of the boxes that replace planes, in metres
_MAX_MODELS = 20_000  # maximum number of models in a world, including nested models
_PLANE = 30.0  # maximum side length of imported planes, in metres


def read_sdf(path: Path, options: HouseOptions) -> SourceScene:
    """Read an SDF world or model. Raise `AssetError` if it is damaged or refers to a missing file."""
    root = _root(path)
    reader = _WorldReader(path, options)
    top = root.find("world")
    state = SavedState(path, None if top is None else top.find("state"))
    pieces: list[ScenePiece] = []
    count = 0
    for piece in reader.world(root if top is None else top, state):
        pieces.append(piece)
        if (count := count + len(piece.surface)) > MAX_TRIANGLES:
            raise AssetError(f"{path} has more than {MAX_TRIANGLES:,} triangles; remove or simplify models")
    if not pieces:
        why = "give the world file of a house"
        if files := reader.missing.files:
            why = (
                f"{len(files)} of its files are missing, such as {files[0]}: pass their folder with --models"
            )
        raise AssetError(f"{path} has no model with a shape or a mesh; {why}")
    return SourceScene(tuple(pieces), "SDF world", (*reader.missing.notes(), *reader.unknown_kinds()))


@dataclass(frozen=True, eq=False)
class _Place:
    name: str  # name of the outermost enclosing model, or an empty string outside of models
    frame: Floats  # transform from the model or link to the world, shape (4, 4)
    folder: Path
    state: SavedState
    static: bool = False
    depth: int = 0  # number of enclosing models


class _WorldReader:
    def __init__(self, path: Path, options: HouseOptions) -> None:
        self._path = path
        near = [folder / name for folder in (path.parent, path.parent.parent) for name in ("", "models")]
        self._folders = [*options.models, *near]
        for variable in _VARIABLES:
            self._folders += [Path(part) for part in os.environ.get(variable, "").split(":") if part]
        self.missing = MissingFiles(options.skip_missing)
        self._unknown: dict[str, int] = {}
        self._count = 0  # number of models that have been read
        self._meshes: dict[Path, list[ScenePiece]] = {}

    def unknown_kinds(self) -> tuple[ImportDecision, ...]:
        return tuple(
            left_out(f"{n} of shape <{kind}>", "it cannot be read") for kind, n in self._unknown.items()
        )

    def world(self, world: ET.Element, state: SavedState) -> Iterator[ScenePiece]:
        """Yield the pieces of all models in a world, at the poses of a saved state."""
        at = _Place("", np.eye(4), self._path.parent, state)
        yield from self._models(world, at)
        inserted = None if state.element is None else state.element.find("insertions")
        if inserted is not None:
            yield from self._models(inserted, at)

    def _models(self, parent: ET.Element, at: _Place) -> Iterator[ScenePiece]:
        if at.depth > DEPTH:
            raise AssetError(f"{self._path} nests models more than {DEPTH} deep; does one include itself?")
        for element in parent.findall("include"):
            yield from self._included(element, at)
        for model in parent.findall("model"):
            placed = replace(at, frame=at.frame @ pose_of(model, self._path, parent))
            yield from self._model(model, placed, model.get("name", "model"))

    def _included(self, element: ET.Element, at: _Place) -> Iterator[ScenePiece]:
        uri = (element.findtext("uri") or "").strip()
        built_in = uri.rpartition("/")[2].lower().replace(" ", "_")
        if built_in == "ground_plane":  # only the height matters, because the house has its own floor
            ground = trimesh.creation.box((_PLANE, _PLANE, _THIN)).apply_translation((0, 0, -_THIN / 2))
            surface = primitive(ground, np.array(PLAIN)).moved(at.frame @ pose_of(element, self._path))
            yield ScenePiece(built_in, surface, seen=False, solid=False)
        if built_in in _BUILT_IN:
            return
        found = self._find(uri, None)
        if found is None:
            return
        file = _model_file(found) if found.is_dir() else found
        model = _root(file).find("model")
        if model is None:
            raise AssetError(f"{file} has no <model>; correct the include of {uri}")
        own = element.find("pose")
        frame = at.frame @ (pose_of(model, file) if own is None else pose_of(element, self._path))
        static = at.static or is_true(element.findtext("static"))
        name = (element.findtext("name") or model.get("name") or "").strip()
        yield from self._model(model, replace(at, frame=frame, folder=file.parent, static=static), name)

    def _model(self, model: ET.Element, at: _Place, own_name: str) -> Iterator[ScenePiece]:
        """Yield the pieces of a model and of its nested models. `at.state` belongs to the enclosing model."""
        if at.depth == 0 and own_name in at.state.deleted:
            return
        self._count += 1
        if self._count > _MAX_MODELS:
            raise AssetError(f"{self._path} has more than {_MAX_MODELS} models; does one include itself?")
        state, name = at.state.of(own_name), at.name or own_name
        static = at.static or is_true(model.findtext("static"))
        at = _Place(name, state.model_frame(at.frame), at.folder, state, static, at.depth + 1)
        for link in model.findall("link"):
            frame = state.link_frame(link.get("name", ""), at.frame @ pose_of(link, self._path, model))
            placed = replace(at, frame=frame)
            visuals = [s for v in link.findall("visual") for s in self._shape(v, placed)]
            solids = [s for c in link.findall("collision") for s in self._shape(c, placed)]
            yield from (ScenePiece(name, s, seen=True, solid=not solids, loose=not static) for s in visuals)
            yield from (ScenePiece(name, s, seen=not visuals, solid=True, loose=not static) for s in solids)
        yield from self._models(model, at)

    def _shape(self, element: ET.Element, at: _Place) -> Iterator[Surface]:
        geometry = element.find("geometry")
        if geometry is None or not len(geometry):
            return
        shape = geometry[0]
        frame = at.frame @ pose_of(element, self._path)
        if shape.tag == "mesh":
            yield from self._mesh(shape, frame, at)
            return
        made = _primitive(shape, self._path)
        if made is None:
            self._unknown[shape.tag] = self._unknown.get(shape.tag, 0) + 1
            return
        made.apply_transform(frame @ np.diag([*at.state.shape_scale(shape.tag, np.ones(3)), 1.0]))
        yield primitive(made, _colour(element))

    def _mesh(self, shape: ET.Element, frame: Floats, at: _Place) -> Iterator[Surface]:
        file = self._find((shape.findtext("uri") or "").strip(), at.folder)
        if file is None:
            return
        if file not in self._meshes:
            try:
                self._meshes[file] = read_parts(file)
            except AssetError:
                if not self.missing.skip:
                    raise
                self._meshes[file] = []
                self.missing.files.append(file.name)
        own = numbers((shape.findtext("scale") or "1 1 1").split(), 3, self._path)
        scale = at.state.shape_scale("mesh", own)
        yield from (p.surface.moved(frame @ np.diag([*scale, 1.0])) for p in self._meshes[file])

    def _find(self, uri: str, folder: Path | None) -> Path | None:
        """Return the file or folder that a URI names, or None if it is missing and may be skipped."""
        scheme, _, rest = uri.rpartition("://")
        if scheme.startswith("http"):  # a Gazebo Fuel model, which may have been downloaded already
            rest = rest.rstrip("/").rpartition("/")[2]
        rest = rest.lstrip("/") if scheme == "model" else rest
        folders = [*([] if folder is None else [folder, folder.parent]), *self._folders]
        # A file URI contains the path on the author's machine, so its last parts are looked up as well.
        parts = rest.split("/")
        ends = range(max(1, len(parts) - 1)) if scheme == "file" else range(1)
        names = ["/".join(parts[first:]) for first in ends]
        found = next((b / name for name in names for b in folders if name and (b / name).exists()), None)
        if found is None:
            if not self.missing.skip:
                raise AssetError(
                    f"{self._path} names {uri!r}, which is not there; give the folder of its models by --models, "
                    "or leave out what is missing with --skip-missing"
                )
            self.missing.files.append(uri)
        return found


def _root(path: Path) -> ET.Element:
    try:
        # Remove the XML declaration, because Gazebo allows comments before it.
        root = ET.fromstring(re.sub(r"<\?xml[^>]*\?>", "", read_text(path), count=1))
    except (OSError, UnicodeDecodeError, ET.ParseError) as error:
        raise AssetError(f"cannot read {path} as SDF: {error}; is it complete?") from error
    if root.tag != "sdf":
        raise AssetError(f"{path} is XML with <{root.tag}>, not SDF; give a world file with <sdf>")
    return root


def _model_file(folder: Path) -> Path:
    config = folder / "model.config"
    if config.is_file():
        try:
            named = ET.fromstring(read_text(config)).findall("sdf")
        except (OSError, UnicodeDecodeError, ET.ParseError):
            named = []
        named.sort(key=lambda sdf: [int(n) for n in re.findall(r"\d+", sdf.get("version", ""))], reverse=True)
        for sdf in named:  # sorted from the newest version to the oldest
            if (file := folder / (sdf.text or "").strip()).is_file():
                return file
    if (folder / "model.sdf").is_file():
        return folder / "model.sdf"
    raise AssetError(f"the model {folder} has no model.sdf; correct its model.config")


def _primitive(shape: ET.Element, path: Path) -> trimesh.Trimesh | None:
    def number(name: str, count: int = 1) -> Floats:
        return numbers((shape.findtext(name) or "").split(), count, path)

    if shape.tag == "box":
        return trimesh.creation.box(number("size", 3))
    if shape.tag == "plane":
        size = np.full(2, _PLANE) if shape.find("size") is None else np.minimum(number("size", 2), _PLANE)
        return trimesh.creation.box([*size, _THIN]).apply_translation([0, 0, -_THIN / 2])
    if shape.tag == "sphere":
        return trimesh.creation.icosphere(2, float(number("radius")[0]))
    if shape.tag in ("cylinder", "capsule"):
        make = getattr(trimesh.creation, shape.tag)
        return make(radius=float(number("radius")[0]), height=float(number("length")[0]))
    if shape.tag == "ellipsoid":
        return trimesh.creation.icosphere(2, 1.0).apply_scale(number("radii", 3))
    return None


def _colour(element: ET.Element) -> Floats:
    for name in ("diffuse", "ambient"):
        words = (element.findtext(f"material/{name}") or "").split()
        if len(words) >= 3:
            return np.clip([float(word) for word in words[:3]], 0.0, 1.0)
    return np.array(PLAIN)
