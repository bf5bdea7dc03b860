"""A transparent surface for drawing panels, and the resulting patches, which are blended onto frames."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from hud import theme
from hud.stencils import Floats, Stencils, disc, rounded
from hud.theme import Face, Rgb


@dataclass(frozen=True)
class Rect:
    """A rectangle in pixels."""

    x: int
    y: int
    width: int
    height: int

    @property
    def right(self) -> int:
        """The first column to the right of the rectangle."""
        return self.x + self.width

    @property
    def bottom(self) -> int:
        """The first row below the rectangle."""
        return self.y + self.height


@dataclass(frozen=True, eq=False)
class Patch:
    """The image of a panel and its transparency. Blending computes `frame * keep / 255 + colour`."""

    colour: NDArray[np.uint8]  # colour times opacity, shape (h, w, 3)
    keep: NDArray[np.uint8]  # transparency, 255 where the frame remains unchanged, shape (h, w, 3)

    def faded(self, opacity: float) -> "Patch":
        """Return a copy of the patch whose opacity is multiplied by `opacity`, from 0 to 1."""
        share = min(max(opacity, 0.0), 1.0)
        levels = np.arange(256.0)
        colour = np.rint(levels * share).astype(np.uint8)
        keep = np.rint(255.0 - (255.0 - levels) * share).astype(np.uint8)
        return Patch(cv2.LUT(self.colour, colour), cv2.LUT(self.keep, keep))

    def lay_over(self, frame: NDArray[np.uint8], x: int, y: int) -> None:
        """Blend the patch onto a frame in place, with its corner at (x, y). It must fit into the frame."""
        height, width = self.keep.shape[:2]
        view = frame[y : y + height, x : x + width]
        cv2.multiply(view, self.keep, dst=view, scale=1.0 / 255.0)
        cv2.add(view, self.colour, dst=view)


class Canvas:
    """A transparent surface for shapes, text and pictures. All coordinates are in pixels."""

    def __init__(self, stencils: Stencils, width: int, height: int) -> None:
        self.width, self.height = width, height
        self.stencils = stencils
        self.typeface = stencils.typeface
        self.unit = stencils.unit
        self.px = stencils.typeface.px
        # Planes of red, green, blue (each times opacity) and opacity. Interleaved channels would be slower.
        self._planes: Floats = np.zeros((4, height, width), dtype=np.float32)

    @classmethod
    def panel(cls, stencils: Stencils, rect: Rect) -> "Canvas":
        """Return a canvas with the size of `rect` and the background of a panel."""
        canvas = cls(stencils, rect.width, rect.height)
        whole, radius = Rect(0, 0, rect.width, rect.height), theme.PANEL_RADIUS * stencils.unit
        canvas.rounded(whole, radius, theme.PANEL, theme.PANEL_OPACITY)
        canvas.rounded(whole, radius, theme.EDGE, theme.EDGE_OPACITY, line=max(1.0, stencils.unit))
        return canvas

    def fill(self, mask: Floats, colour: Rgb, opacity: float, x: int = 0, y: int = 0) -> None:
        """Blend a colour onto the canvas. `mask` is the coverage from 0 to 1. Parts beyond the canvas are ignored."""
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
        """Draw a filled rounded rectangle, or only its outline if the width `line` is positive."""
        self.fill(rounded(rect.width, rect.height, radius, line), colour, opacity, rect.x, rect.y)

    def shape(self, points: Sequence[tuple[float, float]], colour: Rgb, line: float = 0.0) -> None:
        """Draw a filled polygon with smooth edges, or an open polyline if the width `line` is positive."""
        mask = np.zeros((self.height, self.width), dtype=np.uint8)
        corners = np.asarray(points, dtype=np.float64)
        fixed = [np.rint(corners * 16.0).astype(np.int32).reshape(-1, 1, 2)]
        if line > 0:
            cv2.polylines(mask, fixed, False, 255, max(1, round(line)), cv2.LINE_AA, 4)
        else:
            cv2.fillPoly(mask, fixed, 255, cv2.LINE_AA, 4)
        reach = line + 3.0  # leaves space for round line ends and smooth edges
        x, y = np.maximum(np.floor(corners.min(axis=0) - reach), 0).astype(int)
        right, bottom = np.ceil(corners.max(axis=0) + reach).astype(int)
        share = np.asarray(mask[y:bottom, x:right] / np.float32(255.0), dtype=np.float32)
        self.fill(share, colour, 1.0, int(x), int(y))

    def arrow(
        self, centre: float, angle: float, outline: Sequence[tuple[float, float]], size: float, colour: Rgb
    ) -> None:
        """Draw a polygon whose y axis points down, scaled by `size` and rotated by `angle` radians."""
        c, s = math.cos(angle), -math.sin(angle)
        points = [(centre + size * (a * c - b * s), centre + size * (a * s + b * c)) for a, b in outline]
        self.shape(points, colour)

    def text(self, x: int, baseline: int, text: str, face: Face, colour: Rgb) -> int:
        """Draw one line of text that starts at column `x`. Return the width of the text."""
        if not text:
            return 0
        stencil = self.stencils.text(text, face)
        self.fill(stencil.mask, colour, 1.0, x + stencil.x, baseline + stencil.y)
        return self.typeface.width(text, face)

    def tile(self, key: str | None, x: int, y: int, size: int, opacity: float = 1.0) -> None:
        """Draw a picture on a light square with rounded corners. The square is empty for an unknown key."""
        self.rounded(Rect(x, y, size, size), 4.0 * self.unit, theme.TILE_COLOUR, 0.94 * opacity)
        inset = self.px(1)
        side = size - 2 * inset
        scaled = None if key is None else self.stencils.scaled(key, side)
        if scaled is None:
            return
        area = self._planes[:, y + inset : y + inset + side, x + inset : x + inset + side]
        share = scaled.opacity * np.float32(opacity)
        area[:3] += scaled.colours * np.float32(255.0 * opacity) - area[:3] * share
        area[3] += (1.0 - area[3]) * share

    def image(self, colours: Floats, opacity: Floats, x: int, y: int) -> None:
        """Draw an image (h, w, 3) from 0 to 255 with an opacity (h, w) from 0 to 1. It must lie within the canvas."""
        area = self._planes[:, y : y + colours.shape[0], x : x + colours.shape[1]]
        area[:3] += (np.moveaxis(colours, 2, 0) - area[:3]) * opacity
        area[3] += (1.0 - area[3]) * opacity

    def circle(self, x: float, y: float, radius: float, colour: Rgb, opacity: float = 1.0) -> None:
        stencil = disc(x, y, radius)
        self.fill(stencil.mask, colour, opacity, stencil.x, stencil.y)

    def patch(self) -> Patch:
        colours = np.clip(np.rint(self._planes[:3]), 0, 255).astype(np.uint8)
        keep = np.rint((1.0 - self._planes[3]) * 255.0).astype(np.uint8)
        return Patch(cv2.merge(list(colours)), cv2.merge([keep] * 3))
