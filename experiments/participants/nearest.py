"""Goes to the nearest flagpole while a hand is free, or to the nearest bin (condition `highlight`)."""

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from experiments.participants.base import Outlook, Participant, Percept
from experiments.participants.errands import NO_MOVES, Errand, ErrandRunner, Visit, nearest_visit
from mjsim.actions import IDLE, Action


class Nearest:
    """Greedy: goes to the nearest place where something can be done, and keeps to a decision once made."""

    needs = frozenset({"flagpole"})

    def __init__(self, house: KnownHouse) -> None:
        self._house = house
        self._runner = ErrandRunner(house)
        self._choice: Visit | None = None

    def act(self, percept: Percept) -> Action:
        """Walk to the chosen flagpole or bin; pick or place there."""
        errand = None if percept.busy else self._errand(percept)
        return IDLE if errand is None else self._runner.act(percept, errand)

    def foresee(self, percept: Percept, outlook: Outlook) -> NDArray[np.float64]:
        """Moves up to the chosen flagpole or bin."""
        errand = self._errand(percept)
        return NO_MOVES if errand is None else self._runner.foresee(percept, outlook, errand)

    def went(self, steps: int) -> None:
        """So many of the moves foreseen were made."""
        self._runner.went(steps)

    def waits(self) -> bool:
        """It reaches and looks on."""
        return True

    def _errand(self, percept: Percept) -> Errand | None:
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
