"""Write GLB files with merged meshes, quantized vertices, materials and WebP textures."""

import functools
import json
import math
import struct
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.formats.gltf.shapes import Floats
from mjsim.formats.gltf.surfaces import GeomSurface
from mjsim.house.compiled.sites import RoomMap

UPRIGHT = [-(0.5**0.5), 0.0, 0.0, 0.5**0.5]  # quaternion (x, y, z, w) that rotates the z axis to the y axis
# Possible quantization steps of vertex positions, from 1/128 mm to 128 mm.
_STEPS = [2.0**-k / 1000.0 for k in range(7, -8, -1)]
_UV_STEP = 2.0**-13
_COMPONENTS = {
    np.dtype(kind): code
    for kind, code in (("i1", 5120), ("u1", 5121), ("u2", 5123), ("u4", 5125), ("f4", 5126))
}
_VERTICES, _TRIANGLES = 34962, 34963  # values of bufferView.target in glTF
_EXTENSIONS = {"mesh": "KHR_mesh_quantization", "texture": "EXT_texture_webp"}
_MANY_TRIANGLES = 50_000  # number of triangles above which a material is divided by room
_SQUARE = 16.0  # side length of the smallest floor squares into which surfaces are grouped, in metres
_QUALITY, _LOSSLESS = 90, 101  # quality settings for OpenCV's WebP encoder


class MaterialKey(NamedTuple):
    """Material properties that surfaces must share to be merged into one draw call."""

    texture: int  # texture id, or -1 without a texture
    is_translucent: bool
    is_decal: bool  # True for a translucent plane, which is drawn before other translucent geoms

    @classmethod
    def of(cls, surface: GeomSurface) -> "MaterialKey":
        return cls(surface.texture, surface.is_translucent, surface.is_decal)


