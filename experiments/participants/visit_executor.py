"""Carry out the visits of simulated participants by walking, searching for bins, picking and placing."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.approach import MIN_STOP_DISTANCE, Approach
from experiments.participants.base import NEARBY, FullTurn, Guidance, Percept, Point, estimated_distances
from mjsim.values.actions import TIME_TOLERANCE, WAIT, Action, FollowPath, Pick, Place
from mjsim.world.walking.polyline import project
from planner.plan import Visit, VisitKind

STOP_SHARE = 0.72  # stopping distance relative to the reach, large enough not to kick the object
CLOSER = 0.12  # reduction of the stopping distance after a refused pick or place, in metres
ARRIVED = 0.5  # distance from a viewpoint at which the participant starts to look around, in metres

WalkTo = Callable[[Percept, Point, float], Action]


class VisitExecutor:
    """An executor that carries out visits for a participant.

    The walk ends where the straight reach to the goal is free. After a refused pick or place, the participant
    stops closer to the goal. After two lost grips, or two refusals at the closest stop, the participant stands
    elsewhere. A blocked participant takes another path. If the participant has not seen the bin of a visit yet,
    the visit begins with a search for the bin.
    """

    def __init__(self, house: House) -> None:
        self._house = house
        self._bins = BinSearch(house)
        self._approach = Approach(house)
        self._visit: Visit | None = None
        self._stop_distance = MIN_STOP_DISTANCE
        self._read_until = 0.0
        self._path: NDArray[np.float64] | None = None
        self._places: tuple[Visit, Point, Point] | None = None

    def act(
        self, percept: Percept, visit: Visit, objects: Mapping[str, Point], *, until: float | None = None
    ) -> Action:
        """Walk the shortest known path to the goal of a visit, and pick or place there.

        `objects` contains remembered positions. `until` is the time of the next decision in seconds.
        """
        if self.waits(percept):
            return WAIT
        self.look_for_bins(percept)
        self._take_up(percept, visit)
        if self._is_reading(percept):
            return WAIT
        if not self._knows(percept, visit):
            return self._bins.act(percept, percept.targets[visit.object], self.walk_to)
        goal, stand = self._find_places(percept, visit, objects)
        path, stop_distance = self._walk(percept, visit, goal, lambda: self._path_to(percept, stand))
        return FollowPath(path, goal, stop_distance, _action(visit), self._bins.until(until))

    def follow(self, percept: Percept, guidance: Guidance, *, until: float | None = None) -> Action:
        """Walk along the shown path, then pick or place. `until` is the next decision time in seconds."""
        if self.waits(percept):
            return WAIT
        self._take_up(percept, guidance.visit)
        if self._is_reading(percept):
            return WAIT
        visit, goal = guidance.visit, guidance.goal
        path, stop_distance = self._walk(percept, visit, goal, lambda: guidance.path)
        return FollowPath(
            path,
            goal,
            stop_distance,
            _action(visit),
            until,
            shown=True,
            tolerance=guidance.tolerance,
        )

    def walk_to(
        self, percept: Percept, goal: Point, stop_distance: float, *, until: float | None = None
    ) -> Action:
        """Walk the shortest known path to within `stop_distance` of a point, both in metres."""
        return FollowPath(self._path_to(percept, goal), goal, stop_distance, until=self._bins.until(until))

    def waits(self, percept: Percept) -> bool:
        """Return True during a pick or place. Call this at every decision, so that lost grips are recorded."""
        if percept.busy:
            self._approach.record(percept)
        return percept.busy

    def look_for_bins(self, percept: Percept) -> None:
        """Remember the bins in view. Call this each time the participant looks around."""
        self._bins.look(percept)

    def nearest_visit(self, percept: Percept, visits: Sequence[Visit], objects: Mapping[str, Point]) -> Visit:
        """Return the visit with the shortest path. `objects` contains remembered positions in metres."""
        stands = [self._likely_stand(percept, visit, objects) for visit in visits]
        distances = estimated_distances(self._house, percept.position, stands)
        ranked = zip(distances, visits, strict=True)
        return min(ranked, key=lambda pair: (pair[0], pair[1].kind.value, pair[1].object))[1]

    def _knows(self, percept: Percept, visit: Visit) -> bool:
        return visit.kind is VisitKind.PICK or self._bins.knows(percept.targets[visit.object])

    def _likely_stand(self, percept: Percept, visit: Visit, objects: Mapping[str, Point]) -> Point:
        if self._knows(percept, visit):
            return places(self._house, percept, visit, objects)[1]
        return self._bins.likely_place(percept.position, percept.targets[visit.object])

    def _take_up(self, percept: Percept, visit: Visit) -> None:
        if visit != self._visit:
            self._visit, self._path = visit, None
            self._stop_distance = STOP_SHARE * percept.person.reach
            self._read_until = percept.time + percept.person.reading_time
        if percept.answer is not None and not percept.answer.applied:
            if self._stop_distance == MIN_STOP_DISTANCE:
                self._approach.fail(visit, percept.position)
            self._stop_distance = max(self._stop_distance - CLOSER, MIN_STOP_DISTANCE)

    def _is_reading(self, percept: Percept) -> bool:
        return percept.time < self._read_until - TIME_TOLERANCE

    def _path_to(self, percept: Percept, goal: Point) -> NDArray[np.float64]:
        path = self._path
        if path is None or percept.blocked or not _same(path[-1], goal) or _is_off(path, percept):
            self._path = path = np.vstack(
                [self._house.geodesics.shortest_path(percept.position, goal).points, goal]
            )
        return path

    def _walk(
        self, percept: Percept, visit: Visit, at: Point, path_to: Callable[[], NDArray[np.float64]]
    ) -> tuple[NDArray[np.float64], float]:
        """Return the path and the stopping distance of a walk. `path_to` returns the usual path to a goal `at`."""
        is_pick = visit.kind is VisitKind.PICK
        goal = at if is_pick else self._house.receptacles[percept.targets[visit.object]]
        place = self._approach.elsewhere(percept, visit, goal)
        if place is not None:
            return self._path_to(percept, place), 0.0
        return self._approach.end(path_to(), goal, self._stop_distance)

    def _find_places(
        self, percept: Percept, visit: Visit, objects: Mapping[str, Point]
    ) -> tuple[Point, Point]:
        known = self._places
        if known is not None and known[0] == visit:
            _, goal, stand = known
            if visit.kind is VisitKind.PLACE or _same(goal, objects[visit.object]):
                return goal, stand
        goal, stand = places(self._house, percept, visit, objects)
        self._places = visit, goal, stand
        return goal, stand


def places(house: House, percept: Percept, visit: Visit, objects: Mapping[str, Point]) -> tuple[Point, Point]:
    """Return the goal of a visit and the end of the path to the goal, both in metres, shape (2,)."""
    if visit.kind is VisitKind.PICK:
        goal = objects[visit.object]
        return goal, house.navmesh.snap(house.place_of(goal))
    receptacle = percept.targets[visit.object]
    return house.receptacles[receptacle].center[:2], house.approaches[receptacle]


def _action(visit: Visit) -> Pick | Place:
    return Pick(visit.object) if visit.kind is VisitKind.PICK else Place(visit.object)


def _same(one: Point, other: Point) -> bool:
    return bool(one[0] == other[0] and one[1] == other[1])


def _is_off(path: NDArray[np.float64], percept: Percept) -> bool:
    return project(path, percept.position[0], percept.position[1])[1] > FollowPath.tolerance


class BinSearch:
    """A search for the bins that the participant has not seen yet."""

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
        return key not in self._unknown

    def look(self, percept: Percept) -> None:
        """Remember the bins in view and nearby."""
        if not self._unknown or percept.time < self._next_look - TIME_TOLERANCE:
            return
        self._next_look = percept.time + percept.person.looking_interval
        for key in percept.look_for(self._unknown) | self._nearby(percept):
            del self._unknown[key]

    def until(self, time: float | None) -> float | None:
        """Return `time` or the time of the next look, whichever is earlier, or None if both are unset."""
        if not self._unknown:
            return time
        return self._next_look if time is None else min(time, self._next_look)

    def likely_place(self, position: Point, key: str) -> Point:
        """Return the point where the search for a bin starts: the nearest viewpoint of the bin's room."""
        points = self._viewpoints(key)
        return points[self._nearest(position, points)]

    def act(self, percept: Percept, key: str, walk_to: WalkTo) -> Action:
        """Walk to the viewpoints of the bin's room, nearest first, and look around at each."""
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
        if not self._left:
            self._left = self._viewpoints(key)
        return self._left.pop(self._nearest(position, self._left))

    def _viewpoints(self, key: str) -> list[Point]:
        """Return the viewpoints of the bin's room, followed by the point next to the bin."""
        room = self._house.catalogue.receptacles[key].room
        return [*self._house.viewpoints.get(room, ()), self._house.approaches[key]]

    def _nearest(self, position: Point, points: list[Point]) -> int:
        candidates = points[:-1] or points
        return int(np.argmin(estimated_distances(self._house, position, candidates)))

    def _nearby(self, percept: Percept) -> set[str]:
        house, here = self._house, self._house.rooms.room_at(percept.position)
        return {
            key
            for key, found in self._unknown.items()
            if house.catalogue.receptacles[key].room == here and found.distance(percept.position) < NEARBY
        }
