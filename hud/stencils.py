"""Caches of masks and scaled pictures, whose computation takes most of the drawing time.

Cached values depend only on their arguments, so the caches do not change any results.
"""

import functools
import math
from collections.abc import Mapping
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from hud.text import Typeface
from hud.theme import Face

Floats = NDArray[np.float32]
Pictures = Mapping[str, NDArray[np.uint8]]


class Stencil(NamedTuple):
    """A coverage mask (h, w), from 0 to 1, and the position of its upper left corner in pixels."""

    mask: Floats
    x: int
    y: int


class Scaled(NamedTuple):
    """A scaled picture: premultiplied colours (3, s, s) and opacity (s, s), both from 0 to 1."""

    colours: Floats
    opacity: Floats


class Stencils:
    """A cache of text masks and scaled pictures. `unit` is the number of frame pixels per theme pixel."""

    def __init__(self, pictures: Pictures, unit: float) -> None:
        self.pictures = pictures
        self.unit = unit
        self.typeface = Typeface(unit)
        self.text = functools.lru_cache(512)(self._text)
        self.scaled = functools.lru_cache(128)(self._scaled)

    def _text(self, text: str, face: Face) -> Stencil:
        mask, baseline = self.typeface.rasterise(text, face)
        rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
        if not len(rows):
            return Stencil(np.zeros((0, 0), np.float32), 0, 0)
        inked = mask[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
        share = np.asarray(inked / np.float32(255.0), dtype=np.float32)
        return Stencil(share, int(columns[0]) - 1, int(rows[0]) - baseline)

    def _scaled(self, key: str, size: int) -> Scaled | None:
        picture = self.pictures.get(key)
        if picture is None:
            return None
        straight = picture.astype(np.float32) / np.float32(255.0)
        straight[..., :3] *= straight[..., 3:]
        method = cv2.INTER_AREA if size <= picture.shape[0] else cv2.INTER_LINEAR
        planes = np.moveaxis(cv2.resize(straight, (size, size), interpolation=method), 2, 0)
        return Scaled(np.ascontiguousarray(planes[:3]), np.ascontiguousarray(planes[3]))


@functools.lru_cache(64)
def rounded(width: int, height: int, radius: float, line: float) -> Floats:
    """Return the coverage of a rounded rectangle, or of its outline if `line` > 0, shape (height, width)."""
    ys, xs = np.mgrid[0:height, 0:width].astype(np.float32) + np.float32(0.5)
    dx = np.abs(xs - width / 2) - (width / 2 - radius)
    dy = np.abs(ys - height / 2) - (height / 2 - radius)
    distance = np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0) - radius
    mask = np.clip(0.5 - distance, 0, 1)
    if line > 0:
        mask = mask - np.clip(0.5 - distance - line, 0, 1)
    return np.asarray(mask, dtype=np.float32)


@functools.lru_cache(64)
def disc(x: float, y: float, radius: float) -> Stencil:
    """Return the coverage of a disc with smooth edges. The centre is at column `x` and row `y`."""
    left, top, side = math.floor(x - radius) - 1, math.floor(y - radius) - 1, math.ceil(2 * radius) + 3
    ys, xs = np.mgrid[0:side, 0:side].astype(np.float32) + np.float32(0.5)
    distance = np.hypot(xs + left - x, ys + top - y)
    return Stencil(np.asarray(np.clip(radius + 0.5 - distance, 0, 1), dtype=np.float32), left, top)
