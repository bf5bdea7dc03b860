"""Export a house for other renderers, as GLB files with a JSON index."""

import json
import math
import re
import zlib
from collections.abc import Iterable, Mapping
from functools import cached_property
from typing import Any

import msgspec
import mujoco
import numpy as np

from mjsim.formats.gltf.cube_maps import FACES
from mjsim.formats.gltf.glb import UPRIGHT, Glb, divided, pixels, texture_encoder, webp
from mjsim.formats.gltf.house_marks import MARKS, HouseMarks, MarkedBin, MarkedRoom
from mjsim.formats.gltf.shapes import Floats
from mjsim.formats.gltf.store import SCENE
from mjsim.formats.gltf.surfaces import GeomSurface, drawn_scene, lights_of, rounded, surfaces
from mjsim.formats.gltf.welding import welded
from mjsim.formats.scene.mesh_files import LOOSE
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import CELL, MARGIN, Floor
from mjsim.house.compiled.house import compiled_house
from mjsim.house.compiled.sites import RoomMap
from mjsim.house.scene import arms, avatar
from mjsim.house.scene.scene import Scene, assemble
from mjsim.render import shadows
from mjsim.values.episode import Episode, PlacedObject, StartPose
from mjsim.values.errors import AssetError

HOUSE, PERSON, SKY, SHADOW = "house.glb", "person.glb", "sky.webp", "shadow.webp"
_AWAY = -100.0  # height at which object models are placed for the export, in metres, far below the house
_HANDS = tuple(f"{avatar.PREFIX}{hand}_hand" for hand in avatar.HANDS)


def export_scene(catalogue: Catalogue) -> dict[str, bytes]:
    """Return all files of an exported house by name. The file `scene.json` describes the others.

    Raises:
        AssetError: The house breaks a convention of docs/models.md, or a geom cannot be exported.
    """
    return _Export(_one_of_each(catalogue)).files()


def export_episode(scene: Scene) -> bytes:
    """Return a GLB file that shows the house, the receptacles and the objects at the start of an episode.

    Raises:
        AssetError: The scene contains a geom that cannot be exported.
    """
    return _Export(scene).episode()


def floor_json(catalogue: Catalogue, body_radius: float) -> bytes:
    """Return JSON data about the floor on which a person with this trunk radius, in metres, can walk.

    Arrays are flattened in row-major order.
    """
    floor = Floor.of(compiled_house(catalogue).model, body_radius)
    plain = {
        name: np.ravel(value).tolist() if isinstance(value, np.ndarray) else value
        for name, value in floor._asdict().items()
    }
    return _json({**plain, "cell": CELL, "margin": MARGIN})


def _one_of_each(catalogue: Catalogue) -> Scene:
    placed = tuple(
        PlacedObject(f"object_{i}", model.category, key, (0.0, 0.0), (0.0, 0.0, _AWAY), (1.0, 0.0, 0.0, 0.0))
        for i, (key, model) in enumerate(catalogue.objects.items())
    )
    episode = Episode(
        catalogue.name,
        0,
        StartPose(0.0, 0.0, 0.0),
        placed,
        tuple(catalogue.receptacles),
        {one.name: catalogue.categories[one.category].receptacle for one in placed},
    )
    return assemble(episode, catalogue)


