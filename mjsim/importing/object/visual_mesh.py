"""Simplify the surface of an object to a visual mesh, and bake its colours into a texture."""

import math
from dataclasses import dataclass
from typing import Self

import numpy as np
import scipy.sparse
import scipy.spatial
import trimesh
from numpy.typing import NDArray

from mjsim.formats.scene.surface import Floats, Ints, Surface
from mjsim.importing.object.closed_body import is_closed, simplified

SIDE = 512  # width and height of the texture, in pixels
_GUTTER = 2  # margin around a triangle that keeps colours from bleeding, in pixels
_SHRINK = 0.93  # factor by which the scale is reduced until all triangles fit into the image
_MIN_SIDE = 2  # minimum width of a triangle in the texture, in pixels
MAX_TRIANGLES = 1400
_SAMPLES = 200_000  # number of random surface points at which colours are sampled
_FACING = 0.01  # weight of normals in the search for the nearest surface point, in metres
_CREASE = math.radians(40.0)
_SHEET = 2e-4  # distance between the two sides of an open surface, in metres
_PLAIN = 3 / 255  # maximum difference of colours that count as equal


@dataclass(frozen=True, eq=False)
class Atlas:
    """The layout of triangles in a texture image."""

    shapes: Floats  # corners of each triangle, in pixels from the upper left of its block, shape (n, 3, 2)
    blocks: Ints  # left, top, width and height of each block in pixels, shape (n, 4)

    @classmethod
    def pack(cls, corners: Floats) -> Self:
        """Arrange triangles (n, 3, 3), in metres, at the largest scale at which they fit into the image."""
        flat = _flattened(corners)
        scale = SIDE / np.sqrt(np.prod(np.ptp(flat, axis=1), axis=1).sum())
        while (blocks := _shelves(flat, scale)) is None:
            scale *= _SHRINK
        return cls(_drawn(flat, scale) + _GUTTER, blocks)

    @property
    def uv(self) -> Floats:
        """The texture coordinates of all corners, from 0 to 1, shape (n, 3, 2). (0, 0) is the lower left."""
        places = (self.shapes + self.blocks[:, None, :2]) / SIDE
        return np.asarray(np.stack((places[..., 0], 1.0 - places[..., 1]), axis=-1))

    def texels(self) -> tuple[Ints, Floats]:
        """Return the index of the triangle (k,) and the barycentric coordinates (k, 3) of each pixel."""
        faces = np.repeat(np.arange(len(self.blocks)), np.prod(self.blocks[:, 2:], axis=1))
        pixels = self._pixels() - self.blocks[faces, :2] + 0.5
        flat = np.pad(self.shapes[faces], ((0, 0), (0, 0), (0, 1)))
        return faces, _projected(flat, np.pad(pixels, ((0, 0), (0, 1))))

    def picture(self, colours: Floats) -> NDArray[np.uint8]:
        """Create an image (SIDE, SIDE, 3) from the colours (k, 3) of all `texels`, as RGB from 0 to 1."""
        picture = np.empty((SIDE, SIDE, 3), np.uint8)
        picture[:] = np.round(255 * np.clip(colours.mean(axis=0), 0, 1))
        across, down = self._pixels().T
        picture[down, across] = np.round(255 * np.clip(colours, 0, 1))
        return picture

    def _pixels(self) -> Ints:
        grids = [
            np.stack(np.meshgrid(np.arange(w) + x, np.arange(h) + y, indexing="xy"), axis=-1).reshape(-1, 2)
            for x, y, w, h in self.blocks.tolist()
        ]
        return np.concatenate(grids)


def _flattened(corners: Floats) -> Floats:
    """Rotate triangles (n, 3, 3) into a plane, with the longest side along x. Return them as (n, 3, 2)."""
    count = np.arange(len(corners))
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    first = lengths.argmax(axis=1)
    a, b, c = (corners[count, (first + k) % 3] for k in range(3))
    length = np.linalg.norm(b - a, axis=1)
    along = np.einsum("nd,nd->n", c - a, (b - a) / np.maximum(length, 1e-12)[:, None])
    height = np.linalg.norm(np.cross(b - a, c - a), axis=1) / np.maximum(length, 1e-12)
    flat = np.zeros((len(corners), 3, 2))
    flat[count, (first + 1) % 3, 0] = length
    flat[count, (first + 2) % 3] = np.column_stack((np.clip(along, 0, length), height))
    return flat


def _drawn(flat: Floats, scale: float) -> Floats:
    size = np.ptp(flat, axis=1, keepdims=True)
    return np.asarray(flat * np.maximum(scale, _MIN_SIDE / np.maximum(size, 1e-12)))


