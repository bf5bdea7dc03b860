"""A participant who searches the house room by room and tidies up the objects found."""

import numpy as np

from experiments.house import House
from experiments.participants.base import FullTurn, Participant, Percept, Point, estimated_distances
from experiments.participants.frontier import Frontier, SearchPlace
from experiments.participants.visit_executor import VisitExecutor
from mjsim.values.actions import IDLE, TIME_TOLERANCE, WAIT, Action
from planner.plan import Visit, VisitKind

SEARCHED = 0.5  # distance from a viewpoint at which the participant starts to look around, in metres
GONE = 1.2  # distance in metres within which a remembered object that is not in view counts as gone


class Searcher:
    """A participant who collects objects, and places them when the hands are full or no others are known.

    The participant finishes the current room before going to the nearest viewpoint in another room.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house = house
        self._executor = VisitExecutor(house)
        self._remembered: dict[str, Point] = {}
        self._frontier = Frontier(house, rng)
        self._target: SearchPlace | None = None
        self._room: str | None = None
        self._turn: FullTurn | None = None
        self._next_look = 0.0
        self._choice: Visit | None = None

    def act(self, percept: Percept) -> Action:
        if self._executor.waits(percept):
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

    def _search(self, percept: Percept) -> Action:
        if self._turn is None:
            if self._target is None:
                self._target = self._next_place(percept.position)
            if float(np.linalg.norm(self._target.point - percept.position)) > SEARCHED:
                return self._executor.walk_to(percept, self._target.point, SEARCHED, until=self._next_look)
            self._room, self._turn = self._target.room, FullTurn(percept.heading)
        turning = self._turn.act(percept)
        if turning is not None:
            return turning
        self._turn = None
        if self._target is not None:
            self._frontier.mark_searched(self._target)
            self._target = None
        return IDLE

    def _next_place(self, position: Point) -> SearchPlace:
        left = self._frontier.places()
        here = [place for place in left if place.room == self._room] or left
        gaps = estimated_distances(self._house, position, [place.point for place in here])
        return here[int(np.argmin(gaps))]


def build(house: House, rng: np.random.Generator) -> Participant:
    return Searcher(house, rng)
