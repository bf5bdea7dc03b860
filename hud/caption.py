"""A caption at the bottom of a frame: a title, and a line below it."""

import functools

import numpy as np
from numpy.typing import NDArray

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.errors import FrameError
from hud.layout import unit_of
from hud.stencils import Stencils


class Captions:
    """Draws captions over frames of one size, px; a FrameError where it is too small."""

    def __init__(self, width: int, height: int) -> None:
        self._size = (width, height)
        self._stencils = Stencils({}, unit_of(width, height))
        self._patch = functools.lru_cache(64)(self._draw)

    def over(self, frame: NDArray[np.uint8], title: str, detail: str = "") -> NDArray[np.uint8]:
        """A copy of a frame, RGB, uint8, shape (height, width, 3), with a caption."""
        width, height = self._size
        if frame.shape != (height, width, 3):
            raise FrameError(f"frame must be of shape {(height, width, 3)}, got {frame.shape}")
        out = np.array(frame, dtype=np.uint8, order="C", copy=True)
        patch = self._patch(title, detail)
        rows, columns = patch.keep.shape[:2]
        bottom = height - self._stencils.typeface.px(2 * theme.MARGIN)
        patch.lay_over(out, (width - columns) // 2, bottom - rows)
        return out

    def _draw(self, title: str, detail: str) -> Patch:
        typeface = self._stencils.typeface
        px, room = typeface.px, self._size[0] - typeface.px(6 * theme.MARGIN)
        first, second = typeface.fit(title, theme.CHIP, room), typeface.fit(detail, theme.BAR, room)
        text_width = max(typeface.width(first, theme.CHIP), typeface.width(second, theme.BAR))
        height = px(2 * theme.PADDING + theme.LINE * (2.4 if second else 1.2))
        canvas = Canvas.panel(self._stencils, Rect(0, 0, text_width + px(4 * theme.PADDING), height))
        canvas.text(px(2 * theme.PADDING), px(theme.PADDING + 13), first, theme.CHIP, theme.TEXT)
        canvas.text(px(2 * theme.PADDING), px(theme.PADDING + 31), second, theme.BAR, theme.QUIET)
        return canvas.patch()
