"""Export a house as a Habitat scene dataset with objects, rooms and rearrangement episodes.

In Habitat, y is up and the camera looks along -z, so a vector (x, y, z) in mjsim becomes (x, z, -y) in
Habitat. The stage contains everything that cannot move. Receptacles and objects are templates with the same
origins as in mjsim, so that they also have the same poses.
"""

import gzip
import json
import math
import re
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import shapely
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial

from mjsim.formats.gltf.glb import linear
from mjsim.formats.gltf.reader import RECEPTACLE, SEMANTICS
from mjsim.formats.mjcf_reader import read_mjcf
from mjsim.formats.scene.mesh_files import Y_TO_Z
from mjsim.formats.scene.source_scene import HouseOptions, ScenePiece
from mjsim.formats.scene.surface import Floats
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.model_files import read_model
from mjsim.house.compiled.house import CompiledHouse, compiled_house
from mjsim.values.episode import Episode
from mjsim.values.person_parameters import PersonParameters

_UPRIGHT = np.linalg.inv(Y_TO_Z)
_CEILING = 2.6  # height of the exported room regions, in metres
_OBJECT, _SCENE = ".object_config.json", ".scene_instance.json"
_AIR = 0.05  # clearance between a person's body and walls, in metres
_DATASET = {
    "stages": {"paths": {".json": ["stages"]}},
    "objects": {"paths": {".json": ["objects"]}},
    "scene_instances": {"paths": {".json": ["scenes"]}},
    "semantic_scene_descriptor_instances": {"paths": {".json": ["semantics/*"]}},
}
_NAVMESH = {
    "cellSize": 0.05,
    "cellHeight": 0.05,
    "agentHeight": 1.8,
    "agentRadius": round(PersonParameters().body_radius + _AIR, 3),
    "agentMaxClimb": 0.05,
    "agentMaxSlope": 45.0,
}


def export_habitat(catalogue: Catalogue, episodes: Sequence[Episode], folder: Path) -> str:
    """Write a house and its episodes into an existing folder. Return the name of the Habitat scene."""
    house = compiled_house(catalogue)
    name = _slug(catalogue.name if catalogue.ref.kind == "generated" else catalogue.label)
    axes = {"up": [0, 1, 0], "front": [0, 0, -1]}
    _save_model(folder / "stages", name, catalogue.house_path, "stage_config", axes)
    volumes = {key: _volume(house, key) for key in catalogue.receptacles}
    for key, receptacle in catalogue.receptacles.items():
        own = {"key": key, "room": receptacle.room, "place": receptacle.place}
        marks = {RECEPTACLE: own, f"receptacle_aabb_{key}": volumes[key]}
        template = _template(receptacle.path, marks)
        _save_model(folder / "objects", _slug(key), receptacle.path, "object_config", template)
    for key, item in catalogue.objects.items():
        _save_model(folder / "objects", _slug(key), item.path, "object_config", _template(item.path, {}))
    _save_json(folder / "scenes" / f"{name}{_SCENE}", _scene(house, catalogue, name))
    _save_json(folder / "semantics" / f"{name}{SEMANTICS}", _regions(house))
    _save_json(folder / f"{name}.scene_dataset_config.json", _DATASET)
    _save_json(folder / "navmesh_settings.json", _NAVMESH)
    found = [_episode(house, episode, name, number) for number, episode in enumerate(episodes)]
    content = json.dumps({"episodes": found}, separators=(",", ":")).encode()
    (folder / "episodes.json.gz").write_bytes(gzip.compress(content, mtime=0))
    return name


def _slug(text: str) -> str:
    return re.sub(r"[^A-Za-z0-9]+", "_", text).strip("_").lower() or "house"


def _save_json(path: Path, content: Mapping[str, Any]) -> None:
    path.parent.mkdir(exist_ok=True)
    path.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")


