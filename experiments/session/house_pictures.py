"""Draw pictures of a tidy house: a floor plan with room names, and views of its rooms."""

import math
from collections.abc import Iterable
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from mjsim.house.compiled.house import compiled_house
from mjsim.render import CameraPose, Renderer, render_house_map
from mjsim.support.files import replacing
from mjsim.values.person_parameters import PersonParameters

SIZE = (960, 640)  # size of a picture in pixels
WIDE = (1200, 600)  # size of the picture of the largest room, in pixels
# Vertical field of view in radians, wider than a person's so that a corner view shows most of a room
FIELD = math.radians(62.0)
SCALE, MARGIN = 70.0, 0.4  # scale of the plan in pixels per metre, and the margin around it in metres
WEBP = (cv2.IMWRITE_WEBP_QUALITY, 85)
TEXT, LINE = 13, 16  # font size and line height on the plan, in pixels
TARGET_HEIGHT = 0.9  # height in metres of the point in the middle of a room that the camera looks at
PLACES = 3000  # number of sampled viewpoints
# Size in pixels and maximum depth in metres of the depth images that are used to rank views
SMALL, FAR = (96, 64), 4.0


def draw_house(house: House, folder: Path) -> list[Path]:
    """Write `floorplan.png` and `room_<key>.png` to an existing folder, and return their paths."""
    pictures = {"floorplan": floor_plan(house)}
    model, data = compiled_house(house.catalogue).model, compiled_house(house.catalogue).data
    views_of = room_views(house, house.viewpoints)
    with Renderer(model, width=SIZE[0], height=SIZE[1], profile="quality") as renderer:
        for key, views in views_of.items():
            pictures[f"room_{key}"] = renderer.rgb(data, views[0])
    paths = []
    for name, picture in pictures.items():
        path = folder / f"{name}.png"
        with replacing(path) as temporary:
            cv2.imwrite(str(temporary), picture[..., ::-1])
        paths.append(path)
    return paths


def draw_largest_room(house: House, path: Path) -> None:
    """Write a view of the largest room to a WebP file."""
    (room,) = largest_rooms(house, 1)
    view, compiled = room_views(house, [room])[room][0], compiled_house(house.catalogue)
    with Renderer(compiled.model, width=WIDE[0], height=WIDE[1], profile="quality") as renderer:
        picture = renderer.rgb(compiled.data, view)
    with replacing(path) as temporary:
        cv2.imwrite(str(temporary), picture[..., ::-1], WEBP)


def largest_rooms(house: House, count: int) -> list[str]:
    """Return the keys of the largest rooms in which a person has space to stand, largest first."""
    rooms, areas = house.rooms, dict.fromkeys(house.viewpoints, 0.0)
    for key, half in zip(rooms.keys, rooms.half_sizes, strict=True):
        if key in areas:
            areas[key] += float(half.prod())
    return sorted(areas, key=lambda key: -areas[key])[:count]


def floor_plan(house: House, within: tuple[int, int] | None = None) -> NDArray[np.uint8]:
    """Draw the house from above as an RGB image, with the names and areas of the rooms.

    The plan fits into `within`, a width and a height in pixels. If `within` is None, the scale is fixed.
    """
    x0, y0, x1, y1 = house.bounds
    bounds = x0 - MARGIN, y0 - MARGIN, x1 + MARGIN, y1 + MARGIN
    sides = bounds[2] - bounds[0], bounds[3] - bounds[1]
    scale = min(px / side for px, side in zip(within, sides, strict=True)) if within else SCALE
    plan = np.ascontiguousarray(render_house_map(house.catalogue, bounds, scale)[..., :3])
    scale = plan.shape[1] / (bounds[2] - bounds[0])
    rooms = house.rooms
    for key, label in rooms.labels.items():
        number = rooms.keys.index(key)
        area = 4 * float(rooms.half_sizes[number].prod())
        x, y = (rooms.centers[number] - bounds[::3]) * (scale, -scale)
        fits = _width(label) < 2 * scale * float(rooms.half_sizes[number, 0])
        lines = (*((label,) if fits else label.split()), f"{area:.1f} m²")
        _write_over(plan, lines, round(float(x)), round(float(y)))
    return plan


def _write_over(plan: NDArray[np.uint8], lines: tuple[str, ...], x: int, y: int) -> None:
    widths = [_width(text) for text in lines]
    half, top = max(widths) // 2 + 3, y - len(lines) * LINE // 2
    ground = plan[max(top, 0) : top + len(lines) * LINE + 4, max(x - half, 0) : x + half]
    ground[:] = ground // 4 + 191
    for line, (text, width) in enumerate(zip(lines, widths, strict=True)):
        at = x - width // 2, top + (line + 1) * LINE - 4
        cv2.putText(plan, text, at, (20, 20, 20), cv2.FontFace("sans"), TEXT, 500)


def _width(text: str) -> int:
    return int(cv2.getTextSize((0, 0), text, (0, 0), cv2.FontFace("sans"), TEXT, 500)[2])


def room_views(house: House, rooms: Iterable[str]) -> dict[str, list[CameraPose]]:
    """Return views from the corners of each room, starting with the least obstructed view."""
    compiled = compiled_house(house.catalogue)
    floor = house.sampling_floor.sample(np.random.default_rng(0), PLACES)
    nearest = house.rooms.distances(floor).argmin(axis=1)
    with Renderer(compiled.model, width=SMALL[0], height=SMALL[1], profile="draft") as renderer:

        def depth(view: CameraPose) -> float:
            return float(np.minimum(renderer.depth(compiled.data, view), FAR).mean())

        found = {}
        for room in rooms:
            number = house.rooms.keys.index(room)
            views = _corner_views(house, room, floor[nearest == number], house.rooms.centers[number])
            found[room] = sorted(views, key=depth, reverse=True)
    return found


def _corner_views(
    house: House, room: str, places: NDArray[np.float64], center: NDArray[np.float64]
) -> list[CameraPose]:
    offsets = places - center
    quarters = (offsets > 0) @ (1, 2)
    mine = [np.flatnonzero(quarters == quarter) for quarter in range(4)]
    corners = [places[rows[np.hypot(*offsets[rows].T).argmax()]] for rows in mine if len(rows)]
    views = []
    for place in corners or [house.viewpoints[room][0]]:
        target = center if np.hypot(*(place - center)) > 0.3 else place + np.array([1.0, 0.0])
        eye = np.array([*place, PersonParameters().eye_height])
        views.append(CameraPose.looking_at(eye, np.array([*target, TARGET_HEIGHT]), FIELD))
    return views
