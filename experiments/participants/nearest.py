"""Goes to the nearest flagpole while a hand is free, or to the nearest bin (condition `highlight`)."""

import numpy as np

from experiments.house import House
from experiments.participants.base import WAIT, Decision, Participant, Percept
from experiments.participants.visit_executor import VisitExecutor, nearest_visit
from planner.plan import Visit, VisitKind


class Nearest:
    """Greedy: goes to the nearest place where something can be done, and keeps to a decision once made."""

    needs = frozenset({"flagpole"})

    def __init__(self, house: House) -> None:
        self._house = house
        self._executor = VisitExecutor(house)
        self._choice: Visit | None = None

    def act(self, percept: Percept) -> Decision:
        """Go to the nearest flagpole or bin; pick or place there."""
        if percept.busy:
            return WAIT
        feasible = [Visit(VisitKind.PLACE, name) for name in percept.carried]
        if not percept.hands_full:
            feasible += [Visit(VisitKind.PICK, name) for name in percept.flagpoles]
        if not feasible:
            return WAIT
        if self._choice not in feasible:
            self._choice = nearest_visit(self._house, percept, feasible, percept.flagpoles)
        return self._executor.act(percept, self._choice, percept.flagpoles)


def build(house: House, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that goes for what is nearest."""
    return Nearest(house)
