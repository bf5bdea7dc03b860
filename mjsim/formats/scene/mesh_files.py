"""Read mesh files with trimesh, including the poses and colours of all scene-graph nodes.

If the file format defines a unit and a vertical axis, the result is in metres with z up.
"""

import io
import logging
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import trimesh
from trimesh.resolvers import FilePathResolver
from trimesh.transformations import rotation_matrix, scale_matrix

from mjsim.formats.scene.mesh_colours import is_opaque, surface_of
from mjsim.formats.scene.source_scene import TEXTURE_SIDE, ScenePiece
from mjsim.formats.scene.surface import Floats, Surface, joined
from mjsim.support.files import check_input, read_bytes
from mjsim.values.errors import AssetError

OBJECT_SUFFIXES = (".glb", ".obj", ".stl", ".ply")
MAX_FILE = 500_000_000  # maximum file size in bytes
MAX_TRIANGLES = 5_000_000
_MAX_VALUES = 100_000_000  # maximum number of vertices, vertex attributes and indices in a glTF file
SCENE_SUFFIXES = (".glb", ".gltf", ".dae", ".obj", ".stl", ".ply")
GLTF = (".glb", ".gltf")
Y_TO_Z = rotation_matrix(np.pi / 2, [1, 0, 0])
_TEXTURES = ("materials/textures", "textures", "materials/scripts")  # folders next to a mesh's folder
LOOSE = "mjsim_loose"  # key in the extras of a glTF mesh that marks a movable object


class Nearby(FilePathResolver):  # type: ignore[misc]  # trimesh has no types
    """A resolver for files to which a mesh file refers, such as materials and textures."""

    def __init__(self, file: Path) -> None:
        super().__init__(file)
        self._file = file

    def absolute(self, name: str) -> Path:
        """Return the path of a referenced file. Raise `OSError` for pipes, devices and oversized files."""
        path, root = referenced(self._file, name), self._file.parent.resolve().parent
        if not path.is_relative_to(root):
            raise ValueError(f"{name!r} is outside of {root}")
        if path.exists():
            check_input(path)
        return path


def referenced(file: Path, name: str) -> Path:
    """Return the path of a file to which a mesh file refers.

    If it is not there, look for it in the folders in which Gazebo models keep their textures.
    """
    folder = file.parent.resolve()
    others = (folder.parent / place / Path(name).name for place in _TEXTURES)
    path = (folder / name).resolve()
    return path if path.exists() else next((other for other in others if other.exists()), path)


def read_surface(path: Path) -> Surface:
    """Read all triangles of a mesh file in its own unit and axes. Raise `AssetError` if there are none."""
    check_mesh_file(path)
    scene = _load(path, path)
    with parsing(path):
        geometries = scene.dump()
    meshes = [g for g in geometries if isinstance(g, trimesh.Trimesh) and len(g.faces)]
    if not meshes:
        points = sum(len(g.vertices) for g in geometries if isinstance(g, trimesh.PointCloud))
        found = f"{points} points and no triangles" if points else "no triangles"
        raise AssetError(f"{path} has {found}; export it as a mesh of triangles")
    with parsing(path):
        return joined([surface_of(mesh, linear=path.suffix.lower() == ".glb") for mesh in meshes])


def missing_colours(path: Path) -> tuple[str, ...]:
    """Return the names of missing material and image files to which an OBJ file refers."""
    if path.suffix.lower() != ".obj":
        return ()
    named = _named(path, "mtllib")
    pictures = [picture for name in named for picture in _named(path.parent / name, "map_Kd")]
    return tuple(name for name in dict.fromkeys([*named, *pictures]) if not referenced(path, name).is_file())


