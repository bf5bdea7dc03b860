"""Keep track of the viewpoints from which a participant has not searched the rooms yet."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Percept, Point, estimated_distances

SHIFT = 0.15  # standard deviation of random shifts of viewpoints, which reveal hidden objects, in metres


@dataclass(frozen=True, eq=False)
class SearchPlace:
    """A viewpoint from which a room is searched."""

    room: str  # room key
    point: Point  # floor position in metres, shape (2,)


class Frontier:
    """The viewpoints from which a participant has not searched yet.

    When no viewpoints are left, a new round begins, in which the participant looks more closely.
    """

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house, self._rng = house, rng
        self._left, self._round = self._all(), 1

    def places(self) -> list[SearchPlace]:
        """Return the remaining viewpoints. There is always at least one."""
        if not self._left:
            self._left, self._round = self._all(), self._round + 1
        return self._left

    def _all(self) -> list[SearchPlace]:
        return [
            SearchPlace(room, self._house.navmesh.snap(point + self._rng.normal(0.0, SHIFT, size=2)))
            for room, points in self._house.viewpoints.items()
            for point in points
        ]

    def of_room(self, room: str, position: Point) -> SearchPlace:
        """Return the viewpoint of a room that is nearest to a position."""
        points = self._house.viewpoints.get(room)
        if points is None:  # the room has no free floor
            return SearchPlace(room, position)
        gaps = estimated_distances(self._house, position, list(points))
        return SearchPlace(room, points[int(np.argmin(gaps))])

    def is_left(self, place: SearchPlace) -> bool:
        return any(other is place for other in self._left)

    def mark_searched(self, place: SearchPlace) -> None:
        self._left = [other for other in self._left if other is not place]

    def mark_seen(self, percept: Percept, room: str, within: float) -> None:
        """Mark as searched all viewpoints of a room that are in view and closer than `within` metres."""
        within /= self._round  # the participant looks more closely in each new round
        walls = self._house.navmesh.outline
        self._left = [
            place
            for place in self._left
            if place.room != room or not _sees(percept, place.point, within, walls)
        ]


def _sees(percept: Percept, point: Point, within: float, walls: NDArray[np.float64]) -> bool:
    way = point - percept.position
    aside = (math.atan2(way[1], way[0]) - percept.heading + math.pi) % (2.0 * math.pi) - math.pi
    in_front = np.linalg.norm(way) <= within and abs(aside) <= percept.person.field_of_view / 2.0
    return bool(in_front and free_length(walls, percept.position, point) >= np.linalg.norm(way))


def free_length(walls: NDArray[np.float64], start: Point, goal: Point) -> float:
    """Return the distance in metres from `start` to `goal`, or to the first wall on the way.

    Each row of `walls`, of shape (e, 4), contains x and y of both ends of a wall.
    """
    way, along, offset = goal - start, walls[:, 2:] - walls[:, :2], walls[:, :2] - start
    cross = way[0] * along[:, 1] - way[1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
        on_wall = (offset[:, 0] * way[1] - offset[:, 1] * way[0]) / cross
    hits = share[(cross != 0) & (share > 1e-9) & (share <= 1.0) & (on_wall >= 0.0) & (on_wall <= 1.0)]
    return float(hits.min(initial=1.0)) * float(np.linalg.norm(way))