class _Export:
    def __init__(self, scene: Scene) -> None:
        self._scene, self._model = scene, scene.model
        self._data = mujoco.MjData(scene.model)
        mujoco.mj_forward(scene.model, self._data)
        self._drawn = drawn_scene(scene.model, self._data)
        self._images = texture_encoder(scene.model)
        self._refuse_moving_lights()

    @cached_property
    def _by_body(self) -> dict[int, list[GeomSurface]]:
        found: dict[int, list[GeomSurface]] = {}
        carried = self._model.body_weldid[self._model.geom_bodyid]
        for surface in surfaces(self._model, self._data, self._drawn):
            found.setdefault(int(carried[surface.geom]), []).append(surface)
        return found

    def _refuse_moving_lights(self) -> None:
        for light, body in enumerate(self._model.light_bodyid):
            if self._model.body_weldid[body] != 0:
                name = self._model.light(light).name
                raise AssetError(f"light {name!r} is part of an object; remove it, or move it into the house")

    def files(self) -> dict[str, bytes]:
        files: dict[str, bytes] = {}
        sizes: dict[str, dict[str, int]] = {}

        def add(name: str, glb: Glb, root: int) -> None:
            files[name] = glb.content(root)
            counts = {"triangles": glb.triangles, "draw_calls": glb.primitives}
            sizes[name] = {**counts, "bytes": len(files[name])}

        house = Glb(self._images)
        add(HOUSE, house, self._root(house, self._rooms(house)))
        add(PERSON, *self._person())
        objects = {}
        for placed in self._scene.episode.objects:
            name = f"objects/{_file_name(placed.model)}.glb"
            add(name, *self._object(placed))
            objects[placed.model] = {"file": name, **self._about(placed)}
        sky, shadow = self._sky(), self._shadow()
        if sky is not None:
            files[SKY] = sky
        if shadow is not None:
            files[SHADOW] = shadow[1]
        general, extent = self._model.vis.map, self._model.stat.extent
        files[SCENE] = _json(
            {
                "house": HOUSE,
                "person": PERSON,
                "objects": objects,
                "rooms": _rooms(self._scene.rooms),
                "contact_shadow": shadow and shadow[0],
                "sky": None if sky is None else SKY,
                "clip": [general.znear * extent, general.zfar * extent],
                "sizes": sizes,
            }
        )
        return files

    def episode(self) -> bytes:
        glb = Glb(self._images)
        nodes = self._rooms(glb)
        for placed in self._scene.episode.objects:
            position, _, quaternion = self._frame(self._scene.index.body(placed.name))
            inner = glb.mesh(placed.model, self._carried(placed), {LOOSE: True})
            pose = {"translation": position.tolist(), "rotation": np.roll(quaternion, -1).tolist()}
            nodes.append(glb.node(placed.name, [inner], **pose))
        return glb.content(self._root(glb, nodes))

    def _root(self, glb: Glb, nodes: list[int]) -> int:
        extras = {**lights_of(self._drawn), MARKS: self._marks()}
        return glb.node("house", nodes, rotation=UPRIGHT, extras=extras)

    def _marks(self) -> Any:
        rooms = zip(self._scene.rooms.keys, _rooms(self._scene.rooms), strict=True)
        bins = []
        for key, receptacle in self._scene.catalogue.receptacles.items():
            mount = self._data.site(f"mount:{key}")
            yaw = round(math.atan2(mount.xmat[3], mount.xmat[0]), 6)
            x, y, z = rounded(mount.xpos)
            bins.append(MarkedBin(key, receptacle.room, receptacle.place, (x, y, z), yaw))
        return msgspec.to_builtins(HouseMarks([MarkedRoom(key, **room) for key, room in rooms], bins))

    def _rooms(self, glb: Glb) -> list[int]:
        """Add nodes for the static geoms of each part of the house. Ceilings have nodes of their own."""
        groups: dict[tuple[bool, str], list[GeomSurface]] = {}
        static = welded(self._model, self._by_body.get(0, []))
        for surface, part in divided(static, self._scene.rooms):
            groups.setdefault((surface.is_ceiling, part), []).append(surface)
        return [
            glb.mesh(f"ceiling_{part}", group, extras={"ceiling": True})
            if ceiling
            else glb.mesh(f"static_{part}", group)
            for (ceiling, part), group in sorted(groups.items(), key=lambda item: item[0])
        ]

    def _object(self, placed: PlacedObject) -> tuple[Glb, int]:
        glb = Glb(self._images)
        mesh = glb.mesh(placed.model, self._carried(placed))
        return glb, glb.node(placed.model, [mesh], rotation=UPRIGHT)

    def _carried(self, placed: PlacedObject) -> Iterable[GeomSurface]:
        body = self._scene.index.body(placed.name)
        found = self._by_body.get(body, [])
        if not found:
            raise AssetError(f"object {placed.model!r} shows nothing; give it geoms in group 0 to 2")
        position, rotation, _ = self._frame(body)
        return (surface.within(position, rotation) for surface in found)

    def _person(self) -> tuple[Glb, int]:
        """Build the hands and sleeves, in the frame of the person's body. The body itself is not exported."""
        glb = Glb(self._images)
        base, turned, _ = self._frame(self._model.body(avatar.BODY).id)
        nodes = []
        for number, (hand, name) in enumerate(zip(avatar.HANDS, _HANDS, strict=True)):
            body = self._model.body(name).id
            position, rotation, _ = self._frame(body)
            sleeve = self._model.geom(f"{avatar.PREFIX}{hand}_{arms.SLEEVE}").id
            glove = [s.within(position, rotation) for s in self._by_body[body] if s.geom != sleeve]
            middle, along = self._data.geom_xpos[sleeve], self._data.geom_xmat[sleeve].reshape(3, 3)
            cloth = [s.within(middle, along) for s in self._by_body[body] if s.geom == sleeve]
            place, extras = ((position - base) @ turned).tolist(), {"arm": self._arm(number, sleeve)}
            mesh = glb.mesh(hand, glove)
            nodes.append(glb.node(f"{hand}_hand", [mesh], translation=place, extras=extras))
            nodes.append(glb.node(f"{hand}_sleeve", [glb.mesh(f"sleeve_{hand}", cloth)]))
        return glb, glb.node("person", [glb.node("body", nodes)], rotation=UPRIGHT)

    def _arm(self, hand: int, sleeve: int) -> dict[str, Any]:
        """Return the parameters that a client needs to compute the same poses of an arm as `arm_pose`."""
        eye_height = self._scene.person.eye_height
        rest = avatar.posture(hand, avatar.REST, eye_height)
        side = np.array([1.0, math.copysign(1.0, rest[1]), 1.0])
        return {
            "rest": rounded(rest),
            **{
                name: rounded(getattr(arms, name.upper()) * side) for name in ("hanging", "shoulder", "wrist")
            },
            "tilt": round(arms.HANGING_TILT, 6),
            "range": arms.IDLE_RANGE,
            "half": round(float(self._model.geom_size[sleeve, 1]), 6),
            "eye_height": eye_height,
        }

    def _frame(self, body: int) -> tuple[Floats, Floats, Floats]:
        data = self._data
        return data.xpos[body].copy(), data.xmat[body].reshape(3, 3).copy(), data.xquat[body].copy()

    def _about(self, placed: PlacedObject) -> dict[str, Any]:
        position, rotation, _ = self._frame(self._scene.index.body(placed.name))
        points = np.concatenate([s.positions for s in self._carried(placed)])
        boxes = []
        for surface in self._by_body[self._scene.index.body(placed.name)]:
            geom, box = surface.geom, self._model.geom_aabb[surface.geom]
            turned = rotation.T @ self._data.geom_xmat[geom].reshape(3, 3)
            centre = (self._data.geom_xpos[geom] - position) @ rotation + turned @ box[:3]
            quaternion = np.zeros(4)
            mujoco.mju_mat2Quat(quaternion, turned.ravel())
            boxes.append(rounded([*centre, *box[3:], *quaternion]))
        return {
            "label": self._scene.catalogue.objects[placed.model].label,
            "bounds": [rounded(points.min(axis=0)), rounded(points.max(axis=0))],
            "boxes": boxes,
        }

    def _sky(self) -> bytes | None:
        """Return an image of the sky as six stacked faces (right, left, up, down, front, back), or None."""
        found = np.flatnonzero(self._model.tex_type == mujoco.mjtTexture.mjTEXTURE_SKYBOX)
        if not len(found):
            return None
        image = pixels(self._model, found[0])
        faces = FACES * image.shape[1] // image.shape[0]  # 1 if the image already contains six faces
        return webp(np.tile(image, (faces, 1, 1)), lossless=True)

    def _shadow(self) -> tuple[dict[str, Any], bytes] | None:
        """Return the parameters and texture of contact shadows, or None if there is no shadow material."""
        material = mujoco.mj_name2id(self._model, mujoco.mjtObj.mjOBJ_MATERIAL, shadows.MATERIAL)
        textures = self._model.mat_texid[:, mujoco.mjtTextureRole.mjTEXROLE_RGB]
        texture = textures[material] if material >= 0 else -1
        if texture < 0:
            return None
        about = {
            "rgba": rounded(self._model.mat_rgba[material]),
            "border": shadows.BORDER,
            "lift": shadows.LIFT,
            "reach": shadows.REACH,
            "texture": SHADOW,
        }
        return about, webp(pixels(self._model, texture), alpha=True, lossless=True)


def _rooms(rooms: RoomMap) -> list[dict[str, Any]]:
    return [
        {"label": rooms.label(key), "polygon": [rounded(xy) for xy in corners]}
        for key, corners in zip(rooms.keys, rooms.corners, strict=True)
    ]


def _file_name(key: str) -> str:
    """Convert a catalogue key, which may contain any character, to a safe name for files and URLs."""
    if re.fullmatch(r"[A-Za-z0-9_-]{1,80}", key):
        return key
    return f"{re.sub(r'[^A-Za-z0-9_-]', '_', key)[:40]}-{zlib.crc32(key.encode()):08x}"


def _json(value: Mapping[str, Any]) -> bytes:
    return json.dumps(value, separators=(",", ":"), allow_nan=False).encode()
