"""Drawing of the mini-map."""

import math

import cv2
import numpy as np
from numpy.typing import NDArray

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.panels import Pen
from hud.rows import MAP_INSET
from hud.state import MiniMap, Vec2

PICTURE_OPACITY = 0.8
WAY = (213, 94, 0)
THING = (230, 159, 0)
GOAL = (86, 180, 233)


def draw_minimap(pen: Pen, rect: Rect, minimap: MiniMap) -> Patch:
    """The house, the way, what stands out, and the person as an arrowhead."""
    canvas = pen.panel(rect)
    inset = canvas.px(MAP_INSET)
    plan = _Plan(minimap.bounds, Rect(inset, inset, rect.width - 2 * inset, rect.height - 2 * inset))
    picture = pen.pictures.get(minimap.picture)
    if picture is not None:
        _lay_picture(canvas, picture, plan.area)
    u = pen.unit
    for x, y in map(plan.to_pixels, minimap.way):
        canvas.circle(x, y, 1.7 * u, WAY)
    for x, y in map(plan.to_pixels, minimap.things):
        canvas.circle(x, y, 3.4 * u, theme.PANEL)
        canvas.circle(x, y, 2.5 * u, THING)
    if minimap.goal is not None:
        x, y = plan.to_pixels(minimap.goal)
        canvas.circle(x, y, 5.0 * u, theme.PANEL)
        canvas.circle(x, y, 4.0 * u, GOAL)
        canvas.circle(x, y, 1.6 * u, theme.PANEL)
    _draw_person(canvas, plan.to_pixels(minimap.position), minimap.heading, u)
    return canvas.patch()


class _Plan:
    """Places the house in a rectangle: as large as fits, in the middle."""

    def __init__(self, bounds: tuple[float, float, float, float], room: Rect) -> None:
        xmin, ymin, xmax, ymax = bounds
        self._corner = xmin, ymax
        self._scale = min(room.width / (xmax - xmin), room.height / (ymax - ymin))
        width, height = round(self._scale * (xmax - xmin)), round(self._scale * (ymax - ymin))
        self.area = Rect(
            room.x + (room.width - width) // 2,
            room.y + (room.height - height) // 2,
            max(width, 1),
            max(height, 1),
        )

    def to_pixels(self, point: Vec2) -> Vec2:
        """Px of the canvas."""
        x = self.area.x + (point[0] - self._corner[0]) * self._scale
        return x, self.area.y + (self._corner[1] - point[1]) * self._scale


def _lay_picture(canvas: Canvas, picture: NDArray[np.uint8], area: Rect) -> None:
    scaled = cv2.resize(picture, (area.width, area.height), interpolation=cv2.INTER_AREA).astype(np.float32)
    # Greyer than life, so that what is drawn on top stands out for everybody.
    grey = scaled[..., :3].mean(axis=2, keepdims=True)
    colours = 0.35 * scaled[..., :3] + 0.65 * grey
    canvas.image(colours, scaled[..., 3] / np.float32(255.0) * np.float32(PICTURE_OPACITY), area.x, area.y)


def _draw_person(canvas: Canvas, at: Vec2, heading: float, unit: float) -> None:
    c, s = math.cos(heading), -math.sin(heading)
    for size, colour in ((1.35, theme.PANEL), (1.0, theme.ACCENT)):
        outline = ((7.0, 0.0), (-5.0, -5.0), (-2.5, 0.0), (-5.0, 5.0))
        u = unit * size
        canvas.shape([(at[0] + u * (a * c - b * s), at[1] + u * (a * s + b * c)) for a, b in outline], colour)
