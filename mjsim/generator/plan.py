"""Compute floor plans of rectangular rooms with a constraint solver.

The rooms fill a rectangular or L-shaped outline. The solver has no objective, so it accepts any layout close
to the target areas, and variety comes from the programme. It uses one worker, a fixed seed and a
deterministic time limit, so that every process finds the same layout.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from ortools.sat.python import cp_model

from mjsim.generator.programme import NEEDS, Programme, draw_programme, use_of
from mjsim.generator.values import WALL, Rectangle, Room
from mjsim.house.catalogue.generated_names import stream
from mjsim.values.errors import HouseError

GRID = 0.2  # cell size of the floor plan grid, in metres
TRIES = 500  # maximum number of room programmes that are tried
EFFORT = 0.025  # work limit of the solver for one room programme, in its deterministic time unit
SLACK, LARGE_SLACK = 0.25, 0.45  # relative tolerance of room areas in small and in large homes
LARGE = 9  # minimum number of rooms in a large home
VOID = 1.2  # minimum side length of the cut-out corner in an L-shaped outline, in metres


@dataclass(frozen=True)
class _Box:
    low: tuple[Any, Any]
    high: tuple[Any, Any]
    size: tuple[Any, Any]


def draw_rooms(seed: int, rooms: int, attempt: int = 0) -> tuple[Programme, tuple[Room, ...]]:
    """Draw room requirements from a seed, and find a floor plan. Each `attempt` gives a different plan.

    Raises:
        HouseError: No layout was found, or the number of rooms is out of range.
    """
    for number in range(TRIES):
        rng = stream(seed, "plan", str(rooms), str(attempt), str(number))
        programme = draw_programme(rooms, rng)
        if found := _solve(programme, rng):
            made = [Room(key, use_of(key), NEEDS[key].label, floor) for key, floor in found.items()]
            return programme, tuple(made)
    raise HouseError(f"no floor plan of {rooms} rooms was found for seed {seed}; use another seed")


def _solve(programme: Programme, rng: np.random.Generator) -> Mapping[str, Rectangle] | None:
    total = sum((math.sqrt(a) + WALL) ** 2 for a in programme.areas.values())
    ratio = rng.uniform(1.0, 1.7)
    is_angular = rng.random() < (0.5 if len(programme.areas) < LARGE else 0.85) and len(programme.areas) > 1
    lacks = rng.uniform(0.06, 0.16) if is_angular else 0.0
    width = round(math.sqrt(total / (1 - lacks) * ratio) / GRID)
    depth = round(total / (1 - lacks) / (width * GRID) / GRID)
    if rng.random() < 0.5:
        width, depth = depth, width
    model = cp_model.CpModel()
    slack = SLACK if len(programme.areas) < LARGE else LARGE_SLACK
    boxes = {}
    for key, area in programme.areas.items():
        limits = area * (1 - slack), area * (1 + slack)
        boxes[key] = _add_room(model, key, limits, (width, depth), key == programme.hub)
    covered = list(boxes.values())
    if is_angular:
        covered.append(_add_void(model, rng, (width, depth)))
    areas = []
    for box in covered:
        area = model.new_int_var(0, width * depth, "")
        model.add_multiplication_equality(area, box.size)
        areas.append(area)
    model.add(sum(areas) == width * depth)
    intervals = [
        [model.new_interval_var(box.low[axis], box.size[axis], box.high[axis], "") for box in covered]
        for axis in (0, 1)
    ]
    model.add_no_overlap_2d(*intervals)
    for way in programme.ways:
        _add_shared_wall(model, boxes[way.a], boxes[way.b], math.ceil(way.wall / GRID))
    solver = cp_model.CpSolver()
    solver.parameters.num_workers = 1
    solver.parameters.random_seed = int(rng.integers(2**31))
    solver.parameters.max_deterministic_time = EFFORT
    if solver.solve(model) not in (cp_model.OPTIMAL, cp_model.FEASIBLE):
        return None
    return {key: _floor([solver.value(v) for v in (*box.low, *box.high)]) for key, box in boxes.items()}


def _floor(cells: list[int]) -> Rectangle:
    x0, y0, x1, y1 = (round(value * GRID, 3) for value in cells)
    half = WALL / 2
    return Rectangle(*(round(v, 3) for v in (x0 + half, y0 + half, x1 - half, y1 - half)))


def _add_box(model: Any, least: int, outline: tuple[int, int]) -> _Box:
    low = tuple(model.new_int_var(0, extent, "") for extent in outline)
    high = tuple(model.new_int_var(0, extent, "") for extent in outline)
    size = tuple(model.new_int_var(min(least, extent), extent, "") for extent in outline)
    for axis in (0, 1):
        model.add(low[axis] + size[axis] == high[axis])
    return _Box(low, high, size)


def _add_room(
    model: Any, key: str, area: tuple[float, float], outline: tuple[int, int], is_outside: bool
) -> _Box:
    needs = NEEDS[key]
    box = _add_box(model, math.ceil((needs.side + WALL) / GRID - 1e-9), outline)
    w, h = box.size
    gross = model.new_int_var(0, outline[0] * outline[1], "")
    model.add_multiplication_equality(gross, (w, h))
    # Floor area between the walls, in hundredths of a grid cell.
    floor = 100 * gross - round(100 * WALL / GRID) * (w + h) + round(100 * (WALL / GRID) ** 2)
    cell = 100 / GRID**2
    model.add(floor >= math.ceil(cell * max(needs.area[0], area[0])))
    model.add(floor <= math.floor(cell * min(needs.area[1], area[1])))
    model.add(10 * w <= round(10 * needs.aspect) * h)
    model.add(10 * h <= round(10 * needs.aspect) * w)
    if needs.daylight or is_outside:
        outside = [model.new_bool_var("") for _ in range(4)]
        for axis in (0, 1):
            model.add(box.low[axis] == 0).only_enforce_if(outside[2 * axis])
            model.add(box.high[axis] == outline[axis]).only_enforce_if(outside[2 * axis + 1])
        model.add_bool_or(outside)
    return box


def _add_void(model: Any, rng: np.random.Generator, outline: tuple[int, int]) -> _Box:
    box = _add_box(model, round(VOID / GRID), outline)
    for axis, at_end in enumerate(rng.random(2) < 0.5):
        if at_end:
            model.add(box.high[axis] == outline[axis])
        else:
            model.add(box.low[axis] == 0)
        model.add(3 * box.size[axis] <= 2 * outline[axis])
    return box


def _add_shared_wall(model: Any, a: _Box, b: _Box, least: int) -> None:
    choices = []
    for one, other in ((a, b), (b, a)):
        for axis in (0, 1):
            chosen, across = model.new_bool_var(""), 1 - axis
            model.add(one.high[axis] == other.low[axis]).only_enforce_if(chosen)
            for p, q in ((one, other), (other, one)):
                model.add(p.low[across] + least <= q.high[across]).only_enforce_if(chosen)
            choices.append(chosen)
    model.add_bool_or(choices)
