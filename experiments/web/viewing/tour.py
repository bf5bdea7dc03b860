"""The page of a home without a run, which replays the camera path of the fly-through."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.house import House
from experiments.session.camera_path import camera_path
from experiments.web.viewing.page import run_page
from hud.state import HudState, InventorySlot
from mjsim.values.person_parameters import PersonParameters

INTERVAL = 0.2  # time between two poses, which the page interpolates, in seconds
NEAR = 0.05  # distance at which a viewpoint is reached, in metres
INSIDE = (0.0, 0.0, 0.8) * 2  # positions of the idle hands in metres, hidden in the body
_HUD = HudState("", (), (), (None, InventorySlot()))


def tour_page(house: House, scene: Mapping[str, bytes], caption: str) -> str:
    """Return the HTML of a self-contained page that shows a home from outside, from above, and on a tour.

    Args:
        house: The home.
        scene: Its files, by `mjsim.formats.gltf`.
        caption: Caption of the page.
    """
    return run_page(house.catalogue.label, _tour(house), scene, tour=caption)


def _tour(house: House) -> dict[str, Any]:
    """Return the tour as a `Run` of view/run.js."""
    path, person = camera_path(house), PersonParameters()
    times = np.arange(0.0, path.duration, INTERVAL)
    rows = path.at(times)
    body = np.column_stack([rows.positions[:, :2], rows.headings, rows.pitches])
    moments = []
    for key, places in house.viewpoints.items():
        gaps = np.linalg.norm(rows.positions[:, :2] - places[0], axis=1)
        reached = times[np.flatnonzero(gaps < gaps.min() + NEAR)[0]]
        moments.append({"t": round(float(reached), 1), "kind": "room", "text": house.rooms.label(key)})
    return {
        "title": house.catalogue.label,
        "person": {
            "eye_height": person.eye_height,
            "eye_forward": 0.0,
            "body_radius": person.body_radius,
            "field_of_view": person.field_of_view,
        },
        "bounds": house.bounds,
        "models": {},
        "labels": {},
        "time": times.round(1).tolist(),
        "body": body.round(3).ravel().tolist(),
        "hands": INSIDE * len(times),
        "objects": {},
        "hud": [(0, _HUD)],
        "markers": [],
        "shown": [(0, [])],
        "moments": sorted(moments, key=lambda moment: moment["t"]),
        "plans": [],
        "pictures": {},
    }