def check_mesh_file(path: Path, suffixes: tuple[str, ...] = OBJECT_SUFFIXES) -> None:
    """Raise `AssetError` if a mesh file is missing, empty, too large, compressed, or of another format."""
    if path.suffix.lower() not in suffixes:
        raise AssetError(f"{path} is not a {', '.join(suffixes[:-1])} or {suffixes[-1]} file; convert it")
    if not path.is_file():
        raise AssetError(f"{path} is not a file; check the path")
    size = path.stat().st_size
    if size == 0:
        raise AssetError(f"{path} is empty; export it again")
    if size > MAX_FILE:
        raise AssetError(f"{path} has {size / 1e6:.0f} MB; reduce it to {MAX_FILE / 1e6:.0f} MB or less")
    if path.suffix.lower() in GLTF:
        header = gltf_header(path)
        needed = re.findall(rb'"extensionsRequired"\s*:\s*\[([^]]*)', header)
        if packed := re.search(rb"\w*meshopt\w*", b" ".join(needed)):
            raise AssetError(f"{path} is compressed ({packed[0].decode()}); export it without compression")
        values = sum(int(count[:20]) for count in re.findall(rb'"count"\s*:\s*(\d+)', header))
        if values > _MAX_VALUES:
            raise AssetError(f"{path} claims to have {values:,} vertices and indices; reduce or repair it")


def gltf_header(path: Path) -> bytes:
    """Return the JSON text of a glTF or GLB file."""
    with path.open("rb") as file:
        # A GLB file begins with its magic number, version and length, and the length and type of the JSON text.
        start = file.read(20)
        binary = start.startswith(b"glTF")
        return file.read(int.from_bytes(start[12:16], "little")) if binary else start + file.read()


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


def _named(path: Path, keyword: str) -> list[str]:
    if not path.is_file():
        return []
    with path.open(encoding="utf-8", errors="replace") as lines:
        words = (line.split() for line in lines if line.lstrip().startswith(keyword))
        return [found[-1] for found in words if len(found) > 1]


def read_parts(path: Path, transform: Floats | None = None) -> list[ScenePiece]:
    """Read the parts of a mesh file, each with a single material, and apply a transform (4, 4) to them.

    A part has the name of its node. Translucent parts, such as painted shadows and panes, are not seen. Parts of
    glTF and COLLADA files are converted to metres with z up. Other formats keep their unit and axes.

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
    scene = _load(path, _without_comments(path) if suffix == ".dae" else path)
    with parsing(path):
        known: dict[str, Surface] = {}
        parts = []
        for name, key, node in sorted(_nodes(scene)):
            mesh = scene.geometry[key]
            if not isinstance(mesh, trimesh.Trimesh) or not len(mesh.faces):
                continue
            if key not in known:
                known[key] = surface_of(mesh, linear=suffix in GLTF, side=TEXTURE_SIDE)
            surface = known[key].moved(whole @ scene.graph[node][0])
            loose = mesh.metadata.get(LOOSE) is True
            parts.append(ScenePiece(name, surface, is_opaque(mesh), loose=loose))
    if not parts:
        raise AssetError(f"{path} has no triangles; export it as a mesh of triangles")
    return parts


def _load(path: Path, source: Path | io.BytesIO) -> trimesh.Scene:
    """Load a scene. Raise `AssetError` if it has too many triangles, including those of repeated meshes."""
    with parsing(path):
        kind = path.suffix.lower()[1:]
        scene = trimesh.load_scene(source, file_type=kind, process=False, resolver=Nearby(path))
    keys = (scene.graph[node][1] for node in scene.graph.nodes_geometry)
    count = sum(len(getattr(scene.geometry[key], "faces", ())) for key in keys)
    if count > MAX_TRIANGLES:
        raise AssetError(f"{path} has {count} triangles; reduce it to {MAX_TRIANGLES} or fewer")
    return scene


def _nodes(scene: trimesh.Scene) -> Iterator[tuple[str, str, str]]:
    """Yield a name, the key of the geometry, and the node for each geometry of a scene.

    For a glTF mesh with several materials, trimesh creates child nodes with random names. Their name is that of the
    parent node.
    """
    parents = scene.graph.transforms.parents
    for node in scene.graph.nodes_geometry:
        key = scene.graph[node][1]
        shared = scene.geometry[key].metadata.get("from_gltf_primitive")
        yield str(parents[node] if shared else node), str(key), str(node)


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
        for _, element in ET.iterparse(path):
            tag = element.tag.rpartition("}")[2]
            if tag == "unit":
                unit = float(element.get("meter", "1"))
            elif tag == "up_axis":
                up = (element.text or up).strip()
            elif tag == "asset":
                break
    turn = {"Z_UP": np.eye(4), "X_UP": rotation_matrix(-np.pi / 2, [0, 1, 0])}.get(up, Y_TO_Z)
    return np.asarray(scale_matrix(unit) @ turn)
