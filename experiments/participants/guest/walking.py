"""How a person's walk differs from the shortest: lapses of attention, and going straight for a flagpole."""

from dataclasses import dataclass

import numpy as np

from experiments.house import House
from experiments.participants.base import Point
from experiments.participants.behaviour import chance, varies
from experiments.participants.distances import estimated_distances

SHORTEST_DETOUR = 0.5  # m; nobody goes out of the way for less


@dataclass(frozen=True)
class Walking:
    """Where a walk leaves the shortest path. The shapes of the distributions are starting values.

    Attributes:
        lapse_rate: Probability, at each walk to something, of going elsewhere first without noticing; not on a path
            that is shown.
        lapse_distance: How long the walk there is at most, m.
        pull: Probability, at each walk to a flagpole in another room, of first walking to where this room is nearest
            to it; also how much straight lines count in estimating how far away flagpoles are.
    """

    lapse_rate: float = chance({"beta": [0.5, 3.0]})
    lapse_distance: float = varies(5.0, 0.0, 50.0, "m")
    pull: float = chance({"beta": [2.0, 3.0]})


class Detours:
    """Finds the places at which a walk passes by before it reaches its goal.

    Args:
        walking: How a person walks.
        house: Where it walks.
        rng: Source of chance.
    """

    def __init__(self, walking: Walking, house: House, rng: np.random.Generator) -> None:
        self._walking, self._house, self._rng = walking, house, rng

    def stops(self, start: Point, goal: Point, *, pole: bool) -> list[Point]:
        """Places to pass on the way, m, shape (2,) each; usually none.

        Args:
            start: Where the person is, m, shape (2,).
            goal: Where it wants to go, m, shape (2,).
            pole: Whether a flagpole stands there that shows through walls.
        """
        lapse, pulled = self._rng.random(2).tolist()
        start, stops = self._house.navmesh.snap(start), []
        if lapse < self._walking.lapse_rate:
            stops += self._lapse(start)
        if pole and pulled < self._walking.pull:
            stops += self._towards(start, goal)
        return stops

    def _lapse(self, start: Point) -> list[Point]:
        """Any place of the house that is not too far, shape (2,); none where there is none."""
        places = np.concatenate(list(self._house.viewpoints.values()))
        walks = np.array(estimated_distances(self._house, start, list(places)))
        near = places[(walks > SHORTEST_DETOUR) & (walks <= self._walking.lapse_distance)]
        return [near[self._rng.integers(len(near))]] if len(near) else []

    def _towards(self, start: Point, goal: Point) -> list[Point]:
        """Where one comes nearest to what is behind a wall, (2,), without leaving the room; none in the same room."""
        room = self._house.rooms.room_at(start)
        if room == self._house.rooms.room_at(goal):
            return []
        places = self._house.viewpoints.get(room, start[None])
        gaps = np.linalg.norm(places - goal, axis=1)
        nearer = gaps.min() < np.linalg.norm(start - goal) - SHORTEST_DETOUR
        return [places[gaps.argmin()]] if nearer else []
