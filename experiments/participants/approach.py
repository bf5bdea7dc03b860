"""Choose where participants stop to pick up or place an object, and where they try again after failures."""

import math

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Percept, Point, estimated_distances
from mjsim.house.compiled.standing import Goal, middle
from mjsim.values.actions import Pick
from mjsim.world.walking.polyline import path_length, point_along
from planner.plan import Visit, VisitKind

MAX_FAILURES = 2  # number of failed attempts of one visit after which the participant stands elsewhere
MIN_STOP_DISTANCE = 0.30  # minimum distance between the person and an object at the end of a walk, in metres
SPACING = 0.05  # distance between checked stops along a path, in metres


class Approach:
    """A participant's attempts to pick up and place objects, and the places where the next ones are made."""

    def __init__(self, house: House) -> None:
        self._house = house
        self._latest: dict[str, tuple[Visit, Point]] = {}
        self._failed: dict[Visit, list[Point]] = {}
        self._place: tuple[Visit, int, Point | None] | None = None
        self._walk: tuple[NDArray[np.float64], tuple[float, ...], NDArray[np.float64] | None] | None = None

    def record(self, percept: Percept) -> None:
        """Record an attempt. An object that is picked up again was lost in its latest attempt."""
        answer = percept.answer
        if answer is None or not answer.applied or answer.object is None:
            return
        is_pick = isinstance(answer.action, Pick)
        if is_pick and answer.object in self._latest:
            self.fail(*self._latest[answer.object])
        made = Visit(VisitKind.PICK if is_pick else VisitKind.PLACE, answer.object)
        self._latest[answer.object] = made, percept.position.copy()

    def fail(self, visit: Visit, place: Point) -> None:
        """Record that a visit failed at a place."""
        self._failed.setdefault(visit, []).append(place.copy())

    def elsewhere(self, percept: Percept, visit: Visit, goal: Goal) -> Point | None:
        """Return the nearest place away from all failed attempts.

        Return None after fewer than `MAX_FAILURES` failures. If there is no other place, return None and forget all
        failures, so that the same places are tried again.
        """
        failed = self._failed.get(visit, [])
        if len(failed) < MAX_FAILURES:
            return None
        if self._place is None or self._place[:2] != (visit, len(failed)):
            places = self._house.standing.around(goal, failed)
            gaps = estimated_distances(self._house, percept.position, places) if places else []
            place = places[int(np.argmin(gaps))] if gaps else None
            self._place = visit, len(failed), place
            if place is None:
                del self._failed[visit]
        return self._place[2]

    def end(
        self, path: NDArray[np.float64], goal: Goal, stop_distance: float
    ) -> tuple[NDArray[np.float64], float]:
        """Return the path and stopping distance of a walk to a place from which nothing obstructs the reach.

        The walk normally ends as soon as the person is within `stop_distance` of the goal. If a wall is in the
        way there, the path is cut at a suitable place beyond. If there is no such place, nothing changes.
        """
        key = (*middle(goal).tolist(), stop_distance)
        if self._walk is None or self._walk[0] is not path or self._walk[1] != key:
            self._walk = path, key, self._cut(path, goal, stop_distance)
        cut = self._walk[2]
        return (path, stop_distance) if cut is None else (cut, 0.0)

    def _cut(self, path: NDArray[np.float64], goal: Goal, stop_distance: float) -> NDArray[np.float64] | None:
        """Return the part of a path up to a suitable place. Return None if the usual place is suitable or none is."""
        at, suits = middle(goal), self._house.standing.suits
        arcs = np.append(np.arange(0.0, path_length(path), SPACING), path_length(path))
        points = [np.array(point_along(path, float(arc))) for arc in arcs]
        gaps = [math.dist(point, at) for point in points]
        first = next((k for k, gap in enumerate(gaps) if gap <= stop_distance), len(points) - 1)
        if suits(points[first], goal):
            return None
        was_suitable = False  # the person may stop just before the end of the path
        for k in range(first + 1, len(points)):
            is_suitable = MIN_STOP_DISTANCE <= gaps[k] <= stop_distance and suits(points[k], goal)
            if is_suitable and was_suitable:
                return _first_part(path, float(arcs[k]))
            was_suitable = is_suitable
        return None


def _first_part(path: NDArray[np.float64], arc: float) -> NDArray[np.float64]:
    """Return the first `arc` metres of a path."""
    arcs = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    return np.vstack([path[arcs < arc], point_along(path, arc)])
