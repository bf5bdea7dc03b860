"""Read mesh files with trimesh, including the poses and colours of all scene-graph nodes.

If the file format defines a unit and a vertical axis, the result is in metres with z up.
"""

import io
import logging
import mmap
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import FilePathResolver
from trimesh.transformations import rotation_matrix, scale_matrix

from mjsim.formats.scene.source_scene import TEXTURE_SIDE
from mjsim.formats.scene.surface import Floats, Surface, joined
from mjsim.support.files import check_input, read_bytes
from mjsim.values.errors import AssetError

OBJECT_SUFFIXES = (".glb", ".obj", ".stl", ".ply")
MAX_FILE = 500_000_000  # maximum file size in bytes
MAX_TRIANGLES = 5_000_000
PLAIN = (0.74, 0.72, 0.68)  # RGB colour of meshes without a colour
SCENE_SUFFIXES = (".glb", ".gltf", ".dae", ".obj", ".stl", ".ply")
GLTF = (".glb", ".gltf")
Y_TO_Z = rotation_matrix(np.pi / 2, [1, 0, 0])


class Beside(FilePathResolver):  # type: ignore[misc]  # trimesh has no types
    """A resolver for files that a mesh file refers to, such as materials."""

    def absolute(self, name: str) -> Path:
        """Return the path of a referenced file. Raise `OSError` for pipes, devices and oversized files."""
        path = Path(super().absolute(name))
        if path.exists():
            check_input(path)
        return path


def read_surface(path: Path) -> Surface:
    """Read all triangles of a mesh file in its own unit and axes. Raise `AssetError` if there are none."""
    check_mesh_file(path)
    with parsing(path):
        geometries = trimesh.load_scene(path, process=False, resolver=Beside(path)).dump()
    meshes = [g for g in geometries if isinstance(g, trimesh.Trimesh) and len(g.faces)]
    if not meshes:
        raise AssetError(f"{path} {_what_it_has(geometries)}; export it as a mesh of triangles")
    if (count := sum(len(mesh.faces) for mesh in meshes)) > MAX_TRIANGLES:
        raise AssetError(f"{path} has {count} triangles; reduce it to {MAX_TRIANGLES} or fewer")
    with parsing(path):
        return joined([surface_of(mesh, linear=path.suffix.lower() == ".glb") for mesh in meshes])


def missing_colours(path: Path) -> tuple[str, ...]:
    """Return the names of missing material and image files to which an OBJ file refers."""
    if path.suffix.lower() != ".obj":
        return ()
    named = _named(path, "mtllib")
    pictures = [picture for name in named for picture in _named(path.parent / name, "map_Kd")]
    return tuple(name for name in dict.fromkeys([*named, *pictures]) if not (path.parent / name).is_file())


def check_mesh_file(path: Path, suffixes: tuple[str, ...] = OBJECT_SUFFIXES) -> None:
    """Raise `AssetError` if a mesh file is missing, empty, too large, compressed, or of another format."""
    if path.suffix.lower() not in suffixes:
        raise AssetError(f"{path} is not a {', '.join(suffixes[:-1])} or {suffixes[-1]} file; convert it")
    if not path.is_file():
        raise AssetError(f"there is no file {path}")
    size = path.stat().st_size
    if size == 0:
        raise AssetError(f"{path} is empty; export it again")
    if size > MAX_FILE:
        raise AssetError(f"{path} has {size / 1e6:.0f} MB; reduce it to {MAX_FILE / 1e6:.0f} MB or less")
    if path.suffix.lower() in GLTF:
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            needed = re.findall(rb'"extensionsRequired"\s*:\s*\[([^]]*)', data)
        if packed := re.search(rb"\w*meshopt\w*", b" ".join(needed)):
            raise AssetError(f"{path} is compressed ({packed[0].decode()}); export it without compression")


@contextmanager
def parsing(path: Path) -> Iterator[None]:
    """Convert all errors of a mesh parser to `AssetError`, and suppress its warnings."""
    log = logging.getLogger("trimesh")
    before = log.level
    log.setLevel(logging.CRITICAL)
    try:
        yield
    except MemoryError as error:
        raise AssetError(f"{path} claims to be larger than the memory; export it again") from error
    except Exception as error:  # trimesh's parsers raise exceptions of many types
        reason = " ".join(str(error).split())[:120] or type(error).__name__
        kind = path.suffix.lower()
        raise AssetError(
            f"cannot read {path} as {kind}: {reason}; is it complete, and really a {kind} file?"
        ) from error
    finally:
        log.setLevel(before)


