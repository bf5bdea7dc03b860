"""Goes to the nearest flagpole while a hand is free, or to the nearest bin (condition `highlight`)."""

import numpy as np

from experiments.known_house import KnownHouse
from experiments.participants.base import Participant, Percept
from experiments.participants.visit_participant import Decider
from experiments.participants.visit_tasks import Visit, VisitTask, nearest_visit


class Nearest(Decider):
    """Greedy: goes to the nearest place where something can be done, and keeps to a decision once made."""

    needs = frozenset({"flagpole"})

    def __init__(self, house: KnownHouse) -> None:
        super().__init__(house)
        self._choice: Visit | None = None

    def waits(self) -> bool:
        """It reaches and looks on."""
        return True

    def errand(self, percept: Percept) -> VisitTask | None:
        """The nearest flagpole or bin, until it is done with."""
        feasible = [("place", name) for name in percept.carried]
        if None in percept.hands:
            feasible += [("pick", name) for name in percept.flagpoles]
        if not feasible:
            return None
        if self._choice not in feasible:
            self._choice = nearest_visit(self._house, percept, feasible, percept.flagpoles)
        return self._runner.errand(percept, self._choice, percept.flagpoles)


def build(house: KnownHouse, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that goes for what is nearest."""
    return Nearest(house)