def _shelves(flat: Floats, scale: float) -> Ints | None:
    """Pack flat triangles in rows, tallest first. Return their blocks (n, 4), or None if they do not fit."""
    sizes = np.ceil(np.ptp(_drawn(flat, scale), axis=1)).astype(int) + 2 * _GUTTER
    if sizes.max() > SIDE:
        return None
    blocks = np.empty((len(sizes), 4), np.int64)
    x = y = row = 0
    for k in np.lexsort((-sizes[:, 0], -sizes[:, 1])):
        w, h = sizes[k].tolist()
        if x + w > SIDE:
            x, y, row = 0, y + row, 0
        if y + h > SIDE:
            return None
        blocks[k] = x, y, w, h
        x, row = x + w, max(row, h)
    return blocks


@dataclass(frozen=True, eq=False)
class VisualMesh:
    """A triangle mesh with normals, and with a texture or a single colour."""

    vertices: Floats  # vertices in metres, shape (n, 3)
    faces: Ints  # vertex indices, shape (m, 3)
    normals: Floats  # unit normals at the corners of all faces, shape (m, 3, 3)
    # Texture coordinates of the corners from 0 to 1, shape (m, 3, 2). (0, 0) is the lower left.
    uv: Floats | None
    picture: NDArray[np.uint8] | None  # texture as an RGB image, shape (height, width, 3)
    colour: tuple[float, float, float]  # RGB colour from 0 to 1 of a mesh without a texture
    doubled: bool  # True if each face of an open surface was duplicated to be visible from both sides


def make_visual_mesh(surface: Surface, mesh: trimesh.Trimesh) -> VisualMesh:
    """Simplify a surface and bake its colours into a texture. `mesh` is the surface with joined vertices."""
    closed = is_closed(mesh)
    coarse = simplified(mesh, MAX_TRIANGLES if closed else MAX_TRIANGLES // 2)
    closed = closed and is_closed(coarse)
    coarse = coarse.copy()
    coarse.fix_normals(multibody=True)
    vertices, faces = np.asarray(coarse.vertices), np.asarray(coarse.faces)
    normals = corner_normals(vertices, faces)
    colour, uv, picture = _painted(surface, mesh, vertices[faces])
    if not closed:
        faces = np.concatenate((faces, faces[:, ::-1] + len(vertices)))
        vertices = np.concatenate((vertices, vertices - _SHEET * coarse.vertex_normals))
        normals = np.concatenate((normals, -normals[:, ::-1]))
        uv = None if uv is None else np.concatenate((uv, uv[:, ::-1]))
    return VisualMesh(vertices, faces, normals, uv, picture, colour, doubled=not closed)


def _painted(
    surface: Surface, mesh: trimesh.Trimesh, corners: Floats
) -> tuple[tuple[float, float, float], Floats | None, NDArray[np.uint8] | None]:
    sampled, triangles = trimesh.sample.sample_surface(mesh, _SAMPLES, seed=0)
    colours = surface.colours_at(triangles, _projected(surface.corners[triangles], sampled))
    red, green, blue = np.clip(colours.mean(axis=0), 0.0, 1.0).round(4).tolist()
    if np.ptp(colours, axis=0).max() <= _PLAIN:
        return (red, green, blue), None, None
    atlas = Atlas.pack(corners)
    near = scipy.spatial.cKDTree(_with_normals(sampled, surface.corners, triangles))
    faces, inside = atlas.texels()
    points = np.einsum("kc,kcd->kd", inside, corners[faces])
    found = triangles[near.query(_with_normals(points, corners, faces))[1]]
    baked = surface.colours_at(found, _projected(surface.corners[found], points))
    return (red, green, blue), atlas.uv, atlas.picture(baked)


def _with_normals(points: Floats, corners: Floats, triangles: Ints) -> Floats:
    return np.concatenate((points, _FACING * _normals(corners)[triangles]), axis=1)


def corner_normals(vertices: Floats, faces: Ints) -> Floats:
    """Return smooth normals at the corners of all faces, shape (m, 3, 3). Sharp edges stay sharp."""
    corners = vertices[faces]
    weighted = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    units = _normals(corners)
    count = faces.size
    at = scipy.sparse.csr_array((np.ones(count), (np.arange(count), faces.ravel())))
    here, there = (at @ at.T).nonzero()  # pairs of corners that share a vertex
    near = np.einsum("kd,kd->k", units[here // 3], units[there // 3]) > math.cos(_CREASE)
    total = np.zeros((count, 3))
    np.add.at(total, here[near], weighted[there[near] // 3])
    total /= np.maximum(np.linalg.norm(total, axis=1, keepdims=True), 1e-30)
    return np.asarray(total.reshape(-1, 3, 3))


def _normals(corners: Floats) -> Floats:
    edges = np.diff(corners, axis=1)
    normals = np.cross(edges[:, 0], edges[:, 1])
    return np.asarray(normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-30))


def _projected(corners: Floats, points: Floats) -> Floats:
    """Return the barycentric coordinates (k, 3) of points (k, 3), clamped to triangles (k, 3, 3)."""
    weights = trimesh.triangles.points_to_barycentric(corners, points)
    weights = np.clip(np.nan_to_num(weights, nan=1 / 3), 0.0, 1.0)
    return np.asarray(weights / np.maximum(weights.sum(axis=1, keepdims=True), 1e-12))
