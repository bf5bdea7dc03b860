"""Drawing of the mini-map: a base that never changes, and small stamps on it for what moves."""

import math
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from hud import theme
from hud.canvas import Patch, Rect
from hud.pen import Pen
from hud.rows import MAP_INSET
from hud.state import MiniMap, Vec2
from hud.theme import Rgb

PICTURE_OPACITY = 0.8
WAY: Rgb = (213, 94, 0)
THING: Rgb = (230, 159, 0)
GOAL: Rgb = (86, 180, 233)
HEADING_STEPS = 72  # drawn directions of the person, 5 degrees apart

Kind = Literal["way", "thing", "goal", "person"]
# Discs of a mark from the outside in: radius, px, and colour. A dark rim sets each off from the picture.
DISCS: dict[Kind, tuple[tuple[float, Rgb], ...]] = {
    "way": ((1.8, WAY),),
    "thing": ((3.4, theme.PANEL), (2.5, THING)),
    "goal": ((5.0, theme.PANEL), (4.0, GOAL), (1.6, theme.PANEL)),
    "person": (),
}
REACH: dict[Kind, float] = {"way": 2.0, "thing": 4.0, "goal": 6.0, "person": 10.0}


@dataclass(frozen=True)
class Mark:
    """A stamp on the map: what it shows, which direction it has, and its upper left corner in the frame, px."""

    kind: Kind
    step: int
    x: int
    y: int


def draw_base(pen: Pen, rect: Rect, picture_key: str, bounds: tuple[float, float, float, float]) -> Patch:
    """The panel with the house in it, greyer than life, so that what is drawn on top stands out for everybody."""
    canvas = pen.panel(rect)
    area = _Plan(bounds, rect, pen.unit).area
    picture = pen.stencils.pictures.get(picture_key)
    if picture is not None:
        size = (area.width, area.height)
        scaled = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        colours = 0.35 * scaled[..., :3] + 0.65 * scaled[..., :3].mean(axis=2, keepdims=True)
        opacity = scaled[..., 3] / np.float32(255.0) * np.float32(PICTURE_OPACITY)
        canvas.image(colours, opacity, area.x, area.y)
    return canvas.patch()


def marks(rect: Rect, minimap: MiniMap, unit: float) -> tuple[Mark, ...]:
    """What is drawn on the base in `rect`, from the bottom up; each lies inside it."""
    plan = _Plan(minimap.bounds, rect, unit)
    step = round(minimap.heading / (2.0 * math.pi) * HEADING_STEPS) % HEADING_STEPS
    goals = () if minimap.goal is None else (minimap.goal,)
    wanted: list[tuple[Kind, int, Vec2]] = [("way", 0, point) for point in minimap.way]
    wanted += [("thing", 0, point) for point in minimap.things]
    wanted += [("goal", 0, point) for point in goals]
    wanted.append(("person", step, minimap.position))
    placed = []
    for kind, direction, point in wanted:
        half = math.ceil(REACH[kind] * unit)
        x, y = plan.to_pixels(point)
        if min(rect.width, rect.height) > 2 * half:
            left = min(max(rect.x + round(x) - half, rect.x), rect.right - 2 * half - 1)
            top = min(max(rect.y + round(y) - half, rect.y), rect.bottom - 2 * half - 1)
            placed.append(Mark(kind, direction, left, top))
    return tuple(placed)


def draw_mark(pen: Pen, kind: Kind, step: int) -> Patch:
    """The stamp of a mark."""
    half = math.ceil(REACH[kind] * pen.unit)
    canvas = pen.canvas(2 * half + 1, 2 * half + 1)
    centre = half + 0.5
    for radius, colour in DISCS[kind]:
        canvas.circle(centre, centre, radius * pen.unit, colour)
    if kind == "person":
        angle = 2.0 * math.pi * step / HEADING_STEPS
        c, s = math.cos(angle), -math.sin(angle)
        outline = ((7.0, 0.0), (-5.0, -5.0), (-2.5, 0.0), (-5.0, 5.0))
        for size, colour in ((1.35, theme.PANEL), (1.0, theme.ACCENT)):
            u = pen.unit * size
            points = [(centre + u * (a * c - b * s), centre + u * (a * s + b * c)) for a, b in outline]
            canvas.shape(points, colour)
    return canvas.patch()


class _Plan:
    """Places the house in a panel: as large as fits, in the middle."""

    def __init__(self, bounds: tuple[float, float, float, float], panel: Rect, unit: float) -> None:
        xmin, ymin, xmax, ymax = bounds
        inset = round(MAP_INSET * unit)
        room = Rect(inset, inset, max(1, panel.width - 2 * inset), max(1, panel.height - 2 * inset))
        self._corner = xmin, ymax
        self._scale = min(room.width / (xmax - xmin), room.height / (ymax - ymin))
        width, height = (max(1, round(self._scale * side)) for side in (xmax - xmin, ymax - ymin))
        self.area = Rect(
            room.x + (room.width - width) // 2, room.y + (room.height - height) // 2, width, height
        )

    def to_pixels(self, point: Vec2) -> Vec2:
        """Px of the panel."""
        x = self.area.x + (point[0] - self._corner[0]) * self._scale
        return x, self.area.y + (self._corner[1] - point[1]) * self._scale
