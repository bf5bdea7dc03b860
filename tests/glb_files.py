"""An independent reader of GLB files, and a small ray caster that shows what is in them, without any light."""

import json
import struct
from dataclasses import dataclass

import cv2
import numpy as np

TYPES = {5120: "i1", 5121: "u1", 5123: "u2", 5125: "u4", 5126: "f4"}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class Part:
    """A primitive as a file places it, all vertices in the frame below the root."""

    node: str
    positions: np.ndarray
    normals: np.ndarray
    triangles: np.ndarray
    colours: np.ndarray  # as displayed, 0 to 1
    shine: np.ndarray
    uv: np.ndarray | None
    image: np.ndarray | None  # RGB(A), 0 to 1
    blended: bool
    extras: dict

    @property
    def area(self):
        a, b, c = np.moveaxis(self.positions[self.triangles], 1, 0)
        return np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2


class File:
    def __init__(self, content):
        magic, version, length = struct.unpack_from("<III", content)
        assert (magic, version, length) == (0x46546C67, 2, len(content))
        size, _ = struct.unpack_from("<II", content, 12)
        self.gltf = json.loads(content[20 : 20 + size])
        self.blob = content[28 + size :]

    @property
    def root(self):
        return self.gltf["nodes"][self.gltf["scenes"][0]["nodes"][0]]

    def view(self, number):
        view = self.gltf["bufferViews"][number]
        return self.blob[view["byteOffset"] : view["byteOffset"] + view["byteLength"]], view

    def values(self, number):
        accessor = self.gltf["accessors"][number]
        kind, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        raw, view = self.view(accessor["bufferView"])
        stride = view.get("byteStride", width * kind.itemsize) // kind.itemsize
        found = np.frombuffer(raw, kind).reshape(-1, stride)[: accessor["count"], :width]
        return found / np.iinfo(kind).max if accessor.get("normalized") else found

    def image(self, material):
        texture = material["pbrMetallicRoughness"].get("baseColorTexture")
        if texture is None:
            return None
        source = self.gltf["textures"][texture["index"]]["extensions"]["EXT_texture_webp"]["source"]
        raw, _ = self.view(self.gltf["images"][source]["bufferView"])
        image = cv2.imdecode(np.frombuffer(raw, np.uint8), cv2.IMREAD_UNCHANGED)
        order = cv2.COLOR_BGRA2RGBA if image.shape[2] == 4 else cv2.COLOR_BGR2RGB
        return cv2.cvtColor(image, order) / 255.0

    def parts(self):
        """All primitives below the root, in the frame of its children."""
        found = []
        for child in self.root["children"]:
            self._collect(child, np.eye(4), found)
        return found

    def _collect(self, number, outer, found):
        node = self.gltf["nodes"][number]
        place = outer @ matrix_of(node)
        for primitive in self.gltf["meshes"][node["mesh"]]["primitives"] if "mesh" in node else []:
            found.append(self._part(node, primitive, place))
        for child in node.get("children", []):
            self._collect(child, place, found)

    def _part(self, node, primitive, place):
        values = {name: self.values(number) for name, number in primitive["attributes"].items()}
        material = self.gltf["materials"][primitive["material"]]
        normals = values["NORMAL"] @ place[:3, :3].T
        rgb = values["COLOR_0"][:, :3]
        shown = np.where(rgb <= 0.0031308, 12.92 * rgb, 1.055 * rgb ** (1 / 2.4) - 0.055)
        return Part(
            node=node["name"],
            positions=values["POSITION"] @ place[:3, :3].T + place[:3, 3],
            normals=normals / np.linalg.norm(normals, axis=1, keepdims=True),
            triangles=self.values(primitive["indices"]).reshape(-1, 3).astype(int),
            colours=np.column_stack((shown, values["COLOR_0"][:, 3])),
            shine=values["_SHINE"],
            uv=values.get("TEXCOORD_0"),
            image=self.image(material),
            blended=material.get("alphaMode") == "BLEND",
            extras={**node.get("extras", {}), **material.get("extras", {})},
        )


def matrix_of(node):
    x, y, z, w = node.get("rotation", (0, 0, 0, 1))
    turn = np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = turn * node.get("scale", (1, 1, 1))
    matrix[:3, 3] = node.get("translation", (0, 0, 0))
    return matrix


def cast(parts, origins, direction):
    """Colours (r, 3) of what rays hit first, from `origins` (r, 3), all in one direction; NaN where they hit nothing.

    Back faces are not seen; what is translucent is taken as opaque.
    """
    across = np.linalg.svd(direction[None])[2][1:]  # two axes of the plane that the rays cross
    order = np.argsort(origins @ across[0])  # so that those near a triangle lie beside each other
    rays, start = origins[order] @ across.T, origins[order] @ direction
    nearest, colours = np.full(len(origins), np.inf), np.full((len(origins), 3), np.nan)
    for part in parts:
        a, b, c = np.moveaxis(part.positions[part.triangles], 1, 0)
        triangles = part.triangles[np.cross(b - a, c - a) @ direction < 0]
        flat, along = part.positions[triangles] @ across.T, part.positions[triangles] @ direction
        first = np.searchsorted(rays[:, 0], flat[..., 0].min(axis=1) - 1e-9)
        last = np.searchsorted(rays[:, 0], flat[..., 0].max(axis=1) + 1e-9)
        inverse = np.linalg.inv(flat[:, 1:] - flat[:, :1])
        hit, shares = np.full(len(rays), -1), np.empty((len(rays), 3))
        for number, near in enumerate(map(slice, first, last)):
            second, third = ((rays[near] - flat[number, 0]) @ inverse[number]).T
            here = np.stack((1 - second - third, second, third), axis=1)
            depth = here @ along[number] - start[near]
            seen = (here >= -1e-9).all(axis=1) & (depth < nearest[near])
            nearest[near][seen], hit[near][seen], shares[near][seen] = depth[seen], number, here[seen]
        corners, shares = triangles[hit[hit >= 0]], shares[hit >= 0, None]
        colour = (shares @ part.colours[corners][..., :3])[:, 0]
        if part.image is not None:
            colour = colour * sampled(part.image, (shares @ part.uv[corners])[:, 0])
        colours[hit >= 0] = colour
    return colours[np.argsort(order)]


def sampled(image, uv):
    """Colours (n, 3) at texture coordinates (n, 2), between the pixels, with the image repeated."""
    height, width = image.shape[:2]
    x, y = uv[:, 0] * width - 0.5, uv[:, 1] * height - 0.5
    i, j = np.floor(x).astype(int), np.floor(y).astype(int)
    fx, fy = (x - i)[:, None], (y - j)[:, None]

    def at(column, row):
        return image[row % height, column % width, :3]

    return (1 - fy) * ((1 - fx) * at(i, j) + fx * at(i + 1, j)) + fy * (
        (1 - fx) * at(i, j + 1) + fx * at(i + 1, j + 1)
    )
