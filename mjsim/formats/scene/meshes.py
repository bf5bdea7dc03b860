"""Mesh files as parts of a scene: every node in its place, in metres and z up where the file says so."""

import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import trimesh
from trimesh.transformations import rotation_matrix, scale_matrix

from mjsim.formats.scene.mesh_files import MAX_TRIANGLES, Beside, check_mesh_file, parsing, surface_of
from mjsim.formats.scene.source_scene import TEXTURE_SIDE
from mjsim.formats.scene.surface import Floats, Surface
from mjsim.support.files import check_input, read_bytes
from mjsim.values.errors import AssetError

SUFFIXES = (".glb", ".gltf", ".dae", ".obj", ".stl", ".ply")
GLTF = (".glb", ".gltf")
Y_TO_Z = rotation_matrix(np.pi / 2, [1, 0, 0])


class _Nearby(Beside):
    """Files that a mesh names in its own folder or beside that, such as `../materials/textures/wood.png`."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._file = file

    def absolute(self, name: str) -> Path:
        """The path of a file by its name; an OSError where reading it would not end."""
        folder = self._file.parent.resolve()
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.parent):
            raise ValueError(f"{name!r} is outside of {folder.parent}")
        if path.exists():
            check_input(path)
        return path


def read_parts(path: Path, transform: Floats | None = None) -> list[tuple[str, Surface]]:
    """Parts of a mesh file by the names of their nodes, moved by a transform (4, 4).

    glTF comes in metres and z up, COLLADA too, by what the file says; the others as they are.

    Raises:
        AssetError: There is no such file, it is damaged, or it has no triangles.
    """
    check_mesh_file(path, SUFFIXES)
    whole = np.eye(4) if transform is None else transform
    suffix = path.suffix.lower()
    if suffix in GLTF:
        whole = whole @ Y_TO_Z
    elif suffix == ".dae":
        whole = whole @ _collada_frame(path)
    with parsing(path):
        source = _without_comments(path) if suffix == ".dae" else path
        scene = trimesh.load_scene(source, file_type=suffix[1:], process=False, resolver=_Nearby(path))
        known: dict[str, Surface] = {}
        parts = []
        for node in sorted(scene.graph.nodes_geometry):
            place, key = scene.graph[node]
            mesh = scene.geometry[key]
            if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
                continue
            if key not in known:
                known[key] = surface_of(mesh, linear=suffix in GLTF, side=TEXTURE_SIDE)
            parts.append((str(node), known[key].moved(whole @ place)))
    if not parts:
        raise AssetError(f"{path} has no triangles; export it as a mesh of triangles")
    if (count := sum(len(surface) for _, surface in parts)) > MAX_TRIANGLES:
        raise AssetError(f"{path} has {count} triangles; reduce it to {MAX_TRIANGLES} or fewer")
    return parts


def primitive(mesh: trimesh.Trimesh, colour: Floats) -> Surface:
    """A shape of one colour (3,), RGB from 0 to 1."""
    corners = np.asarray(mesh.triangles, np.float64)
    count = len(corners)
    return Surface(corners, np.tile(colour, (count, 3, 1)), np.zeros((count, 3, 2)), np.full(count, -1))


def _without_comments(path: Path) -> io.BytesIO:
    """A COLLADA file without comments: pycollada drops a geometry that has one."""
    return io.BytesIO(re.sub(rb"<!--.*?-->", b"", read_bytes(path), flags=re.DOTALL))


def _collada_frame(path: Path) -> Floats:
    """Transform (4, 4) from a COLLADA file to metres and z up, by its <asset>, which trimesh leaves alone."""
    unit, up = 1.0, "Y_UP"
    with parsing(path):
        for tag, element in _elements(path):
            if tag == "unit":
                unit = float(element.get("meter", "1"))
            elif tag == "up_axis":
                up = (element.text or up).strip()
            elif tag == "asset":
                break
    turn = {"Z_UP": np.eye(4), "X_UP": rotation_matrix(-np.pi / 2, [0, 1, 0])}.get(up, Y_TO_Z)
    return np.asarray(scale_matrix(unit) @ turn)


def _elements(path: Path) -> Iterator[tuple[str, ET.Element]]:
    for _, element in ET.iterparse(path):
        yield element.tag.rpartition("}")[2], element
