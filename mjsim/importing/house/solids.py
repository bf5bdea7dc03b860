"""Create the collision geometry of an imported house from boxes, convex hulls and merged voxels."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from itertools import islice

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import binary_fill_holes
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import QhullError

from mjsim.formats.scene.source_scene import ScenePiece, merged_rectangles
from mjsim.formats.scene.surface import Floats
from mjsim.importing.object.parts import _few_vertices

BUDGET = 1500  # maximum number of colliding geoms in a house
# Range of heights, in metres, in which solids obstruct people. Solids below and above it are left out.
LOW, HIGH = 0.051, 1.9
# Voxel sizes in metres. The first size for which the number of geoms is within the budget is used.
_PITCHES = (0.05, 0.075, 0.1, 0.15, 0.2)
_BOX = 0.95  # A hull that fills at least this share of its bounding box becomes a box.
_CONVEX = 0.85  # minimum share of its hull that a convex mesh fills
_SMALL = 0.5  # size below which a mesh is replaced by its hull, in metres
_HANGING = 1.6  # height above which lamps and pictures do not collide, in metres
# Height in metres above which furniture becomes a box. A hull would appear to cover the floor below.
_OVERHEAD = 0.8
_FURNITURE = 1.5  # Closed meshes up to this side length, in metres, count as solid furniture.
_ROOM = (2.0, 2.0, 1.8)  # size in metres above which a closed mesh is a hollow room, not a block
_FEW = 30  # maximum number of voxel boxes in a piece of furniture
_MAX_PARTS = 4000  # maximum number of separate parts into which a piece is divided
_THIN = 0.01  # minimum thickness of colliding geoms, in metres


@dataclass(frozen=True, eq=False)
class Solid:
    """A convex collision shape."""

    name: str
    low: Floats  # lower corner of the bounding box in metres, shape (3,)
    high: Floats  # upper corner of the bounding box in metres, shape (3,)
    hull: Floats | None = None  # vertices of a hull in metres, shape (k, 3), or None for a box

    @property
    def outline(self) -> Floats:
        """The points (k, 2), in metres, whose convex hull is the outline of the solid seen from above."""
        if self.hull is not None:
            return self.hull[:, :2]
        (a, b), (c, d) = self.low[:2], self.high[:2]
        return np.array([[a, b], [c, b], [c, d], [a, d]])


@dataclass(frozen=True, eq=False)
class Solids:
    """The collision geometry of a house."""

    solids: tuple[Solid, ...]
    boxes: int
    hulls: int
    voxels: int  # number of boxes that were merged from voxels
    pitch: float  # side length of a voxel, in metres


def make_solids(pieces: Iterable[ScenePiece]) -> Solids:
    """Create collision shapes for the solid pieces of a scene that a person could walk into."""
    simple: list[Solid] = []
    rest: list[tuple[str, trimesh.Trimesh]] = []
    things: dict[str, list[trimesh.Trimesh]] = {}
    for piece in pieces:
        if piece.solid:
            things.setdefault(piece.name, []).extend(_parts(piece))
    for name, meshes in things.items():
        for mesh in _together(meshes):
            solid = _simple(name, mesh)
            if solid is None:
                rest.append((name, mesh))
            else:
                simple.append(solid)
    boxes: list[Solid] = []
    for pitch in _PITCHES:
        made = (solid for name, mesh in rest for solid in _few_voxels(name, mesh, pitch))
        enough = None if pitch == _PITCHES[-1] else max(BUDGET - len(simple), 0) + 1
        boxes = list(islice((solid for solid in made if solid.high[2] > LOW), enough))
        if len(simple) + len(boxes) <= BUDGET:
            break
    hulls = sum(solid.hull is not None for solid in simple)
    return Solids((*simple, *boxes), len(simple) - hulls, hulls, len(boxes), pitch)


def _parts(piece: ScenePiece) -> Iterator[trimesh.Trimesh]:
    mesh = piece.surface.mesh()
    bodies = _bodies(mesh)
    count = int(bodies.max()) + 1
    whole = count == 1 or count > _MAX_PARTS or (_compact(mesh.extents) and not mesh.is_watertight)
    parts = (
        [mesh] if whole else mesh.submesh([np.flatnonzero(bodies == k) for k in range(count)], repair=False)
    )
    for part in parts:
        low, high = part.bounds[:, 2]
        if high > LOW and low < (HIGH if np.ptp(part.bounds, axis=0)[:2].max() > _FURNITURE else _HANGING):
            yield part


def _bodies(mesh: trimesh.Trimesh) -> NDArray[np.int_]:
    """Return the number of the connected body of each face, shape (n,).

    Boxes that touch along an edge have four faces there. Faces are connected in pairs in the order of the file, in
    which the faces of a box are consecutive, so that the boxes remain separate bodies.
    """
    edges = np.sort(mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    faces = np.repeat(np.arange(len(mesh.faces)), 3)
    order = np.lexsort((faces, edges[:, 1], edges[:, 0]))
    edges, faces = edges[order], faces[order]
    starts = np.flatnonzero(np.r_[True, (edges[1:] != edges[:-1]).any(axis=1)])
    rank = np.arange(len(edges)) - np.repeat(starts, np.diff(np.r_[starts, len(edges)]))
    first = np.flatnonzero((rank[:-1] % 2 == 0) & (rank[1:] == rank[:-1] + 1))
    links = coo_array((np.ones(len(first)), (faces[first], faces[first + 1])), shape=(len(mesh.faces),) * 2)
    return np.asarray(connected_components(links, directed=False)[1])


def _together(meshes: list[trimesh.Trimesh]) -> list[trimesh.Trimesh]:
    """Merge the parts of a piece of furniture if it has many of them, such as the keys of a piano."""
    if len(meshes) <= _FEW or not _compact(np.ptp([m.bounds for m in meshes], axis=(0, 1))):
        return meshes
    return [trimesh.util.concatenate(meshes)]


def _simple(name: str, mesh: trimesh.Trimesh) -> Solid | None:
    low, high = mesh.bounds
    extents = high - low
    if (extents > _ROOM).all():
        return None
    if extents.min() < _THIN:
        flat = np.sort(extents)
        filled = mesh.area / 2 / max(flat[1] * flat[2], 1e-9) if not mesh.is_watertight else 1.0
        return _box(name, low, high) if filled > _CONVEX / 2 + 0.05 or flat[2] < _SMALL else None
    try:
        hull = trimesh.convex.convex_hull(_thickened(np.asarray(mesh.vertices)))
    except QhullError:
        return _box(name, low, high)
    if hull.volume > _BOX * np.prod(extents):
        return _box(name, low, high) if _filled(mesh, hull) or extents.max() < _SMALL else None
    if low[2] > _OVERHEAD and _compact(extents):
        return _box(name, low, high)
    if extents.max() < _SMALL or _filled(mesh, hull):
        points = _few_vertices(np.asarray(hull.vertices))
        return Solid(name, points.min(axis=0), points.max(axis=0), points)
    return None


def _thickened(points: Floats) -> Floats:
    """Add shifted copies of points (k, 3) if all of them are in a plane or on a line."""
    for axis in np.linalg.svd(points - points.mean(axis=0), full_matrices=False)[2][::-1][:2]:
        if np.ptp(points @ axis) < _THIN:
            points = np.concatenate([points - axis * _THIN / 2, points + axis * _THIN / 2])
    return points


def _filled(mesh: trimesh.Trimesh, hull: trimesh.Trimesh) -> bool:
    """Return True if a mesh nearly fills its hull. If the mesh is open, compare areas instead of volumes."""
    if mesh.is_watertight:
        return bool(abs(mesh.volume) > _CONVEX * hull.volume)
    return bool(abs(mesh.area - hull.area) < (1 - _CONVEX) * hull.area and _compact(mesh.extents))


def _box(name: str, low: Floats, high: Floats) -> Solid:
    grow = np.maximum(_THIN - (high - low), 0.0) / 2
    return Solid(name, low - grow, high + grow)


def _compact(extents: Floats) -> bool:
    """Return True if a solid is small enough to be furniture, and False if it is a wall."""
    return bool(extents[:2].max() < _FURNITURE)


def _few_voxels(name: str, mesh: trimesh.Trimesh, pitch: float) -> list[Solid]:
    boxes: list[Solid] = []
    for side in (p for p in _PITCHES if p >= pitch):
        boxes = list(_voxels(name, mesh, side))
        if len(boxes) <= _FEW or not _compact(mesh.extents):
            break
    return boxes


def _voxels(name: str, mesh: trimesh.Trimesh, pitch: float) -> Iterator[Solid]:
    """Yield boxes of merged voxels around a surface. Each box is shrunk to the surface inside it."""
    samples = _samples(np.asarray(mesh.triangles), pitch / 2)
    samples = samples[samples[:, 2] < HIGH + pitch]
    if not len(samples):
        return
    # The offset keeps the faces of walls away from cell borders. Walls are often multiples of 5 cm thick.
    origin = samples.min(axis=0) - 0.3 * pitch
    cells = np.floor((samples - origin) / pitch).astype(int)
    grid = np.zeros(cells.max(axis=0) + 1, bool)
    grid[tuple(cells.T)] = True
    if _compact(mesh.extents):
        grid = binary_fill_holes(grid)
    owner = np.full(grid.shape, -1)
    for number, (first, last) in enumerate(merged_boxes(grid)):
        owner[tuple(slice(a, b) for a, b in zip(first, last, strict=True))] = number
    number_of = owner[tuple(cells.T)]
    order = np.argsort(number_of, kind="stable")
    bounds = np.flatnonzero(np.diff(number_of[order])) + 1
    for rows in np.split(order, bounds):
        yield _box(name, samples[rows].min(axis=0), samples[rows].max(axis=0))


def _samples(corners: Floats, step: float) -> Floats:
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    first, count = lengths.argmax(axis=1), np.arange(len(corners))
    a, b, c = (corners[count, (first + k) % 3] for k in range(3))
    length = lengths[count, first]
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.maximum(length, 1e-12)
    along, across = (np.ceil(size / step).astype(int) + 1 for size in (length, height))
    total = (along + 1) * (across + 1)
    owner = np.repeat(count, total)
    index = np.arange(total.sum()) - np.repeat(np.cumsum(total) - total, total)
    i, j = np.divmod(index, (across + 1)[owner])
    u, v = (i / along[owner])[:, None], (j / across[owner])[:, None]
    return np.asarray((a[owner] + (b - a)[owner] * u) * (1 - v) + c[owner] * v)


def merged_boxes(grid: NDArray[np.bool_]) -> Iterator[tuple[tuple[int, int, int], tuple[int, int, int]]]:
    """Yield boxes that together cover each True cell of a grid (nx, ny, nz) exactly once.

    Columns with the same profile are merged, so that walls and tables give few boxes. Box ends are exclusive.
    """
    packed = np.packbits(grid, axis=2)
    profiles, index = np.unique(packed.reshape(-1, packed.shape[2]), axis=0, return_inverse=True)
    index = index.reshape(grid.shape[:2])
    for number, profile in enumerate(profiles):
        levels = np.unpackbits(profile)[: grid.shape[2]].astype(np.int8)
        steps = np.diff(np.concatenate([[0], levels, [0]]))
        spans = list(zip(np.flatnonzero(steps == 1), np.flatnonzero(steps == -1), strict=True))
        if not spans:
            continue
        for a, b, c, d in merged_rectangles(index == number):
            for bottom, top in spans:
                yield (a, c, int(bottom)), (b, d, int(top))
