"""Departures of a person's walk from the shortest one: lapses of attention, and detours towards a flagpole."""

from dataclasses import dataclass

import numpy as np

from experiments.house import House
from experiments.participants.base import Point
from experiments.participants.behaviour import chance, varies
from experiments.participants.distances import estimated_distances

MIN_DETOUR = 0.5  # m


@dataclass(frozen=True)
class Walking:
    """Where a walk leaves the shortest path. The shapes of the distributions are starting values."""

    # probability, at each walk but on a shown path, of first going elsewhere without noticing
    lapse_rate: float = chance({"beta": [0.5, 3.0]})
    lapse_distance: float = varies(5.0, 0.0, 50.0, "m")  # longest walk there, m
    # probability, at each walk to a flagpole in another room, of first walking to the place of this room
    # that is nearest to it; also the weight of straight lines in estimated distances of flagpoles
    pull: float = chance({"beta": [2.0, 3.0]})


class Detours:
    """Finds the places that a walk passes before its goal."""

    def __init__(self, walking: Walking, house: House, rng: np.random.Generator) -> None:
        self._walking, self._house, self._rng = walking, house, rng

    def stops(self, start: Point, goal: Point, *, pole: bool) -> list[Point]:
        """Places to pass on the way, m, shape (2,) each; usually none. A `pole` at the goal shows through walls."""
        lapse, pulled = self._rng.random(2).tolist()
        start, stops = self._house.navmesh.snap(start), []
        if lapse < self._walking.lapse_rate:
            stops += self._lapse(start)
        if pole and pulled < self._walking.pull:
            stops += self._towards(start, goal)
        return stops

    def _lapse(self, start: Point) -> list[Point]:
        """A random place of the house that is not too far, shape (2,), if there is one."""
        places = np.concatenate(list(self._house.viewpoints.values()))
        walks = np.array(estimated_distances(self._house, start, list(places)))
        near = places[(walks > MIN_DETOUR) & (walks <= self._walking.lapse_distance)]
        return [near[self._rng.integers(len(near))]] if len(near) else []

    def _towards(self, start: Point, goal: Point) -> list[Point]:
        """The place of this room, (2,), that is nearest to a goal in another room; none for one in the same room."""
        room = self._house.rooms.room_at(start)
        if room == self._house.rooms.room_at(goal):
            return []
        places = self._house.viewpoints.get(room, start[None])
        gaps = np.linalg.norm(places - goal, axis=1)
        nearer = gaps.min() < np.linalg.norm(start - goal) - MIN_DETOUR
        return [places[gaps.argmin()]] if nearer else []
