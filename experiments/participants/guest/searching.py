"""Where a person still has to look: places of the house from which a room can be seen."""

from dataclasses import dataclass

import numpy as np

from experiments.house import House
from experiments.participants.base import Point
from experiments.participants.distances import estimated_distances

SHIFT = 0.15  # m; at each round, places are a little elsewhere, so that what was hidden once is seen later


@dataclass(frozen=True, eq=False)
class Place:
    """A place to look around from.

    Attributes:
        room: Key of its room.
        point: m, shape (2,).
    """

    room: str
    point: Point


class Frontier:
    """Places that have not been searched. When all have been, all are searched again.

    Args:
        house: The house.
        rng: Source of chance.
    """

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house, self._rng = house, rng
        self._left: list[Place] = []

    def places(self) -> list[Place]:
        """Places to look around from, at least one."""
        if not self._left:
            self._left = [
                Place(room, self._house.navmesh.snap(point + self._rng.normal(0.0, SHIFT, size=2)))
                for room, points in self._house.viewpoints.items()
                for point in points
            ]
        return self._left

    def of_room(self, room: str, position: Point) -> Place:
        """The place of a room that is nearest to a position, m, shape (2,)."""
        points = self._house.viewpoints.get(room)
        if points is None:  # a room without any floor to stand on
            return Place(room, position)
        gaps = estimated_distances(self._house, position, list(points))
        return Place(room, points[int(np.argmin(gaps))])

    def mark_searched(self, place: Place) -> None:
        """A place need not be looked at again."""
        self._left = [other for other in self._left if other is not place]
