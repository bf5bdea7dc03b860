"""Import scenes from MJCF files. Geoms keep their initial poses. Joints and actuators are ignored."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image

from mjsim.formats.scene.mesh_files import primitive
from mjsim.formats.scene.source_scene import (
    TEXTURE_SIDE,
    HouseOptions,
    MissingFiles,
    NamedRoom,
    ScenePiece,
    SourceScene,
    left_out,
)
from mjsim.formats.scene.surface import Floats, Surface
from mjsim.house.catalogue.model_files import check_replicates, elements, read_model
from mjsim.house.compiled.footprint import bounding_boxes
from mjsim.house.compiled.sites import PREFIX, RoomMap
from mjsim.values.errors import AssetError

SUFFIXES = (".xml", ".mjcf")
_SEEN = (0, 1, 2)  # geom groups that viewers show by default
_CLEAR = 0.9  # minimum opacity at which a colliding geom is drawn
# A texture whose alpha values (out of 255) are all lower is a painted shadow and is ignored.
_OPAQUE = 250
_COVER = 0.02  # distance by which a collision geom may protrude from a visual geom that hides it, in metres
_ENDLESS = 15.0  # maximum half size of imported planes, in metres
_GEOM = mujoco.mjtGeom


def read_mjcf(path: Path, options: HouseOptions) -> SourceScene:
    """Read an MJCF scene. Raise `AssetError` if it does not compile or refers to a missing mesh."""
    try:
        check_replicates(elements(path))
    except ValueError as error:
        raise AssetError(f"cannot read model {path}: {error}") from error
    spec = read_model(path)
    missing = MissingFiles(options.skip_missing)
    _without_missing_meshes(spec, path, missing)
    pictures, absent = _take_pictures(spec)
    try:
        model = spec.compile()
    except (ValueError, mujoco.FatalError) as error:
        reason = " ".join(str(error).split())
        raise AssetError(f"{path} does not compile: {reason}; correct it in MuJoCo first") from error
    pieces = tuple(_pieces(model, pictures))
    if not pieces:
        raise AssetError(f"{path} has no geom that can be read; give the scene of a house")
    notes = list(missing.notes())
    if absent:
        notes.append(left_out(f"{len(absent)} missing pictures", ", ".join(absent[:4])))
    return SourceScene(pieces, "MJCF scene", tuple(notes), _rooms(model))


def _rooms(model: Any) -> tuple[NamedRoom, ...]:
    """Return the rooms of an mjsim house, which are marked by box sites. Other scenes have no rooms."""
    if not any(model.site(site).name.startswith(PREFIX) for site in range(model.nsite)):
        return ()
    rooms = RoomMap.from_model(model)
    boxes: dict[str, list[tuple[float, float, float, float]]] = {}
    for key, centre, half, axes in zip(rooms.keys, *rooms.rectangles, strict=True):
        low, high = centre - np.abs(axes) @ half, centre + np.abs(axes) @ half
        boxes.setdefault(key, []).append((*low.tolist(), *high.tolist()))
    labels = {key: key.replace("_", " ").capitalize() for key in boxes}
    return tuple(NamedRoom(key, labels[key], tuple(found)) for key, found in boxes.items())


@dataclass(frozen=True, eq=False)
class _Picture:
    image: Floats  # RGB image from 0 to 1, shape (height, width, 3)
    repeat: Floats  # number of repetitions along each texture axis, shape (2,)
    uniform: bool  # True if `repeat` counts repetitions per metre


def _without_missing_meshes(spec: mujoco.MjSpec, path: Path, missing: MissingFiles) -> None:
    absent = {mesh.name: mesh.file for mesh in spec.meshes if mesh.file and not Path(mesh.file).is_file()}
    if not absent:
        return
    if not missing.skip:
        raise AssetError(
            f"{path} names {len(absent)} meshes that are not there, such as {next(iter(absent.values()))}; "
            "add them, or leave them out with --skip-missing"
        )
    missing.files += [Path(file).name for file in absent.values()]
    for geom in list(spec.geoms):
        if geom.meshname in absent:
            spec.delete(geom)
    for mesh in list(spec.meshes):
        if mesh.name in absent:
            spec.delete(mesh)


def _take_pictures(spec: mujoco.MjSpec) -> tuple[dict[str, _Picture], list[str]]:
    """Remove all textures from a model. Return the textures by material name, and a list of missing files."""
    files = {t.name: t.file for t in spec.textures if t.file}  # cube textures are shown on every side
    made = {t.name: t.rgb1 for t in spec.textures if not t.file}
    images: dict[str, Floats] = {}
    found, absent = {}, []
    for material in spec.materials:
        name = next((t for t in material.textures if t in files), None)
        material.rgba[:3] *= next((made[t] for t in material.textures if t in made), 1.0)
        for role in range(len(material.textures)):
            material.textures[role] = ""
        if name is None:
            continue
        if name not in images:
            try:
                with Image.open(files[name]) as picture:
                    if "A" in picture.getbands() and np.asarray(picture.getchannel("A")).max() < _OPAQUE:
                        material.rgba[3] = 0.0  # a painted shadow, which is not imported
                        continue
                    small = picture.convert("RGB")
                    small.thumbnail((TEXTURE_SIDE, TEXTURE_SIDE))
                    images[name] = np.asarray(small, np.float64) / 255
            except OSError:
                absent.append(Path(files[name]).name)
                continue
        found[material.name] = _Picture(images[name], np.array(material.texrepeat), bool(material.texuniform))
    for texture in list(spec.textures):
        spec.delete(texture)
    return found, absent


def _pieces(model: Any, pictures: dict[str, _Picture]) -> Iterator[ScenePiece]:
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    collides = (model.geom_contype | model.geom_conaffinity) != 0
    material_alpha = model.mat_rgba[model.geom_matid, 3] if model.nmat else 1.0
    alpha = np.where(model.geom_matid >= 0, material_alpha, model.geom_rgba[:, 3])
    shown = np.isin(model.geom_group, _SEEN) & (alpha > 0)
    bodies = model.geom_bodyid
    # Many bodies have both visual and collision geoms. In other bodies, the visual geoms are solid as well.
    has_solid = np.isin(bodies, np.unique(bodies[collides])) & (bodies > 0)
    decor = np.flatnonzero(shown & ~collides)
    for geom in range(model.ngeom):
        hidden = collides[geom] and (alpha[geom] < _CLEAR or _covered(model, data, geom, decor))
        seen = bool(shown[geom] and not hidden)
        solid = bool(collides[geom] or (shown[geom] and not has_solid[geom]))
        surface = _surface(model, geom, pictures) if seen or solid else None
        if surface is not None:
            frame = np.eye(4)
            frame[:3, :3], frame[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            loose = bool(model.body_weldid[bodies[geom]] != 0)
            yield ScenePiece(_name(model, geom), surface.moved(frame), seen, solid, loose)


def _covered(model: Any, data: Any, geom: int, looks: NDArray[np.intp]) -> bool:
    low, high = bounding_boxes(model, data, [geom])
    first, last = bounding_boxes(model, data, looks[model.geom_bodyid[looks] == model.geom_bodyid[geom]])
    return bool(((first <= low + _COVER) & (last >= high - _COVER)).all(axis=1).any())


def _name(model: Any, geom: int) -> str:
    root = int(model.body_rootid[model.geom_bodyid[geom]])
    mesh = int(model.geom_dataid[geom]) if model.geom_type[geom] == _GEOM.mjGEOM_MESH else -1
    body_name = model.body(root).name if root else ""
    mesh_name = model.mesh(mesh).name if mesh >= 0 else ""
    return body_name or model.geom(geom).name or mesh_name or f"geom {geom}"


def _surface(model: Any, geom: int, pictures: dict[str, _Picture]) -> Surface | None:
    """Return a geom's surface in its own frame, or None if the geom type is not supported."""
    material = int(model.geom_matid[geom])
    rgba = model.mat_rgba[material] if material >= 0 else model.geom_rgba[geom]
    picture = pictures.get(model.material(material).name) if material >= 0 else None
    colour = np.clip(rgba[:3].astype(np.float64), 0.0, 1.0)
    if model.geom_type[geom] == _GEOM.mjGEOM_MESH:
        return _mesh(model, int(model.geom_dataid[geom]), colour, picture)
    made = _shape(int(model.geom_type[geom]), model.geom_size[geom])
    if made is None:
        return None
    surface = primitive(made, colour)
    if picture is None:
        return surface
    sides = np.ones(3) if picture.uniform else np.maximum(made.extents, 1e-3)
    axis = np.abs(made.face_normals).argmax(axis=1)
    plane = np.array([[1, 2], [0, 2], [0, 1]])[axis]  # the two axes that are parallel to a face
    places = surface.corners / sides
    # Without repetition, the texture covers each side from edge to edge.
    uv = (np.take_along_axis(places, plane[:, None, :].repeat(3, axis=1), axis=2) + 0.5) * picture.repeat
    return _painted(surface, uv, picture)


