"""Draw a floor plan of a trial with rooms, objects, receptacles, the planned path and the walked path."""

import contextlib
import functools
import math
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.record.records import Event
from hud.text import Typeface
from hud.texts import HudTexts, filled
from hud.theme import Face
from mjsim.support.files import replacing, source_digest
from mjsim.support.kernels import cache_base
from mjsim.values.episode import Episode
from mjsim.values.observation import Observation

# The Okabe-Ito palette, whose colours can be distinguished with common forms of colour blindness
CATEGORY_COLOURS = ("#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#CC79A7")
PLANNED, WALKED = "#D55E00", "#1B1B1B"
ORIGIN, LABEL, BLACK, WHITE = "#B00020", "#333333", "#000000", "#FFFFFF"
PIXELS_PER_METRE = 90  # maximum scale of the picture, which is reduced for large houses
MAX_SIDE = 1920  # maximum length of the picture's longer side, in pixels
# Width of the frame around the house, and row height and column width of the legend, in pixels
MARGIN, ROW, COLUMN = 28, 24, 240
DASH, PERIOD = 8, 15  # length and period of dashes, in pixels
_SAMPLE = np.array([[-18.0, 0.0], [18.0, 0.0]])  # ends of the sample line in the legend, in pixels
_SHIFT = 4  # number of fractional bits in OpenCV coordinates

_Points = NDArray[np.float64]


def draw_topdown(
    path: Path, house: House, episode: Episode, plan: Event, walked: _Points, origin: str
) -> None:
    """Write a PNG image of the house with the first planned path and the walked path.

    Args:
        path: PNG file to write.
        house: The house.
        episode: The episode.
        plan: The first `plan` event of the log.
        walked: Positions of the person in metres, shape (T, 2).
        origin: Origin of the run, such as `Simulated`.
    """
    planned = planned_path(house, episode, plan)
    lines = {
        _with_length(house.texts.path_planned, planned, house.texts): (planned, PLANNED),
        _with_length(house.texts.path_walked, walked, house.texts): (walked, WALKED),
    }
    drawing = _drawn_task(house, episode, lines, walked[0])
    drawing.text(origin, np.array([drawing.width - MARGIN - 30.0, MARGIN / 2]), Face(12, 500), ORIGIN)
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(drawing.image, cv2.COLOR_RGB2BGR))


def task_picture(
    house: House, episode: Episode, title: str, planned: _Points | None = None
) -> NDArray[np.uint8]:
    """Draw a house at the start of a task as an RGB image, shape (height, width, 3).

    A planned path in metres, shape (k, 2), is drawn if it is given.
    """
    lines = {} if planned is None else {f"shortest way, {_length(planned):.1f} m": (planned, PLANNED)}
    drawing = _drawn_task(house, episode, lines, np.array([episode.start.x, episode.start.y]))
    drawing.text(title, np.array([drawing.width / 2, MARGIN / 2]), Face(17, 700), BLACK)
    return drawing.image


def _drawn_task(
    house: House, episode: Episode, lines: Mapping[str, tuple[_Points, str]], start: _Points
) -> "_Drawing":
    drawing = _Drawing(house)
    for points, colour in lines.values():
        drawing.line(points, colour, dashed=colour == PLANNED)
    drawing.star(drawing.pixels(start)[0])
    kinds = list(zip(CATEGORY_COLOURS, house.catalogue.categories.values(), strict=False))
    for colour, category in kinds:
        for placed in (o for o in episode.objects if o.category == category.key):
            drawing.dot(drawing.pixels(np.array(placed.position))[0], colour)
        drawing.square(drawing.pixels(house.receptacles[category.receptacle].center)[0], colour)
    for key, label in house.rooms.labels.items():
        centre = house.rooms.centers[house.rooms.keys.index(key)]
        drawing.text(label, drawing.pixels(centre)[0], Face(17, 700), LABEL, halo=True)
    present = {o.category for o in episode.objects}
    drawing.legend(
        {label: colour for label, (_, colour) in lines.items()},
        house.texts.path_start,
        [(colour, category.label) for colour, category in kinds if category.key in present],
    )
    return drawing


def planned_path(house: House, episode: Episode, plan: Event, seen: Observation | None = None) -> _Points:
    """Return the planned path of a `plan` event in metres, shape (k, 2).

    The path begins at the person's position in `seen`, or at the start of the task if `seen` is None.
    """
    if seen is None:
        places = {o.name: np.array(o.position[:2]) for o in episode.objects}
        here = np.array([episode.start.x, episode.start.y])
    else:
        places = dict(zip(seen.object_names, seen.object_positions[:, :2], strict=True))
        here = seen.position
    here = house.navmesh.snap(here)
    points = [here[None]]
    for kind, name in plan["visits"]:
        target = places[name] if kind == "pick" else house.receptacles[episode.targets[name]].approach
        there = house.navmesh.snap(target)
        points.append(house.geodesics.shortest_path(here, there).points)
        here = there
    return np.vstack(points)


