"""Execution of visits: path, stopping distance and action. All simulated participants share it."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Guidance, Percept, Point
from experiments.participants.bin_search import BinSearch
from experiments.participants.distances import estimated_distances
from mjsim.values.actions import TIME_TOLERANCE, WAIT, Action, FollowPath, Pick, Place
from mjsim.world.walking.polyline import project
from planner.plan import Visit, VisitKind

STOP_SHARE = 0.72  # of the reach, from the goal: near enough to reach, far enough not to kick it
CLOSER = 0.12  # m nearer after every refusal
MIN_STOP_DISTANCE = 0.30  # m


class VisitExecutor:
    """Executes visits; goes nearer after a refusal, and takes another path when blocked.

    A bin that the person has not seen is searched for first.
    """

    def __init__(self, house: House) -> None:
        self._house = house
        self._bins = BinSearch(house)
        self._visit: Visit | None = None
        self._stop_distance = MIN_STOP_DISTANCE
        self._read_until = 0.0
        self._path: NDArray[np.float64] | None = None
        self._places: tuple[Visit, Point, Point] | None = None

    def act(
        self, percept: Percept, visit: Visit, objects: Mapping[str, Point], *, until: float | None = None
    ) -> Action:
        """Walk the shortest known path to a visit, and make it.

        `objects` are believed places, m, shape (2,); `until` is the simulated time at which to ask again, s.
        """
        if percept.busy:
            return WAIT
        self.look_for_bins(percept)
        self._take_up(percept, visit)
        if self._is_reading(percept):
            return WAIT
        if not self._knows(percept, visit):
            return self._bins.act(percept, percept.targets[visit.object], self.walk_to)
        goal, stand = self._find_places(percept, visit, objects)
        path = self._path_to(percept, stand)
        return FollowPath(path, goal, self._stop_distance, _action(visit), self._bins.until(until))

    def follow(self, percept: Percept, guidance: Guidance, *, until: float | None = None) -> Action:
        """Walk along the shown path and make the shown visit at its end; decide again at `until`, s."""
        if percept.busy:
            return WAIT
        self._take_up(percept, guidance.visit)
        if self._is_reading(percept):
            return WAIT
        return FollowPath(
            guidance.path,
            guidance.goal,
            self._stop_distance,
            _action(guidance.visit),
            until,
            shown=True,
            tolerance=guidance.tolerance,
        )

    def walk_to(
        self, percept: Percept, goal: Point, stop_distance: float, *, until: float | None = None
    ) -> Action:
        """Walk the shortest known path to a place, m, shape (2,), up to `stop_distance` m from it."""
        return FollowPath(self._path_to(percept, goal), goal, stop_distance, until=self._bins.until(until))

    def look_for_bins(self, percept: Percept) -> None:
        """Notice bins that the person has not seen yet; call it at each look around."""
        self._bins.look(percept)

    def nearest_visit(self, percept: Percept, visits: Sequence[Visit], objects: Mapping[str, Point]) -> Visit:
        """The visit of one or more with the shortest path to it; `objects` says where objects are, m, shape (2,)."""
        stands = [self._likely_stand(percept, visit, objects) for visit in visits]
        distances = estimated_distances(self._house, percept.position, stands)
        ranked = zip(distances, visits, strict=True)
        return min(ranked, key=lambda pair: (pair[0], pair[1].kind.value, pair[1].object))[1]

    def _knows(self, percept: Percept, visit: Visit) -> bool:
        """Whether the person knows the place of a visit."""
        return visit.kind is VisitKind.PICK or self._bins.knows(percept.targets[visit.object])

    def _likely_stand(self, percept: Percept, visit: Visit, objects: Mapping[str, Point]) -> Point:
        """End of the path to a visit, or start of the search for its bin, m, shape (2,)."""
        if self._knows(percept, visit):
            return places(self._house, percept, visit, objects)[1]
        return self._bins.likely_place(percept.position, percept.targets[visit.object])

    def _take_up(self, percept: Percept, visit: Visit) -> None:
        if visit != self._visit:
            self._visit, self._path = visit, None
            self._stop_distance = STOP_SHARE * percept.person.reach
            self._read_until = percept.time + percept.person.reading_time
        if percept.answer is not None and not percept.answer.applied:
            self._stop_distance = max(self._stop_distance - CLOSER, MIN_STOP_DISTANCE)

    def _is_reading(self, percept: Percept) -> bool:
        """Whether the person still stands and reads the next step."""
        return percept.time < self._read_until - TIME_TOLERANCE

    def _path_to(self, percept: Percept, goal: Point) -> NDArray[np.float64]:
        """The path as it was, or a new one if that leads elsewhere, is blocked, or the person has left it; (k, 2)."""
        path = self._path
        if path is None or percept.blocked or not _same(path[-1], goal) or _is_off(path, percept):
            self._path = path = np.vstack(
                [self._house.geodesics.shortest_path(percept.position, goal).points, goal]
            )
        return path

    def _find_places(
        self, percept: Percept, visit: Visit, objects: Mapping[str, Point]
    ) -> tuple[Point, Point]:
        """As `places`; computed again only for another visit, or when the object has moved."""
        known = self._places
        if known is not None and known[0] == visit:
            _, goal, stand = known
            if visit.kind is VisitKind.PLACE or _same(goal, objects[visit.object]):
                return goal, stand
        goal, stand = places(self._house, percept, visit, objects)
        self._places = visit, goal, stand
        return goal, stand


def places(house: House, percept: Percept, visit: Visit, objects: Mapping[str, Point]) -> tuple[Point, Point]:
    """Place of a visit's object or receptacle, and end of the path to it, m, both of shape (2,)."""
    if visit.kind is VisitKind.PICK:
        goal = objects[visit.object]
        return goal, house.navmesh.snap(goal)
    receptacle = percept.targets[visit.object]
    return house.receptacles[receptacle].center[:2], house.approaches[receptacle]


def _action(visit: Visit) -> Pick | Place:
    return Pick(visit.object) if visit.kind is VisitKind.PICK else Place(visit.object)


def _same(one: Point, other: Point) -> bool:
    return bool(one[0] == other[0] and one[1] == other[1])


def _is_off(path: NDArray[np.float64], percept: Percept) -> bool:
    return project(path, percept.position[0], percept.position[1])[1] > FollowPath.tolerance