def _save_model(folder: Path, name: str, source: Path, kind: str, about: Mapping[str, Any]) -> None:
    pieces = read_mjcf(source, HouseOptions()).pieces
    assets = {"render_asset": f"{name}.glb", "collision_asset": f"{name}_collision.glb"}
    folder.mkdir(exist_ok=True)
    (folder / assets["render_asset"]).write_bytes(_seen(pieces))
    (folder / assets["collision_asset"]).write_bytes(_solid(pieces))
    template = {**assets, "is_collidable": True, "units_to_meters": 1.0, **about}
    _save_json(folder / f"{name}.{kind}.json", template)


def _seen(pieces: Iterable[ScenePiece]) -> bytes:
    materials: dict[tuple[int, tuple[float, ...]], PBRMaterial] = {}
    groups: dict[tuple[str, int, tuple[float, ...]], list[ScenePiece]] = {}
    for piece in pieces:
        if piece.seen:
            image = id(piece.surface.images[0]) if piece.surface.images else 0
            colour = tuple(piece.surface.colours.mean(axis=(0, 1)).round(3).tolist())
            groups.setdefault((piece.name, image, colour), []).append(piece)
            if (image, colour) not in materials:
                materials[image, colour] = _material(piece.surface.images, colour)
    scene = trimesh.Scene()
    for number, ((name, image, colour), found) in enumerate(groups.items()):
        corners = np.concatenate([piece.surface.corners for piece in found]).reshape(-1, 3)
        uv = np.concatenate([piece.surface.uv for piece in found]).reshape(-1, 2)
        faces = np.arange(len(corners)).reshape(-1, 3)
        visual = TextureVisuals(uv=uv, material=materials[image, colour])
        mesh, unique = trimesh.Trimesh(corners, faces, visual=visual, process=False), f"{name} {number}"
        scene.add_geometry(mesh, node_name=unique, geom_name=unique, transform=_UPRIGHT)
    return bytes(scene.export(file_type="glb"))


def _material(images: Sequence[Floats], colour: Sequence[float]) -> PBRMaterial:
    picture = Image.fromarray(np.round(255 * images[0]).astype(np.uint8)) if images else None
    factor = np.round(255 * linear(np.append(colour, 1.0))).astype(np.uint8)
    return PBRMaterial(
        baseColorFactor=factor, baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=1.0
    )


def _solid(pieces: Iterable[ScenePiece]) -> bytes:
    scene = trimesh.Scene()
    for number, piece in enumerate(piece for piece in pieces if piece.solid):
        name = f"{piece.name} {number}"
        scene.add_geometry(piece.surface.mesh(), node_name=name, geom_name=name, transform=_UPRIGHT)
    return bytes(scene.export(file_type="glb"))


def _template(path: Path, marks: Mapping[str, Any]) -> dict[str, Any]:
    mass = float(read_model(path).compile().body_mass.sum())
    return {
        "mass": round(mass, 4),
        "COM": [0.0, 0.0, 0.0],
        "compute_COM_from_shape": False,
        "join_collision_meshes": False,
        "user_defined": dict(marks),
    }


def _pose(position: Floats, rotation: Floats) -> Floats:
    own = np.eye(4)
    own[:3, :3], own[:3, 3] = rotation, position
    return np.asarray(_UPRIGHT @ own @ Y_TO_Z)


def _turned(quaternion: Sequence[float]) -> Floats:
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, np.array(quaternion, np.float64))
    return matrix.reshape(3, 3)


def _mount(house: CompiledHouse, key: str) -> tuple[Floats, Floats]:
    site = house.model.site(f"mount:{key}").id
    return house.data.site_xpos[site].copy(), house.data.site_xmat[site].reshape(3, 3).copy()


def _volume(house: CompiledHouse, key: str) -> dict[str, Any]:
    """Describe the volume of a receptacle by its centre and half sizes in its own frame, in metres."""
    geometry = house.receptacles[key]
    position, rotation = _mount(house, key)
    middle = _UPRIGHT[:3, :3] @ rotation.T @ (geometry.center - position)
    half = np.abs(_UPRIGHT[:3, :3] @ rotation.T @ geometry.rotation) @ geometry.half_size
    return {
        "name": f"receptacle_aabb_{key}",
        "position": _short(middle),
        "scale": _short(half),
        "up": [0, 1, 0],
    }


