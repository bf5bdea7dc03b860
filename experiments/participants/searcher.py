"""Searches room by room with what it can see, and tidies what it finds (condition `none`)."""

import numpy as np

from experiments.house import House
from experiments.participants.base import TIME_TOLERANCE, WAIT, Decision, Participant, Percept, Point
from experiments.participants.distances import estimated_distances
from experiments.participants.looking import FullTurn
from experiments.participants.visit_executor import VisitExecutor
from mjsim.actions import IDLE
from planner.plan import Visit, VisitKind

SEARCHED = 0.5  # m from a viewpoint before the look around begins
GONE = 1.2  # m: a remembered object nearer than this and not in view is no longer there


class Searcher:
    """Picks what it has seen, brings what it carries when both hands are full or nothing else is known,
    and searches the rest of the present room before it goes on to the nearest unsearched one."""

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house = house
        self._rng = rng
        self._executor = VisitExecutor(house)
        self._remembered: dict[str, Point] = {}
        self._unsearched: list[tuple[str, Point]] = []
        self._target: tuple[str, Point] | None = None
        self._room: str | None = None
        self._turn: FullTurn | None = None
        self._next_look = 0.0
        self._choice: Visit | None = None

    def act(self, percept: Percept) -> Decision:
        """Look and remember; fetch or bring what is known, else search."""
        if percept.busy:
            return WAIT
        self._look(percept)
        visit = self._next_visit(percept)
        if visit is None:
            return self._search(percept)
        self._turn = None
        return self._executor.act(percept, visit, self._remembered, until=self._next_look)

    def _look(self, percept: Percept) -> None:
        self._executor.look_for_bins(percept)
        for name in percept.carried:
            self._remembered.pop(name, None)
        if percept.time < self._next_look - TIME_TOLERANCE:
            return
        self._next_look = percept.time + percept.person.looking_interval
        self._remembered.update(percept.look())

    def _next_visit(self, percept: Percept) -> Visit | None:
        """What can be done with what is known: fetch the nearest known object, or bring what is carried."""
        bins = [Visit(VisitKind.PLACE, name) for name in percept.carried]
        known = [Visit(VisitKind.PICK, name) for name in sorted(self._remembered)]
        feasible = bins if percept.hands_full else known or bins
        if not feasible:
            return None
        if self._choice not in feasible:
            self._choice = self._executor.nearest_visit(percept, feasible, self._remembered)
        kind, name = self._choice
        if kind is VisitKind.PICK and self._has_gone(percept, name):
            del self._remembered[name]
            return self._next_visit(percept)
        return self._choice

    def _has_gone(self, percept: Percept, name: str) -> bool:
        refused = percept.answer is not None and not percept.answer.applied
        near = float(np.linalg.norm(self._remembered[name] - percept.position)) < GONE
        return refused and near and name not in percept.look()

    def _search(self, percept: Percept) -> Decision:
        if self._turn is not None:
            return self._look_around(percept, self._turn)
        room, viewpoint = self._viewpoint(percept)
        if float(np.linalg.norm(viewpoint - percept.position)) > SEARCHED:
            return self._executor.walk_to(percept, viewpoint, SEARCHED, until=self._next_look)
        self._room, self._turn = room, FullTurn(percept.heading)
        return self._look_around(percept, self._turn)

    def _viewpoint(self, percept: Percept) -> tuple[str, Point]:
        """Viewpoint to search from next, and its room."""
        if self._target is None:
            self._target = self._next_viewpoint(percept.position)
        return self._target

    def _look_around(self, percept: Percept, turn: FullTurn) -> Decision:
        turning = turn.act(percept)
        if turning is not None:
            return turning
        self._turn = None
        if self._target is not None:
            self._unsearched = [v for v in self._unsearched if v is not self._target]
            self._target = None
        return IDLE

    def _next_viewpoint(self, position: Point) -> tuple[str, Point]:
        if not self._unsearched:
            self._unsearched = self._all_viewpoints()
        here = [v for v in self._unsearched if v[0] == self._room] or self._unsearched
        gaps = estimated_distances(self._house, position, [point for _, point in here])
        return here[int(np.argmin(gaps))]

    def _all_viewpoints(self) -> list[tuple[str, Point]]:
        """Every viewpoint, a little elsewhere at each round so that what was hidden once is seen later."""
        return [
            (room, self._house.navmesh.snap(point + self._rng.normal(0.0, 0.15, size=2)))
            for room, points in self._house.viewpoints.items()
            for point in points
        ]


def build(house: House, rng: np.random.Generator) -> Participant:
    """Make a participant that knows the house but not where anything lies."""
    return Searcher(house, rng)
