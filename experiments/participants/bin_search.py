"""Search for bins that the person has not seen yet; the list in the HUD names their room."""

from collections.abc import Callable

import numpy as np

from experiments.house import House
from experiments.participants.base import NEARBY, Percept, Point
from experiments.participants.distances import estimated_distances
from experiments.participants.looking import FullTurn
from mjsim.values.actions import TIME_TOLERANCE, Action

ARRIVED = 0.5  # m from a viewpoint before the look around begins

WalkTo = Callable[[Percept, Point, float], Action]


class BinSearch:
    """The bins that the person knows, as `House.seen` says, and the search for the others."""

    def __init__(self, house: House) -> None:
        self._house = house
        known = house.receptacles if house.seen is None else house.seen
        self._unknown = {key: found for key, found in house.receptacles.items() if key not in known}
        self._next_look = 0.0
        self._key: str | None = None
        self._left: list[Point] = []
        self._target: Point | None = None
        self._turn: FullTurn | None = None

    def knows(self, key: str) -> bool:
        """Whether the person knows where a bin is."""
        return key not in self._unknown

    def look(self, percept: Percept) -> None:
        """Notice the bins in view, and those at the feet."""
        if not self._unknown or percept.time < self._next_look - TIME_TOLERANCE:
            return
        self._next_look = percept.time + percept.person.looking_interval
        for key in percept.look_for(self._unknown) | self._nearby(percept):
            del self._unknown[key]

    def until(self, time: float | None) -> float | None:
        """The earlier one of a time and of the next look, s; None if there is neither."""
        if not self._unknown:
            return time
        return self._next_look if time is None else min(time, self._next_look)

    def likely_place(self, position: Point, key: str) -> Point:
        """Start of the search for a bin: the nearest viewpoint of its room, m, shape (2,)."""
        points = self._viewpoints(key)
        return points[self._nearest(position, points)]

    def act(self, percept: Percept, key: str, walk_to: WalkTo) -> Action:
        """Go to the viewpoints of the bin's room, the nearest first, and look around at each."""
        if key != self._key:
            self._key, self._left, self._target, self._turn = key, [], None, None
        if self._turn is not None:
            turning = self._turn.act(percept)
            if turning is not None:
                return turning
            self._turn = None
            self._target = None
        if self._target is None:
            self._target = self._next_viewpoint(percept.position, key)
        if float(np.linalg.norm(self._target - percept.position)) > ARRIVED:
            return walk_to(percept, self._target, ARRIVED)
        self._turn = FullTurn(percept.heading)
        return self.act(percept, key, walk_to)

    def _next_viewpoint(self, position: Point, key: str) -> Point:
        """The nearest viewpoint that was not searched; once all were, next to the bin."""
        if not self._left:
            self._left = self._viewpoints(key)
        return self._left.pop(self._nearest(position, self._left))

    def _viewpoints(self, key: str) -> list[Point]:
        """Viewpoints of a bin's room, m, each (2,), and last the place next to it, where nothing hides it."""
        room = self._house.catalogue.receptacles[key].room
        return [*self._house.viewpoints.get(room, ()), self._house.approaches[key]]

    def _nearest(self, position: Point, points: list[Point]) -> int:
        """Number of the nearest place; the last one only where there is no other."""
        candidates = points[:-1] or points
        return int(np.argmin(estimated_distances(self._house, position, candidates)))

    def _nearby(self, percept: Percept) -> set[str]:
        house, here = self._house, self._house.rooms.room_at(percept.position)
        return {
            key
            for key, found in self._unknown.items()
            if house.catalogue.receptacles[key].room == here and found.distance(percept.position) < NEARBY
        }