def _scene(house: CompiledHouse, catalogue: Catalogue, name: str) -> dict[str, Any]:
    items = []
    for key in catalogue.receptacles:
        pose = _pose(*_mount(house, key))
        turn = np.zeros(4)
        mujoco.mju_mat2Quat(turn, np.ascontiguousarray(pose[:3, :3]).ravel())
        place = {"translation": _short(pose[:3, 3]), "rotation": _short(turn)}
        fixed = {"motion_type": "STATIC", "translation_origin": "asset_local"}
        items.append({"template_name": _slug(key), **place, **fixed})
    return {
        "stage_instance": {"template_name": name},
        "object_instances": items,
        "semantic_scene_instance": name,
        "default_lighting": "",
    }


def _regions(house: CompiledHouse) -> dict[str, Any]:
    rooms = house.rooms
    parts: dict[str, list[Any]] = {}
    for key, corners in zip(rooms.keys, rooms.corners, strict=True):
        parts.setdefault(key, []).append(shapely.Polygon(corners).buffer(0.001, join_style="mitre"))
    found = []
    for key, polygons in parts.items():
        whole = shapely.unary_union(polygons)
        outlines = [whole] if whole.geom_type == "Polygon" else list(whole.geoms)
        for number, outline in enumerate(outlines):
            x, y = np.array(outline.exterior.coords)[:-1].T.round(4) + 0.0
            low, high = (float(x.min()), 0.0, float(-y.max())), (float(x.max()), _CEILING, float(-y.min()))
            found.append(
                {
                    "name": key if number == 0 else f"{key}:{number}",
                    "label": rooms.label(key),
                    "poly_loop": [[a, 0.0, -b] for a, b in zip(x.tolist(), y.tolist(), strict=True)],
                    "floor_height": 0.0,
                    "extrusion_height": _CEILING,
                    "min_bounds": low,
                    "max_bounds": high,
                }
            )
    return {"region_annotations": found}


def _episode(house: CompiledHouse, episode: Episode, scene: str, number: int) -> dict[str, Any]:
    counts: dict[str, int] = {}
    objects, targets, goals = [], {}, []
    for placed in episode.objects:
        model, receptacle = _slug(placed.model), episode.targets[placed.name]
        handle = f"{model}_:{counts.get(model, 0):04d}"
        counts[model] = counts.get(model, 0) + 1
        pose = _pose(np.array(placed.position), _turned(placed.quaternion))
        objects.append([model + _OBJECT, pose.tolist()])
        geometry = house.receptacles[receptacle]
        targets[handle] = _pose(geometry.center, geometry.rotation).tolist()
        goals.append([f"{_slug(receptacle)}_:0000", None])
    turn = (episode.start.heading - math.pi / 2) / 2  # Habitat's camera looks along -z, which is y in mjsim
    return {
        "episode_id": str(number),
        "scene_id": scene + _SCENE,
        "scene_dataset_config": f"{scene}.scene_dataset_config.json",
        "additional_obj_config_paths": ["objects"],
        "start_position": [episode.start.x, 0.0, -episode.start.y],
        "start_rotation": [0.0, math.sin(turn), 0.0, math.cos(turn)],
        "ao_states": {},
        "rigid_objs": objects,
        "targets": targets,
        "target_receptacles": [],
        "goal_receptacles": goals,
        "name_to_receptacle": {},
        "markers": [],
        "info": {
            "object_labels": {handle: f"any_targets|{k}" for k, handle in enumerate(targets)},
            "seed": episode.seed,
        },
    }


def _short(values: Floats) -> list[float]:
    return [float(value) for value in np.round(values, 6) + 0.0]