def _mesh(model: Any, mesh: int, colour: Floats, picture: _Picture | None) -> Surface:
    first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
    start, faces = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
    vertices = model.mesh_vert[first : first + count].astype(np.float64)
    face = model.mesh_face[start : start + faces]
    surface = primitive(trimesh.Trimesh(vertices, face, process=False), colour)
    if picture is None or model.mesh_texcoordadr[mesh] < 0:
        return surface
    places = model.mesh_texcoord[model.mesh_texcoordadr[mesh] :]
    uv = places[model.mesh_facetexcoord[start : start + faces]].astype(np.float64) * picture.repeat
    uv[..., 1] = 1.0 - uv[..., 1]  # in MuJoCo, v points down
    return _painted(surface, uv, picture)


def _painted(surface: Surface, uv: Floats, picture: _Picture) -> Surface:
    return Surface(surface.corners, surface.colours, uv, np.zeros(len(surface), np.int64), (picture.image,))


def _shape(kind: int, size: Floats) -> trimesh.Trimesh | None:
    if kind == _GEOM.mjGEOM_PLANE:
        half = np.where(size[:2] > 0, np.minimum(size[:2], _ENDLESS), _ENDLESS)
        return trimesh.creation.box([*(2 * half), 0.002]).apply_translation([0, 0, -0.001])
    if kind == _GEOM.mjGEOM_BOX:
        return trimesh.creation.box(2 * size)
    if kind == _GEOM.mjGEOM_SPHERE:
        return trimesh.creation.icosphere(2, float(size[0]))
    if kind == _GEOM.mjGEOM_ELLIPSOID:
        return trimesh.creation.icosphere(2, 1.0).apply_scale(size)
    if kind == _GEOM.mjGEOM_CYLINDER:
        return trimesh.creation.cylinder(float(size[0]), 2 * float(size[1]), sections=24)
    if kind == _GEOM.mjGEOM_CAPSULE:
        return trimesh.creation.capsule(2 * float(size[1]), float(size[0]), count=[12, 12])
    return None