class Glb:
    """A builder for a GLB file.

    `image` is a function that returns the name and the WebP file of a texture. Its arguments are the texture
    id and a flag that is True if the alpha channel is used.
    """

    def __init__(self, image: Callable[[int, bool], tuple[str, bytes]]) -> None:
        self._image = image
        self._blob = bytearray()
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._images: dict[tuple[int, bool], dict[str, Any]] = {}
        self._materials: dict[MaterialKey, dict[str, Any]] = {}
        self._meshes: list[dict[str, Any]] = []
        self._nodes: list[dict[str, Any]] = []
        self.triangles = 0
        self.primitives = 0

    def node(self, name: str, children: Sequence[int] = (), **properties: Any) -> int:
        """Add a node without a mesh, and return its index. `properties` are additional glTF properties."""
        node = {"name": name, **properties}
        if children:
            node["children"] = list(children)
        return _append(self._nodes, node)

    def mesh(
        self,
        name: str,
        surfaces: Iterable[GeomSurface],
        marks: Mapping[str, Any] | None = None,
        **properties: Any,
    ) -> int:
        """Add a node with a mesh of surfaces that are merged by material. Return the index of the node.

        `marks` are the extras of the mesh, and `properties` are additional glTF properties of the node.
        """
        groups: dict[MaterialKey, list[GeomSurface]] = {}
        for surface in surfaces:
            groups.setdefault(MaterialKey.of(surface), []).append(surface)
        every = np.concatenate([s.positions for group in groups.values() for s in group])
        low, extent = every.min(axis=0), float(np.ptp(every, axis=0).max())
        step = next((step for step in _STEPS if extent / step < 65535.0), extent / 65535.0)
        primitives = [self._primitive(key, groups[key], low, step) for key in sorted(groups)]
        mesh = {"name": name, "primitives": primitives, **({"extras": dict(marks)} if marks else {})}
        number = _append(self._meshes, mesh)
        return self.node(name, mesh=number, translation=low.tolist(), scale=[step] * 3, **properties)

    def _primitive(
        self, key: MaterialKey, group: Sequence[GeomSurface], origin: Floats, step: float
    ) -> dict[str, Any]:
        counts = [len(surface.positions) for surface in group]
        starts = np.cumsum([0, *counts])
        triangles = np.concatenate(
            [s.triangles + start for s, start in zip(group, starts, strict=False)]
        ).ravel()
        positions = np.rint((np.concatenate([s.positions for s in group]) - origin) / step).astype("u2")
        normals = np.concatenate([s.normals for s in group])
        colours = np.repeat([linear(s.rgba) for s in group], counts, axis=0)
        shine = np.repeat([s.shine for s in group], counts, axis=0)
        bounds = {"min": positions.min(axis=0).tolist(), "max": positions.max(axis=0).tolist()}
        attributes = {
            "POSITION": self._attribute(positions, "VEC3", **bounds),
            "NORMAL": self._attribute(np.rint(normals * 127.0).astype("i1"), "VEC3", normalized=True),
            "COLOR_0": self._attribute(np.rint(colours * 65535.0).astype("u2"), "VEC4", normalized=True),
            "_SHINE": self._attribute(np.rint(shine * 255.0).astype("u1"), "VEC3", normalized=True),
        }
        if key.texture >= 0:
            uv = np.concatenate([s.uv for s in group if s.uv is not None])
            attributes["TEXCOORD_0"] = self._attribute(
                (np.rint(uv / _UV_STEP) * _UV_STEP).astype("f4"), "VEC2"
            )
        self.triangles += len(triangles) // 3
        self.primitives += 1
        corners = triangles.astype("u2" if starts[-1] < 65535 else "u4")
        indices = self._accessor(corners, self._view(corners.tobytes(), target=_TRIANGLES), "SCALAR")
        return {"attributes": attributes, "indices": indices, "material": self._material(key)}

    def _material(self, key: MaterialKey) -> int:
        if key not in self._materials:
            pbr: dict[str, Any] = {"metallicFactor": 0.0, "roughnessFactor": 1.0}
            material: dict[str, Any] = {"name": "plain", "pbrMetallicRoughness": pbr}
            if key.texture >= 0:
                pbr["baseColorTexture"] = {"index": self._texture(key.texture, key.is_translucent)}
                material["name"] = self._image(key.texture, key.is_translucent)[0]
            if key.is_translucent:
                material |= {"alphaMode": "BLEND", "extras": {"decal": key.is_decal}}
            self._materials[key] = material
        return list(self._materials).index(key)

    def _texture(self, texture: int, alpha: bool) -> int:
        key = (texture, alpha)
        if key not in self._images:
            name, encoded = self._image(*key)
            self._images[key] = {"name": name, "mimeType": "image/webp", "bufferView": self._view(encoded)}
        return list(self._images).index(key)

    def _attribute(self, values: NDArray[Any], kind: str, **properties: Any) -> int:
        """Add an accessor for vertex values (n, k), which are aligned to 4 bytes. Return its index."""
        width = values.shape[1] * values.itemsize
        stride = -(-width // 4) * 4
        padded = np.zeros((len(values), stride // values.itemsize), values.dtype)
        padded[:, : values.shape[1]] = values
        view = self._view(padded.tobytes(), target=_VERTICES, byteStride=stride)
        return self._accessor(values, view, kind, **properties)

    def _accessor(self, values: NDArray[Any], view: int, kind: str, **properties: Any) -> int:
        about = {"bufferView": view, "componentType": _COMPONENTS[values.dtype], "count": len(values)}
        return _append(self._accessors, {**about, "type": kind, **properties})

    def _view(self, content: bytes, **properties: int) -> int:
        self._blob += b"\0" * (-len(self._blob) % 4)
        start = len(self._blob)
        self._blob += content
        view = {"buffer": 0, "byteOffset": start, "byteLength": len(content), **properties}
        return _append(self._views, view)

    def content(self, root: int) -> bytes:
        """Return the content of the GLB file, whose scene has a single root node."""
        sampler = {"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}
        lists: Mapping[str, Any] = {
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": list(self._materials.values()),
            "textures": [
                {"sampler": 0, "extensions": {_EXTENSIONS["texture"]: {"source": number}}}
                for number in range(len(self._images))
            ],
            "images": list(self._images.values()),
            "samplers": [sampler] if self._images else [],
            "bufferViews": self._views,
            "accessors": self._accessors,
        }
        used = [_EXTENSIONS["mesh"]] * bool(self._meshes) + [_EXTENSIONS["texture"]] * bool(self._images)
        gltf = {
            "asset": {"version": "2.0", "generator": "mjsim"},
            "scene": 0,
            "scenes": [{"nodes": [root]}],
            **{name: values for name, values in lists.items() if values},
        }
        if self._blob:
            gltf["buffers"] = [{"byteLength": len(self._blob)}]
        if used:
            gltf |= {"extensionsUsed": used, "extensionsRequired": used}
        text = json.dumps(gltf, separators=(",", ":"), allow_nan=False).encode()
        text += b" " * (-len(text) % 4)
        blob = bytes(self._blob) + b"\0" * (-len(self._blob) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        if blob:
            chunks += struct.pack("<II", len(blob), 0x004E4942) + blob
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def _append(elements: list[dict[str, Any]], element: dict[str, Any]) -> int:
    elements.append(element)
    return len(elements) - 1


def linear(rgba: Floats) -> Floats:
    """Convert an sRGB colour (4,) to the linear colour that glTF requires for vertices."""
    rgb = rgba[:3]
    return np.append(np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4), rgba[3])


def divided(surfaces: Sequence[GeomSurface], rooms: RoomMap) -> Iterator[tuple[GeomSurface, str]]:
    """Divide static surfaces into parts, so that they can be culled, quantized and drawn efficiently.

    Yield each surface with the name of its part. If its material has many triangles, the part is the room.
    Otherwise, the part is a square of the floor that is about as wide as the surface, because positions in
    larger parts are quantized more coarsely.
    """
    x_min, y_min, x_max, y_max = rooms.bounds
    centre = np.array([x_min + x_max, y_min + y_max]) / 2
    triangles = Counter[tuple[MaterialKey, bool]]()
    for surface in surfaces:
        triangles[MaterialKey.of(surface), surface.is_ceiling] += len(surface.triangles)
    for surface in surfaces:
        low, high = surface.positions.min(axis=0), surface.positions.max(axis=0)
        middle, level = (low + high) / 2, max(0, math.ceil(math.log2((high - low).max() / _SQUARE)))
        if triangles[MaterialKey.of(surface), surface.is_ceiling] > _MANY_TRIANGLES and not level:
            yield surface, rooms.room_at(middle)
        else:
            i, j = np.rint((middle[:2] - centre) / (_SQUARE * 2**level)).astype(int)
            yield surface, f"square_{level}_{i}_{j}"


def pixels(model: Any, texture: int) -> NDArray[np.uint8]:
    """Return the image of a texture as a uint8 array of shape (height, width, channels).

    The image of a cube or sky texture contains six stacked faces, or one face that is shown on all sides.
    """
    sizes = model.tex_height, model.tex_width, model.tex_nchannel
    shape = tuple(int(size[texture]) for size in sizes)
    first = int(model.tex_adr[texture])
    image: NDArray[np.uint8] = model.tex_data[first : first + int(np.prod(shape))].reshape(shape)
    return image


def texture_encoder(model: Any) -> Callable[[int, bool], tuple[str, bytes]]:
    """Return a cached function that encodes the textures of a model for `Glb`."""

    @functools.cache
    def encode(texture: int, alpha: bool) -> tuple[str, bytes]:
        name = mujoco.mj_id2name(model, mujoco.mjtObj.mjOBJ_TEXTURE, texture)
        return str(name or f"texture {texture}"), webp(pixels(model, texture), alpha=alpha)

    return encode


def webp(image: NDArray[np.uint8], *, alpha: bool = False, lossless: bool = False) -> bytes:
    """Encode an RGB or RGBA image as WebP. The alpha channel is dropped unless `alpha` is True."""
    keep = alpha and image.shape[2] == 4
    conversion = cv2.COLOR_RGBA2BGRA if keep else cv2.COLOR_RGB2BGR
    bgr = cv2.cvtColor(np.ascontiguousarray(image if keep else image[..., :3]), conversion)
    quality = _LOSSLESS if lossless else _QUALITY
    _, encoded = cv2.imencode(".webp", bgr, [cv2.IMWRITE_WEBP_QUALITY, quality])
    return encoded.tobytes()
