"""The mini-map, which consists of a fixed base image and of marks that are drawn over it."""

import math
from dataclasses import dataclass
from typing import Literal

import cv2
import numpy as np

from hud import theme
from hud.canvas import Canvas, Patch, Rect
from hud.state import MiniMap, Vec2
from hud.stencils import Stencils
from hud.theme import Rgb

PICTURE_OPACITY = 0.8
PATH: Rgb = (213, 94, 0)
OBJECT: Rgb = (230, 159, 0)
GOAL: Rgb = (86, 180, 233)
HEADING_STEPS = 72  # number of directions of the person's arrow, 5 degrees apart

Kind = Literal["path", "object", "goal", "person"]
# Discs of each type of mark, as pairs of radius (theme pixels) and colour, with the largest disc first.
DISCS: dict[Kind, tuple[tuple[float, Rgb], ...]] = {
    "path": ((1.8, PATH),),
    "object": ((3.4, theme.PANEL), (2.5, OBJECT)),
    "goal": ((5.0, theme.PANEL), (4.0, GOAL), (1.6, theme.PANEL)),
    "person": (),
}
# Half the side length of each type of mark, in theme pixels.
HALF_SIZES: dict[Kind, float] = {"path": 2.0, "object": 4.0, "goal": 6.0, "person": 10.0}


@dataclass(frozen=True)
class Mark:
    """A mark on the map. `step` is its direction index, and (x, y) is its upper left corner in the frame."""

    kind: Kind
    step: int
    x: int
    y: int


def draw_base(
    stencils: Stencils, rect: Rect, picture_key: str, bounds: tuple[float, float, float, float]
) -> Patch:
    canvas = Canvas.panel(stencils, rect)
    area, _ = _map_area(bounds, rect, stencils.unit)
    picture = stencils.pictures.get(picture_key)
    if picture is not None:
        size = (area.width, area.height)
        scaled = cv2.resize(picture, size, interpolation=cv2.INTER_AREA).astype(np.float32)
        colours = 0.35 * scaled[..., :3] + 0.65 * scaled[..., :3].mean(axis=2, keepdims=True)
        opacity = scaled[..., 3] / np.float32(255.0) * np.float32(PICTURE_OPACITY)
        canvas.image(colours, opacity, area.x, area.y)
    return canvas.patch()


def marks(rect: Rect, minimap: MiniMap, unit: float) -> tuple[Mark, ...]:
    """Return the marks on a map in drawing order. All marks are inside `rect`."""
    area, scale = _map_area(minimap.bounds, rect, unit)
    step = round(minimap.heading / (2.0 * math.pi) * HEADING_STEPS) % HEADING_STEPS
    wanted: list[tuple[Kind, int, Vec2]] = [("path", 0, point) for point in minimap.path]
    wanted += [("object", 0, point) for point in minimap.objects]
    wanted += [] if minimap.goal is None else [("goal", 0, minimap.goal)]
    wanted.append(("person", step, minimap.position))
    placed = []
    for kind, direction, (east, north) in wanted:
        half = math.ceil(HALF_SIZES[kind] * unit)
        x = area.x + (east - minimap.bounds[0]) * scale
        y = area.y + (minimap.bounds[3] - north) * scale
        if min(rect.width, rect.height) > 2 * half:
            left = min(max(rect.x + round(x) - half, rect.x), rect.right - 2 * half - 1)
            top = min(max(rect.y + round(y) - half, rect.y), rect.bottom - 2 * half - 1)
            placed.append(Mark(kind, direction, left, top))
    return tuple(placed)


def draw_mark(stencils: Stencils, kind: Kind, step: int) -> Patch:
    """Draw a mark. `step` is its direction in steps of 5 degrees, counter-clockwise from the right."""
    half = math.ceil(HALF_SIZES[kind] * stencils.unit)
    canvas = Canvas(stencils, 2 * half + 1, 2 * half + 1)
    centre = half + 0.5
    for radius, colour in DISCS[kind]:
        canvas.circle(centre, centre, radius * stencils.unit, colour)
    if kind == "person":
        outline = ((7.0, 0.0), (-5.0, -5.0), (-2.5, 0.0), (-5.0, 5.0))
        for size, colour in ((1.35, theme.PANEL), (1.0, theme.ACCENT)):
            canvas.arrow(centre, 2.0 * math.pi * step / HEADING_STEPS, outline, stencils.unit * size, colour)
    return canvas.patch()


def _map_area(bounds: tuple[float, float, float, float], panel: Rect, unit: float) -> tuple[Rect, float]:
    xmin, ymin, xmax, ymax = bounds
    inset = round(theme.MAP_INSET * unit)
    room = Rect(inset, inset, max(1, panel.width - 2 * inset), max(1, panel.height - 2 * inset))
    scale = min(room.width / (xmax - xmin), room.height / (ymax - ymin))
    width, height = (max(1, round(scale * side)) for side in (xmax - xmin, ymax - ymin))
    left, top = room.x + (room.width - width) // 2, room.y + (room.height - height) // 2
    return Rect(left, top, width, height), scale
