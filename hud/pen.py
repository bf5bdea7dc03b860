"""What every panel is drawn with: backgrounds, tiles, and strips of a panel that are kept for the next one."""

import functools
import math
from collections import OrderedDict
from collections.abc import Callable, Hashable

import numpy as np

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.stencils import Stencils

RADIUS = 8.0  # of the corners of a panel
STRIPS_KEPT = 64  # several times as many as are shown at once


class Pen:
    """Draws in a frame's scale.

    Args:
        stencils: Shapes, text and pictures.
        unit: Frame px per theme px.
    """

    def __init__(self, stencils: Stencils, unit: float) -> None:
        self.stencils = stencils
        self.unit = unit
        self._backgrounds = functools.lru_cache(16)(self._background)
        self._strips: OrderedDict[Hashable, Patch] = OrderedDict()

    def canvas(self, width: int, height: int) -> Canvas:
        """An empty canvas."""
        return Canvas(width, height, self.stencils, self.unit)

    def panel(self, rect: Rect) -> Canvas:
        """A canvas of the size of `rect` with the dark rounded background."""
        return self._rows_of_panel(rect, 0, rect.height)

    def strip(
        self, rect: Rect, top: int, height: int, what: Hashable, draw: Callable[[Canvas], None]
    ) -> Patch:
        """Rows of a panel from `top` on, drawn unless the same were drawn lately.

        Args:
            rect: The panel.
            top: First row.
            height: How many.
            what: All that `draw` depends on.
            draw: Draws on the background, in coordinates of the strip.
        """
        below = rect.height - top - height
        # Between the corners a background is the same in every row, so that a strip may move up and down.
        corners = tuple(gap if gap < self._corner else None for gap in (top, below))
        key = (what, rect.width, height, corners)
        patch = self._strips.pop(key, None)
        if patch is None:
            canvas = self._rows_of_panel(rect, top, height)
            draw(canvas)
            patch = canvas.patch()
        self._strips[key] = patch
        if len(self._strips) > STRIPS_KEPT:
            self._strips.popitem(last=False)
        return patch

    def tile(self, canvas: Canvas, key: str | None, x: int, y: int, size: int, opacity: float = 1.0) -> None:
        """A picture on a light rounded tile; an unknown key leaves the tile empty."""
        canvas.rounded(Rect(x, y, size, size), 4.0 * self.unit, theme.TILE, 0.94 * opacity)
        if key is not None:
            inset = canvas.px(1)
            canvas.picture(key, x + inset, y + inset, size - 2 * inset, opacity)

    @property
    def _corner(self) -> int:
        """Rows at the top and the bottom of a panel that its corners touch, and one to spare."""
        return math.ceil(RADIUS * self.unit) + 1

    def _rows_of_panel(self, rect: Rect, top: int, height: int) -> Canvas:
        corner = self._corner
        standard = min(rect.height, 2 * corner + 1)
        rows = np.arange(top, top + height)
        rows = np.where(rows < rect.height - corner, np.minimum(rows, corner), rows - rect.height + standard)
        return self._backgrounds(rect.width, standard).rows(rows)

    def _background(self, width: int, height: int) -> Canvas:
        """The background of a panel; a higher one has its middle row more often."""
        canvas = self.canvas(width, height)
        whole = Rect(0, 0, width, height)
        canvas.rounded(whole, RADIUS * self.unit, theme.PANEL, theme.PANEL_OPACITY)
        canvas.rounded(whole, RADIUS * self.unit, theme.EDGE, theme.EDGE_OPACITY, line=max(1.0, self.unit))
        return canvas
