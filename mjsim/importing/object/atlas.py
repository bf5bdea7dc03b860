"""A picture in which every triangle of a surface has a place of its own, at one scale."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from mjsim.formats.scene.surface import Floats, Ints

SIDE = 512  # px
_GUTTER = 2  # px around a triangle, so that neighbours do not bleed in
_SHRINK = 0.93  # of the scale, until all triangles fit
_MIN_SIDE = 2  # px across a triangle


@dataclass(frozen=True, eq=False)
class Atlas:
    """Where the triangles lie."""

    shapes: Floats  # corners of each triangle in its own block, px, from the block's upper left, (n, 3, 2)
    blocks: Ints  # left, upper, width and height of each block, px, (n, 4)

    @classmethod
    def pack(cls, corners: Floats) -> Self:
        """Lay out triangles with these corners, m, shape (n, 3, 3), as large as they fit."""
        flat = _flattened(corners)
        scale = SIDE / np.sqrt(np.prod(np.ptp(flat, axis=1), axis=1).sum())
        while (blocks := _shelves(flat, scale)) is None:
            scale *= _SHRINK
        return cls(_drawn(flat, scale) + _GUTTER, blocks)

    @property
    def uv(self) -> Floats:
        """Places of the corners, from 0 to 1 from the lower left, shape (n, 3, 2)."""
        places = (self.shapes + self.blocks[:, None, :2]) / SIDE
        return np.asarray(np.stack((places[..., 0], 1.0 - places[..., 1]), axis=-1))

    def texels(self) -> tuple[Ints, Floats]:
        """Triangle (k,) and weights of its corners (k, 3) for all pixels of all blocks, block by block."""
        faces = np.repeat(np.arange(len(self.blocks)), np.prod(self.blocks[:, 2:], axis=1))
        pixels = self._pixels() - self.blocks[faces, :2] + 0.5
        a, b, c = (self.shapes[faces, k] for k in range(3))
        whole = _cross(b - a, c - a)
        second, third = _cross(pixels - a, c - a) / whole, _cross(b - a, pixels - a) / whole
        weights = np.clip(np.column_stack((1 - second - third, second, third)), 0.0, 1.0)
        return faces, weights / weights.sum(axis=1, keepdims=True)

    def picture(self, colours: Floats) -> NDArray[np.uint8]:
        """The picture, shape (SIDE, SIDE, 3), of colours (k, 3) of all `texels`, RGB from 0 to 1."""
        picture = np.empty((SIDE, SIDE, 3), np.uint8)
        picture[:] = np.round(255 * np.clip(colours.mean(axis=0), 0, 1))
        across, down = self._pixels().T
        picture[down, across] = np.round(255 * np.clip(colours, 0, 1))
        return picture

    def _pixels(self) -> Ints:
        """Column and row of all pixels of all blocks, shape (k, 2)."""
        grids = [
            np.stack(np.meshgrid(np.arange(w) + x, np.arange(h) + y, indexing="xy"), axis=-1).reshape(-1, 2)
            for x, y, w, h in self.blocks.tolist()
        ]
        return np.concatenate(grids)


def _flattened(corners: Floats) -> Floats:
    """Triangles (n, 3, 3) in the plane, the longest side along x, m, shape (n, 3, 2); corners stay in order."""
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
    """Flat triangles (n, 3, 2), m, in pixels; slivers are drawn wider."""
    size = np.ptp(flat, axis=1, keepdims=True)
    return np.asarray(flat * np.maximum(scale, _MIN_SIDE / np.maximum(size, 1e-12)))


def _shelves(flat: Floats, scale: float) -> Ints | None:
    """Blocks (n, 4) of flat triangles (n, 3, 2), in rows from high to low; None if they do not fit."""
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


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