def _what_it_has(geometries: list[Any]) -> str:
    points = sum(len(g.vertices) for g in geometries if isinstance(g, trimesh.PointCloud))
    return f"has {points} points and no triangles" if points else "has no triangles"


def _named(path: Path, keyword: str) -> list[str]:
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", errors="replace") as lines:
        words = (line.split() for line in lines if line.lstrip().startswith(keyword))
        return [found[-1] for found in words if len(found) > 1]


def surface_of(mesh: trimesh.Trimesh, *, linear: bool, side: int | None = None) -> Surface:
    """Convert a trimesh mesh to a surface.

    Args:
        mesh: The mesh to convert.
        linear: True if plain colours are linear, as in glTF.
        side: Maximum side length of the image in pixels. Larger images are reduced. None keeps the image
            unchanged.
    """
    count = len(mesh.faces)
    corners = np.asarray(mesh.triangles, np.float64)
    colours, uv = np.ones((count, 3, 3)), np.zeros((count, 3, 2))
    colours[:] = PLAIN
    picture = None
    visual = mesh.visual
    if visual.kind == "texture":
        colours[:], picture = _material(visual.material, side)
        if visual.uv is None or len(visual.uv) != len(mesh.vertices):
            picture = None
        else:
            uv = np.asarray(visual.uv, np.float64)[mesh.faces]
    elif visual.kind == "vertex":
        colours = np.asarray(visual.vertex_colors, np.float64)[mesh.faces][..., :3] / 255
    elif visual.kind == "face":
        colours = np.repeat(np.asarray(visual.face_colors, np.float64)[:, None, :3] / 255, 3, axis=1)
    if linear and visual.kind is not None:
        colours = _srgb(colours)
    uv = np.nan_to_num(uv, nan=0.0, posinf=0.0, neginf=0.0)
    number = np.full(count, -1 if picture is None else 0)
    return Surface(corners, colours, uv, number, () if picture is None else (picture,))


def _material(material: Any, side: int | None) -> tuple[Floats, NDArray[np.float64] | None]:
    """Return a material's plain colour (3,) and its image (height, width, 3), as RGB values from 0 to 1."""
    if isinstance(material, trimesh.visual.material.PBRMaterial):
        factor, picture = material.baseColorFactor, material.baseColorTexture
    else:
        factor, picture = getattr(material, "diffuse", None), getattr(material, "image", None)
    if picture is not None and side is not None:
        picture = picture.copy()
        picture.thumbnail((side, side))
    pixels = None if picture is None else np.asarray(picture.convert("RGB"), np.float64) / 255
    if factor is None:
        return np.ones(3) if pixels is not None else np.array(PLAIN), pixels
    return np.asarray(factor, np.float64)[:3] / 255, pixels


def _srgb(linear: Floats) -> Floats:
    """Convert linear colours to sRGB (IEC 61966-2-1)."""
    low, high = 12.92 * linear, 1.055 * np.clip(linear, 0.0, 1.0) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, low, high)


class _Nearby(Beside):
    """A resolver for files in the mesh's folder or a sibling folder, such as `../textures/wood.png`."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._file = file

    def absolute(self, name: str) -> Path:
        folder = self._file.parent.resolve()
        path = (folder / name).resolve()
        if not path.is_relative_to(folder.parent):
            raise ValueError(f"{name!r} is outside of {folder.parent}")
        if path.exists():
            check_input(path)
        return path


def read_parts(path: Path, transform: Floats | None = None) -> list[tuple[str, Surface]]:
    """Read the parts of a mesh file with their node names, and apply a transform (4, 4) to them.

    Parts of glTF and COLLADA files are converted to metres with z up. Other formats keep their unit and axes.

    Raises:
        AssetError: The file is missing or damaged, or has no triangles.
    """
    check_mesh_file(path, SCENE_SUFFIXES)
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
    """Convert a mesh to a surface with a single colour (3,), given as RGB from 0 to 1."""
    corners = np.asarray(mesh.triangles, np.float64)
    count = len(corners)
    return Surface(corners, np.tile(colour, (count, 3, 1)), np.zeros((count, 3, 2)), np.full(count, -1))


def _without_comments(path: Path) -> io.BytesIO:
    """Remove comments from a COLLADA file, because pycollada drops geometries that contain a comment."""
    return io.BytesIO(re.sub(rb"<!--.*?-->", b"", read_bytes(path), flags=re.DOTALL))


def _collada_frame(path: Path) -> Floats:
    """Return the transform (4, 4) from a COLLADA file to metres with z up. trimesh ignores unit and axis."""
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
