"""Pictures of a tidy house: a plan with the names of its rooms, and each room from a corner of it."""

import math
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from mjsim.files import replacing
from mjsim.model.house import compiled_house
from mjsim.person_parameters import PersonParameters
from mjsim.render import CameraPose, Renderer, render_house_map

SIZE = (960, 640)  # px
FIELD = math.radians(62.0)  # vertical; corners need a wider one than people have
SCALE, MARGIN = 70.0, 0.4  # px/m of the plan; m around it
LOOKED_AT = 0.9  # m above the middle of a room
PLACES = 3000


def draw_house(house: House, folder: Path) -> list[Path]:
    """Write `floorplan.png` and `room_<key>.png` into an existing folder; their paths.

    Raises:
        RenderError: Nothing can be drawn on this machine.
    """
    pictures = {"floorplan": floor_plan(house)}
    model, data = compiled_house(house.catalogue).model, compiled_house(house.catalogue).data
    with Renderer(model, width=SIZE[0], height=SIZE[1], profile="quality") as renderer:
        for key in house.viewpoints:
            pictures[f"room_{key}"] = renderer.rgb(data, corner_view(house, key))
    paths = []
    for name, picture in pictures.items():
        path = folder / f"{name}.png"
        with replacing(path) as temporary:
            cv2.imwrite(str(temporary), picture[..., ::-1])
        paths.append(path)
    return paths


def floor_plan(house: House) -> NDArray[np.uint8]:
    """The house from above, with names and areas of the rooms, RGB."""
    x0, y0, x1, y1 = house.bounds
    bounds = x0 - MARGIN, y0 - MARGIN, x1 + MARGIN, y1 + MARGIN
    plan = np.ascontiguousarray(render_house_map(house.catalogue, bounds, SCALE)[..., :3])
    scale = plan.shape[1] / (bounds[2] - bounds[0])
    rooms = house.rooms
    for key, label in rooms.labels.items():
        number = rooms.keys.index(key)
        area = 4 * float(rooms.half_sizes[number].prod())
        x, y = (rooms.centers[number] - bounds[::3]) * (scale, -scale)
        for line, text in enumerate((label, f"{area:.1f} m2")):
            width, height = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, 0.5, 1)[0]
            at = round(x - width / 2), round(y + line * (height + 8))
            for colour, thickness in (((255, 255, 255), 4), ((20, 20, 20), 1)):
                cv2.putText(plan, text, at, cv2.FONT_HERSHEY_SIMPLEX, 0.5, colour, thickness, cv2.LINE_AA)
    return plan


def corner_view(house: House, room: str) -> CameraPose:
    """A view over a room from where one can stand, as far from its middle as that is."""
    floor = house.sampling_floor.sample(np.random.default_rng(0), PLACES)
    distances = house.rooms.distances(floor)
    number = house.rooms.keys.index(room)
    center = house.rooms.centers[number]
    places = floor[distances.argmin(axis=1) == number]
    place = places[np.hypot(*(places - center).T).argmax()] if len(places) else house.viewpoints[room][0]
    # A room that is seen from its middle is seen towards its longer side.
    target = center if np.hypot(*(place - center)) > 0.3 else place + np.array([1.0, 0.0])
    eye = np.array([*place, PersonParameters().eye_height])
    return CameraPose.looking_at(eye, np.array([*target, LOOKED_AT]), FIELD)
