"""A participant who always goes to the nearest possible place, and finds objects by their flagpoles."""

import numpy as np

from experiments.house import House
from experiments.participants.base import FullTurn, Participant, Percept, Point
from experiments.participants.visit_executor import VisitExecutor
from mjsim.values.actions import TIME_TOLERANCE, WAIT, Action
from planner.plan import Visit, VisitKind


class Nearest:
    """A participant who chooses the nearest possible visit and pursues it until it is finished or impossible.

    The participant makes a full turn at the start to find the flagpoles, and again when no objects are known.
    """

    needs = frozenset({"flagpole"})

    def __init__(self, house: House) -> None:
        self._executor = VisitExecutor(house)
        self._choice: Visit | None = None
        self._known: dict[str, Point] = {}
        self._turn: FullTurn | None = None
        self._next_look = 0.0

    def act(self, percept: Percept) -> Action:
        """Return the action for the next control step."""
        if self._executor.waits(percept):
            return WAIT
        self._look(percept)
        if not self._known and not percept.carried and self._turn is None:
            self._turn = FullTurn(percept.heading, level=True)
        if self._turn is not None:
            turning = self._turn.act(percept)
            if turning is not None:
                return turning
            self._turn = None
        return self._visit(percept)

    def _look(self, percept: Percept) -> None:
        self._executor.look_for_bins(percept)
        for name in percept.carried:
            self._known.pop(name, None)
        refused = percept.answer is not None and not percept.answer.applied
        if refused and self._choice is not None and self._choice.object not in percept.flagpoles:
            self._known.pop(self._choice.object, None)
        if percept.time >= self._next_look - TIME_TOLERANCE:
            self._next_look = percept.time + percept.person.looking_interval
            self._known.update(percept.flagpoles)

    def _visit(self, percept: Percept) -> Action:
        feasible = [Visit(VisitKind.PLACE, name) for name in percept.carried]
        if not percept.hands_full:
            feasible += [Visit(VisitKind.PICK, name) for name in self._known]
        if not feasible:
            return WAIT
        if self._choice not in feasible:
            self._choice = self._executor.nearest_visit(percept, feasible, self._known)
        return self._executor.act(percept, self._choice, self._known)


def build(house: House, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it makes no random choices
    return Nearest(house)
