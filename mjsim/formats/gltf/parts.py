"""Dividing what never moves into parts: large enough for few draw calls, small enough to be culled and quantised."""

import math
from collections import Counter
from collections.abc import Iterator, Sequence

import numpy as np

from mjsim.formats.gltf.glb import Look
from mjsim.formats.gltf.surfaces import Surface
from mjsim.house.compiled.sites import RoomMap

_HEAVY = 50_000  # triangles of a look from which it is worth a draw call in every room
_CELL = 16.0  # m; its positions are quantised to 0.25 mm


def divided(surfaces: Sequence[Surface], rooms: RoomMap) -> Iterator[tuple[Surface, str]]:
    """Surfaces with the name of the part that each belongs to.

    That is its room where the look has many triangles, else a square of the floor, the smallest that is as wide as the
    surface: beside much larger things, small ones would be placed less exactly.
    """
    x_min, y_min, x_max, y_max = rooms.bounds
    centre = np.array([x_min + x_max, y_min + y_max]) / 2
    triangles = Counter[tuple[Look, bool]]()
    for surface in surfaces:
        triangles[Look.of(surface), surface.is_ceiling] += len(surface.triangles)
    for surface in surfaces:
        low, high = surface.positions.min(axis=0), surface.positions.max(axis=0)
        middle, level = (low + high) / 2, max(0, math.ceil(math.log2((high - low).max() / _CELL)))
        if triangles[Look.of(surface), surface.is_ceiling] > _HEAVY and not level:
            yield surface, rooms.room_at(middle)
        else:
            i, j = np.rint((middle[:2] - centre) / (_CELL * 2**level)).astype(int)
            yield surface, f"square_{level}_{i}_{j}"