class _Drawing:
    def __init__(self, house: House) -> None:
        x_min, y_min, x_max, y_max = house.bounds
        self._corner = np.array([x_min, y_max])
        self._scale = min(PIXELS_PER_METRE, MAX_SIDE / max(x_max - x_min, y_max - y_min))
        self._type = Typeface(1.0)
        picture = house_picture(house, self._scale)
        self._bottom = MARGIN + len(picture)
        size = self._bottom + 4 * ROW, max(picture.shape[1] + 2 * MARGIN, 3 * COLUMN)
        self.image = np.full((*size, 3), 255, np.uint8)
        self.image[MARGIN : self._bottom, MARGIN : MARGIN + picture.shape[1]] = picture

    @property
    def width(self) -> int:
        return int(self.image.shape[1])

    def pixels(self, points: _Points) -> _Points:
        scale = np.array([self._scale, -self._scale])
        return np.asarray((np.atleast_2d(points)[:, :2] - self._corner) * scale + MARGIN)

    def line(self, points: _Points, colour: str, *, dashed: bool = False) -> None:
        path = self.pixels(points)
        parts = list(_dashes(path)) if dashed else [path]
        for tone, thickness in ((WHITE, 5), (colour, 2)):
            self._strokes(parts, tone, thickness)

    def dot(self, centre: _Points, colour: str) -> None:
        turn = np.linspace(0.0, math.tau, 32, endpoint=False)
        self._shape(centre + 8 * np.column_stack([np.cos(turn), np.sin(turn)]), colour)

    def square(self, centre: _Points, colour: str) -> None:
        self._shape(centre + 9 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]), colour)

    def star(self, centre: _Points) -> None:
        turn = np.arange(10) * math.pi / 5
        radius = np.where(np.arange(10) % 2, 5.0, 12.0)
        self._shape(centre + np.column_stack([radius * np.sin(turn), -radius * np.cos(turn)]), WHITE)

    def text(self, text: str, middle: _Points, face: Face, colour: str, *, halo: bool = False) -> None:
        mask, baseline = self._type.rasterise(text, face)
        width, top = self._type.width(text, face), middle[1] - baseline + face.size / 3
        left = min(middle[0] - width / 2, self.width - width - 4)
        if halo:
            self._cover(cv2.dilate(mask, np.ones((5, 5), np.uint8)), left, top, WHITE)
        self._cover(mask, left, top, colour)

    def legend(self, lines: Mapping[str, str], start: str, categories: Sequence[tuple[str, str]]) -> None:
        draws: list[tuple[Callable[[_Points], None], str]] = [
            *((functools.partial(self._sample, colour=colour), label) for label, colour in lines.items()),
            (self.star, start),
            *((functools.partial(self.dot, colour=tone), label) for tone, label in categories),
        ]
        for number, (draw, label) in enumerate(draws):
            column, row = divmod(number, 3)
            at = np.array([MARGIN + 20.0 + column * COLUMN, self._bottom + ROW * (row + 0.8)])
            draw(at)
            mask, baseline = self._type.rasterise(label, Face(14, 400))
            self._cover(mask, at[0] + 28, at[1] - baseline + 5, BLACK)

    def _sample(self, at: _Points, colour: str) -> None:
        way = at + _SAMPLE
        self._strokes(_dashes(way) if colour == PLANNED else [way], colour, 2)

    def _strokes(self, parts: Sequence[_Points], colour: str, thickness: int) -> None:
        cv2.polylines(self.image, _fixed(parts), False, _rgb(colour), thickness, cv2.LINE_AA, _SHIFT)

    def _shape(self, corners: _Points, colour: str) -> None:
        cv2.fillPoly(self.image, _fixed([corners]), _rgb(colour), cv2.LINE_AA, _SHIFT)
        cv2.polylines(self.image, _fixed([corners]), True, _rgb(BLACK), 1, cv2.LINE_AA, _SHIFT)

    def _cover(self, mask: NDArray[np.uint8], left: float, top: float, colour: str) -> None:
        x, y = max(0, round(left)), max(0, round(top))
        under = self.image[y : y + len(mask), x : x + mask.shape[1]]
        share = mask[: under.shape[0], : under.shape[1], None] / 255.0
        under[:] = np.rint(under + share * (np.array(_rgb(colour)) - under)).astype(np.uint8)


def house_picture(house: House, scale: float) -> NDArray[np.uint8]:
    """Return an RGB image of the tidy house from above. The image is cached on disk."""
    name = f"{house.catalogue.content}-{scale:g}.png"
    kept = cache_base() / f"mjsim-floorplans-{source_digest('mjsim')}" / name
    if (picture := cv2.imread(str(kept)) if kept.is_file() else None) is not None:
        return cv2.cvtColor(picture, cv2.COLOR_BGR2RGB)  # type: ignore[no-any-return]
    from mjsim.render import render_house_map  # imported late because OpenGL loads slowly

    drawn = render_house_map(house.catalogue, house.bounds, scale)[..., :3]
    with contextlib.suppress(OSError), replacing(kept) as temporary:
        cv2.imwrite(str(temporary), cv2.cvtColor(drawn, cv2.COLOR_RGB2BGR))
        os.utime(kept.parent)  # marks the cache as recently used
    return drawn


def _dashes(path: _Points) -> list[_Points]:
    along = np.concatenate([[0.0], np.linalg.norm(np.diff(path, axis=0), axis=1).cumsum()])
    steps = np.arange(0.0, along[-1])
    points = np.column_stack([np.interp(steps, along, path[:, k]) for k in range(2)])
    return [points[k : k + DASH] for k in range(0, len(points), PERIOD)]


def _fixed(parts: Sequence[_Points]) -> list[NDArray[np.int32]]:
    return [np.rint(part * (1 << _SHIFT)).astype(np.int32) for part in parts]


def _rgb(colour: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(colour[1:])
    return red, green, blue


def _with_length(text: str, points: _Points, texts: HudTexts) -> str:
    return filled(text, metres=f"{_length(points):.1f}".replace(".", texts.decimal))


def _length(points: NDArray[Any]) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
