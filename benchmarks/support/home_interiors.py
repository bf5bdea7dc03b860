"""Measure the drawn geometry of a generated home, its seats and its places for objects."""

import math
from typing import Any

import numpy as np

from mjsim.generator.values import HomePlan
from mjsim.house.compiled.house import CompiledHouse
from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.drawn import coplanar_faces, describe, overlaps

FOCUS = ("television", "stove")  # kinds of furniture that people look at from their seats
SOFT_SEATS = ("sofa", "corner_sofa", "armchair", "day_bed")
VIEW = (
    5.0,
    math.cos(math.radians(40)),
)  # maximum distance in metres, and minimum cosine of the angle to look ahead
LARGE, PLACES = 4, 24  # number of rooms from which on a home needs that many places for objects


def interior(house: CompiledHouse, plan: HomePlan) -> dict[str, Any]:
    """Return measurements of a home's interior as JSON-ready data."""
    compiled = Compiled.of("house", house.catalogue.house_path, house.model)
    deep, flush, points = overlaps(compiled), coplanar_faces(compiled), house.catalogue.points or 0
    return {
        "overlap_mm": 1000 * max((fault.amount for fault in deep), default=0.0),
        "overlaps": describe(compiled, deep, 1000, "mm deep") if deep else "",
        "flicker": describe(compiled, flush, 10_000, "cm2") if flush else "",
        "no_view": [r.key for r in plan.rooms if r.use == "living_room" and not _has_view(compiled, r.key)],
        "places": points,
        "few_places": points if len(plan.rooms) >= LARGE and points < PLACES else 0,
    }


def _has_view(compiled: Compiled, room: str) -> bool:
    """Return True if a seat of a room faces a television or a stove that is not far away."""
    model, data = compiled.model, compiled.data
    poses: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for body in range(model.nbody):
        owner, _, name = model.body(body).name.partition("/")
        if owner == room:
            pose = data.xpos[body, :2], data.xmat[body].reshape(3, 3)[:2, 1]
            poses.setdefault(name.rpartition("_")[0], []).append(pose)
    seats = [pose for kind in SOFT_SEATS for pose in poses.get(kind, ())]
    for at, _ in [pose for kind in FOCUS for pose in poses.get(kind, ())]:
        for seat, ahead in seats:
            away = float(np.linalg.norm(at - seat))
            if away < VIEW[0] and (at - seat) @ ahead > VIEW[1] * away:
                return True
    return False
