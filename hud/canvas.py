"""A translucent drawing surface, and the patch that is laid over a frame."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from hud.text import Typeface
from hud.theme import Face, Rgb


@dataclass(frozen=True)
class Rect:
    """A rectangle of whole pixels: left, top, width, height."""

    x: int
    y: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """First column to the right of it."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """First row below it."""
        return self.y + self.height


@dataclass(frozen=True, eq=False)
class Patch:
    """A rasterised part: frame := frame * keep / 255 + colour.

    Attributes:
        colour: Colour times opacity, uint8, shape (h, w, 3).
        keep: How much of the frame shows through, 255 all of it, uint8, shape (h, w, 3).
    """

    colour: NDArray[np.uint8]
    keep: NDArray[np.uint8]

    def faded(self, opacity: float) -> "Patch":
        """The same, more transparent."""
        share = min(max(opacity, 0.0), 1.0)
        return Patch(
            np.rint(self.colour * share).astype(np.uint8),
            np.rint(255.0 - (255.0 - self.keep) * share).astype(np.uint8),
        )

    def lay_over(self, frame: NDArray[np.uint8], x: int, y: int) -> None:
        """Blend onto `frame` in place with the upper left corner at column x, row y; it must lie inside."""
        height, width = self.keep.shape[:2]
        view = frame[y : y + height, x : x + width]
        cv2.multiply(view, self.keep, dst=view, scale=1.0 / 255.0)
        cv2.add(view, self.colour, dst=view)


class Canvas:
    """Draws shapes, text and pictures with opacity; `patch` turns the result into bytes."""

    def __init__(self, width: int, height: int, face: Typeface, unit: float) -> None:
        self.width, self.height = width, height
        self._face = face
        self._unit = unit
        self._colour: NDArray[np.float32] = np.zeros((height, width, 3), dtype=np.float32)
        self._alpha: NDArray[np.float32] = np.zeros((height, width, 1), dtype=np.float32)

    def px(self, size: float) -> int:
        """Theme px to frame px."""
        return round(size * self._unit)

    def fill(self, mask: NDArray[Any], colour: Rgb, opacity: float, x: int = 0, y: int = 0) -> None:
        """Lay a colour over the canvas where `mask` (0..1, shape (h, w)) says, clipped to the canvas."""
        x0, y0 = max(x, 0), max(y, 0)
        x1, y1 = min(x + mask.shape[1], self.width), min(y + mask.shape[0], self.height)
        if x0 >= x1 or y0 >= y1:
            return
        share = (np.asarray(mask[y0 - y : y1 - y, x0 - x : x1 - x], dtype=np.float32) * np.float32(opacity))[
            ..., None
        ]
        area = np.s_[y0:y1, x0:x1]
        self._colour[area] += (np.asarray(colour, dtype=np.float32) - self._colour[area]) * share
        self._alpha[area] += (1.0 - self._alpha[area]) * share

    def rounded(self, rect: Rect, radius: float, colour: Rgb, opacity: float, line: float = 0.0) -> None:
        """A filled rounded rectangle, or with `line` > 0 only its outline of that width, px of the frame."""
        ys, xs = np.mgrid[0 : rect.height, 0 : rect.width].astype(np.float32) + np.float32(0.5)
        dx = np.abs(xs - rect.width / 2) - (rect.width / 2 - radius)
        dy = np.abs(ys - rect.height / 2) - (rect.height / 2 - radius)
        distance = np.hypot(np.maximum(dx, 0), np.maximum(dy, 0)) + np.minimum(np.maximum(dx, dy), 0) - radius
        mask = np.clip(0.5 - distance, 0, 1)
        if line > 0:
            mask = mask - np.clip(0.5 - distance - line, 0, 1)
        self.fill(mask, colour, opacity, rect.x, rect.y)

    def shape(self, points: Sequence[tuple[float, float]], colour: Rgb, line: float = 0.0) -> None:
        """A smooth-edged filled polygon, or with `line` > 0 an open stroke of that width, px of the frame."""
        mask = np.zeros((self.height, self.width), dtype=np.uint8)
        fixed = [np.rint(np.asarray(points, dtype=np.float64) * 16.0).astype(np.int32).reshape(-1, 1, 2)]
        if line > 0:
            cv2.polylines(mask, fixed, False, 255, max(1, round(line)), cv2.LINE_AA, 4)
        else:
            cv2.fillPoly(mask, fixed, 255, cv2.LINE_AA, 4)
        self.fill(mask / np.float32(255.0), colour, 1.0)

    def text(self, x: int, baseline: int, text: str, face: Face, colour: Rgb) -> int:
        """One line of text from column `x`; returns its width, px."""
        if not text:
            return 0
        size = max(1, self.px(face.size))
        mask, row = self._face.stamp(text, size, face.weight)
        self.fill(mask / np.float32(255.0), colour, 1.0, x - 1, baseline - row)
        return self._face.width(text, size, face.weight)

    def text_width(self, text: str, face: Face) -> int:
        """Width of a line, px."""
        return self._face.width(text, max(1, self.px(face.size)), face.weight)

    def fit(self, text: str, face: Face, width: int) -> str:
        """`text`, cut to one line of `width` px."""
        return self._face.fit(text, max(1, self.px(face.size)), face.weight, width)

    def wrap(self, text: str, face: Face, width: int, lines: int) -> tuple[str, ...]:
        """`text`, broken into at most `lines` lines of `width` px."""
        return self._face.wrap(text, max(1, self.px(face.size)), face.weight, width, lines)

    def picture(self, picture: NDArray[np.uint8], x: int, y: int, size: int, opacity: float = 1.0) -> None:
        """An RGBA picture (s, s, 4), scaled to `size` px."""
        straight = picture.astype(np.float32) / np.float32(255.0)
        straight[..., :3] *= straight[..., 3:]
        shrinking = size <= picture.shape[0]
        scaled = cv2.resize(
            straight, (size, size), interpolation=cv2.INTER_AREA if shrinking else cv2.INTER_LINEAR
        )
        area = np.s_[y : y + size, x : x + size]
        share = scaled[..., 3:] * np.float32(opacity)
        self._colour[area] += scaled[..., :3] * np.float32(255.0 * opacity) - self._colour[area] * share
        self._alpha[area] += (1.0 - self._alpha[area]) * share

    def image(self, colours: NDArray[np.float32], opacity: NDArray[np.float32], x: int, y: int) -> None:
        """An image (h, w, 3), 0..255, with an opacity (h, w), 0..1, per pixel; it must lie inside."""
        area = np.s_[y : y + colours.shape[0], x : x + colours.shape[1]]
        share = opacity[..., None]
        self._colour[area] += (colours - self._colour[area]) * share
        self._alpha[area] += (1.0 - self._alpha[area]) * share

    def circle(self, x: float, y: float, radius: float, colour: Rgb, opacity: float = 1.0) -> None:
        """A smooth-edged disc; centre and radius in px of the frame."""
        left, top, side = math.floor(x - radius) - 1, math.floor(y - radius) - 1, math.ceil(2 * radius) + 3
        ys, xs = np.mgrid[0:side, 0:side].astype(np.float32) + np.float32(0.5)
        distance = np.hypot(xs + left - x, ys + top - y)
        self.fill(np.clip(radius + 0.5 - distance, 0, 1), colour, opacity, left, top)

    def patch(self) -> Patch:
        """What was drawn, as bytes."""
        keep = np.rint((1.0 - self._alpha) * 255.0).astype(np.uint8)
        return Patch(
            np.clip(np.rint(self._colour), 0, 255).astype(np.uint8),
            np.ascontiguousarray(np.repeat(keep, 3, 2)),
        )
