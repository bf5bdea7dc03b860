"""Create the visual meshes of an imported house, with a limited number of triangles."""

import hashlib
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import scipy.spatial
import trimesh

from mjsim.formats.scene.source_scene import ScenePiece
from mjsim.formats.scene.surface import Floats, Surface, cleaned, joined
from mjsim.importing.house.floor_grid import Mask
from mjsim.importing.object.closed_body import is_closed
from mjsim.importing.object.visual_mesh import VisualMesh, corner_normals

BUDGET = 150_000  # maximum total number of triangles in a house
_LEAST = 100  # minimum number of triangles to which meshes are simplified
_LEAST_VERTICES = 4  # minimum number of vertices that MuJoCo requires for a mesh
_SMALL, _FEW = 0.3, 1000  # maximum size of small objects in metres, and their maximum number of triangles
CEILING = 2.2  # height above which geoms are hidden in top-down views, in metres
_SAME = 8  # step to which colours are rounded, on a scale from 0 to 255


@dataclass(frozen=True, eq=False)
class DrawnMesh:
    """A visual mesh with a single material."""

    name: str
    visual: VisualMesh
    high: bool  # True if the mesh is over a room and hidden in top-down views


def make_drawn_meshes(
    pieces: Iterable[ScenePiece], over_floor: Callable[[Floats], Mask]
) -> tuple[DrawnMesh, ...]:
    """Create the visual meshes of all visible pieces of a scene.

    `over_floor` returns a mask of the points (k, 2), in metres, that are over rooms and not over walls.
    """
    parts = []
    for name, surface in _by_name(pieces):
        surface, _ = cleaned(surface)
        high = (surface.corners[:, :, 2].min(axis=1) >= CEILING) & _over(surface, over_floor)
        for rows, is_high in ((~high, False), (high, True)):
            if rows.any():
                parts.append((name, surface.select(rows), is_high))
    materials = [(name, one, high) for name, surface, high in parts for one in _by_material(surface)]
    limit = max((len(surface) for _, surface, _ in materials), default=0)
    while sum(min(len(surface), limit) for _, surface, _ in materials) > BUDGET and limit > _LEAST:
        limit = int(limit * 0.8)
    found = []
    for name, surface, high in materials:
        small = np.ptp(surface.corners.reshape(-1, 3), axis=0).max() < _SMALL
        found.append(DrawnMesh(name, _visual_mesh(_reduced(surface, _FEW if small else limit)), high))
    return tuple(mesh for mesh in found if len(mesh.visual.vertices) >= _LEAST_VERTICES)


def _over(surface: Surface, over_floor: Callable[[Floats], Mask]) -> Mask:
    """Return a mask (n,) of the triangles that are over a room, judged by four points of each triangle."""
    middle = surface.corners.mean(axis=1)[:, :2]
    halfway = (middle[:, None] + surface.corners[:, :, :2]) / 2
    return np.asarray(over_floor(middle) | over_floor(halfway.reshape(-1, 2)).reshape(-1, 3).any(axis=1))


def picture_key(mesh: VisualMesh) -> str:
    """Return a hash of the texture of a mesh, or an empty string if the mesh has no texture."""
    return "" if mesh.picture is None else hashlib.sha256(mesh.picture.tobytes()).hexdigest()[:12]


def _by_name(pieces: Iterable[ScenePiece]) -> Iterator[tuple[str, Surface]]:
    groups: dict[str, list[Surface]] = {}
    for piece in pieces:
        if piece.seen:
            groups.setdefault(piece.name, []).append(piece.surface)
    for name, surfaces in groups.items():
        yield name, joined(surfaces)


def _by_material(surface: Surface) -> Iterator[Surface]:
    colours = np.round(surface.colours.mean(axis=1) * 255 / _SAME).astype(int)
    keys = np.column_stack((surface.image, colours))
    kinds, number = np.unique(keys, axis=0, return_inverse=True)
    for kind in range(len(kinds)):
        yield surface.select(number.ravel() == kind)


def _reduced(surface: Surface, count: int) -> Surface:
    """Simplify a surface with one material to about `count` triangles.

    Each triangle takes its texture coordinates from the nearest original triangle.
    """
    if len(surface) <= count:
        return surface
    mesh = surface.mesh()
    coarse = mesh.simplify_quadric_decimation(face_count=count)
    if not 0 < len(coarse.faces) < len(surface):
        return surface
    corners = np.asarray(coarse.triangles, np.float64)
    nearest = scipy.spatial.cKDTree(surface.corners.mean(axis=1)).query(corners.mean(axis=1))[1]
    before = surface.corners[nearest]
    weights = trimesh.triangles.points_to_barycentric(np.repeat(before, 3, axis=0), corners.reshape(-1, 3))
    weights = np.clip(np.nan_to_num(weights, nan=1 / 3), -1.0, 2.0).reshape(-1, 3, 3)
    uv = np.einsum("fkc,fcd->fkd", weights, surface.uv[nearest])
    return replace(surface.select(nearest), corners=corners, uv=uv)


def _visual_mesh(surface: Surface) -> VisualMesh:
    mesh = surface.mesh()
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    normals = corner_normals(vertices, faces)
    image = int(surface.image[0])
    picture = None if image < 0 else np.round(255 * surface.images[image]).astype(np.uint8)
    uv: Floats | None = None if picture is None else surface.uv
    red, green, blue = np.clip(surface.colours.mean(axis=(0, 1)), 0.0, 1.0).round(4).tolist()
    doubled = not is_closed(mesh)
    if doubled:
        faces = np.concatenate((faces, faces[:, ::-1]))
        normals = np.concatenate((normals, -normals[:, ::-1]))
        uv = None if uv is None else np.concatenate((uv, uv[:, ::-1]))
    return VisualMesh(vertices, faces, normals, uv, picture, (red, green, blue), doubled)
