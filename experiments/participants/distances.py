"""Walking distances as a person estimates them."""

from collections.abc import Sequence

import numpy as np

from experiments.house import House
from experiments.participants.base import Point
from planner.errors import PlannerError

FAR = 1e6  # m


def estimated_distance(house: House, start: Point, goal: Point) -> float:
    """Walking distance, m, between two points (2,), m, as a person estimates it; `FAR` when there is no path."""
    try:
        return house.geodesics.shortest_path(start, goal).geodesic_distance
    except PlannerError:
        return FAR


def estimated_distances(house: House, start: Point, goals: Sequence[Point]) -> list[float]:
    """Walking distances, m, from one point to several, each m, shape (2,), as `estimated_distance`."""
    try:
        return [float(gap) for gap in house.geodesics.distances_from(start, np.array(goals))]
    except PlannerError:  # one of them cannot be reached
        return [estimated_distance(house, start, goal) for goal in goals]
