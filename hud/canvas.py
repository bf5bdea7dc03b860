"""A translucent drawing surface, and the patch that is laid over a frame."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from hud.stencils import Floats, Stencils
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
        levels = np.arange(256.0)
        colour = np.rint(levels * share).astype(np.uint8)
        keep = np.rint(255.0 - (255.0 - levels) * share).astype(np.uint8)
        return Patch(cv2.LUT(self.colour, colour), cv2.LUT(self.keep, keep))

    @staticmethod
    def stack(strips: "Sequence[Patch]") -> "Patch":
        """Patches of one width below each other."""
        return Patch(np.concatenate([s.colour for s in strips]), np.concatenate([s.keep for s in strips]))

    def lay_over(self, frame: NDArray[np.uint8], x: int, y: int) -> None:
        """Blend onto `frame` in place with the upper left corner at column x, row y; it must lie inside."""
        height, width = self.keep.shape[:2]
        view = frame[y : y + height, x : x + width]
        cv2.multiply(view, self.keep, dst=view, scale=1.0 / 255.0)
        cv2.add(view, self.colour, dst=view)


class Canvas:
    """Draws shapes, text and pictures with opacity; `patch` turns the result into bytes.

    Colour times opacity and opacity lie in four planes, which the processor goes through quickest.
    """

    def __init__(self, width: int, height: int, stencils: Stencils, unit: float) -> None:
        self.width, self.height = width, height
        self._stencils = stencils
        self._unit = unit
        self._planes: Floats = np.zeros((4, height, width), dtype=np.float32)

    def rows(self, numbers: NDArray[np.int64]) -> "Canvas":
        """A new canvas with copies of these rows."""
        part = Canvas(self.width, 0, self._stencils, self._unit)
        part.height, part._planes = len(numbers), self._planes[:, numbers]
        return part

    def px(self, size: float) -> int:
        """Theme px to frame px."""
        return round(size * self._unit)

    def fill(self, mask: Floats, colour: Rgb, opacity: float, x: int = 0, y: int = 0) -> None:
        """Lay a colour over the canvas where `mask` (0..1, shape (h, w)) says, clipped to the canvas."""
        x0, y0 = max(x, 0), max(y, 0)
        x1, y1 = min(x + mask.shape[1], self.width), min(y + mask.shape[0], self.height)
        if x0 >= x1 or y0 >= y1:
            return
        share = mask[y0 - y : y1 - y, x0 - x : x1 - x] * np.float32(opacity)
        area = self._planes[:, y0:y1, x0:x1]
        change = np.array([*colour, 1.0], dtype=np.float32)[:, None, None] - area
        change *= share
        area += change

    def rounded(self, rect: Rect, radius: float, colour: Rgb, opacity: float, line: float = 0.0) -> None:
        """A filled rounded rectangle, or with `line` > 0 only its outline of that width, px of the frame."""
        mask = self._stencils.rounded(rect.width, rect.height, radius, line)
        self.fill(mask, colour, opacity, rect.x, rect.y)

    def shape(self, points: Sequence[tuple[float, float]], colour: Rgb, line: float = 0.0) -> None:
        """A smooth-edged filled polygon, or with `line` > 0 an open stroke of that width, px of the frame."""
        mask = np.zeros((self.height, self.width), dtype=np.uint8)
        corners = np.asarray(points, dtype=np.float64)
        fixed = [np.rint(corners * 16.0).astype(np.int32).reshape(-1, 1, 2)]
        if line > 0:
            cv2.polylines(mask, fixed, False, 255, max(1, round(line)), cv2.LINE_AA, 4)
        else:
            cv2.fillPoly(mask, fixed, 255, cv2.LINE_AA, 4)
        reach = line + 3.0  # covers round ends and smooth edges
        x, y = np.maximum(np.floor(corners.min(axis=0) - reach), 0).astype(int)
        right, bottom = np.ceil(corners.max(axis=0) + reach).astype(int)
        share = np.asarray(mask[y:bottom, x:right] / np.float32(255.0), dtype=np.float32)
        self.fill(share, colour, 1.0, int(x), int(y))

    def text(self, x: int, baseline: int, text: str, face: Face, colour: Rgb) -> int:
        """One line of text from column `x`; returns its width, px."""
        if not text:
            return 0
        size = max(1, self.px(face.size))
        stencil = self._stencils.text(text, size, face.weight)
        self.fill(stencil.mask, colour, 1.0, x + stencil.x, baseline + stencil.y)
        return self._stencils.face.width(text, size, face.weight)

    def text_width(self, text: str, face: Face) -> int:
        """Width of a line, px."""
        return self._stencils.face.width(text, max(1, self.px(face.size)), face.weight)

    def fit(self, text: str, face: Face, width: int) -> str:
        """`text`, cut to one line of `width` px."""
        return self._stencils.face.fit(text, max(1, self.px(face.size)), face.weight, width)

    def wrap(self, text: str, face: Face, width: int, lines: int) -> tuple[str, ...]:
        """`text`, broken into at most `lines` lines of `width` px."""
        return self._stencils.face.wrap(text, max(1, self.px(face.size)), face.weight, width, lines)

    def picture(self, key: str, x: int, y: int, size: int, opacity: float = 1.0) -> None:
        """The picture of that key, scaled to `size` px; nothing when there is none."""
        scaled = self._stencils.scaled(key, size)
        if scaled is None:
            return
        area = self._planes[:, y : y + size, x : x + size]
        share = scaled.opacity * np.float32(opacity)
        area[:3] += scaled.colours * np.float32(255.0 * opacity) - area[:3] * share
        area[3] += (1.0 - area[3]) * share

    def image(self, colours: NDArray[np.float32], opacity: NDArray[np.float32], x: int, y: int) -> None:
        """An image (h, w, 3), 0..255, with an opacity (h, w), 0..1, per pixel; it must lie inside."""
        area = self._planes[:, y : y + colours.shape[0], x : x + colours.shape[1]]
        area[:3] += (np.moveaxis(colours, 2, 0) - area[:3]) * opacity
        area[3] += (1.0 - area[3]) * opacity

    def circle(self, x: float, y: float, radius: float, colour: Rgb, opacity: float = 1.0) -> None:
        """A smooth-edged disc; centre and radius in px of the frame."""
        stencil = self._stencils.disc(x, y, radius)
        self.fill(stencil.mask, colour, opacity, stencil.x, stencil.y)

    def patch(self) -> Patch:
        """What was drawn, as bytes."""
        colours = np.clip(np.rint(self._planes[:3]), 0, 255).astype(np.uint8)
        keep = np.rint((1.0 - self._planes[3]) * 255.0).astype(np.uint8)
        return Patch(cv2.merge(list(colours)), cv2.merge([keep] * 3))
