"""The page of a home without a run: the way of the fly-through film instead of a person's."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from experiments.house import House
from experiments.session.camera_path import camera_path
from experiments.web.viewing.page import run_page
from hud.state import HudState, InventorySlot
from mjsim.values.person_parameters import PersonParameters

INTERVAL = 0.2  # s between two poses, which the page mixes
NEAR = 0.05  # m from the place in a room where the tour looks around
INSIDE = (0.0, 0.0, 0.8) * 2  # m; hands have nothing to do, and are out of sight in the body
_HUD = HudState("", (), (), (None, InventorySlot()))


def tour_page(house: House, scene: Mapping[str, bytes], caption: str) -> str:
    """HTML of a page, without any other file, that shows a home: from outside, from above, and on a tour through it.

    Args:
        house: The home.
        scene: Its files, of `mjsim.formats.gltf`.
        caption: What is said of it.
    """
    return run_page(house.catalogue.label, _tour(house), scene, tour=caption)


def _tour(house: House) -> dict[str, Any]:
    """The tour as a run: `Run` of view/run.js."""
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
