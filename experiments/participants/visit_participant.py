"""People who decide on an errand, and then carry it out."""

from abc import ABC, abstractmethod

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from experiments.participants.base import Outlook, Percept
from experiments.participants.visit_tasks import NO_MOVES, VisitExecutor, VisitTask
from mjsim.actions import IDLE, Action


class Decider(ABC):
    """Does what its `errand` says, control step by control step or foreseen.

    Args:
        house: What it knows of the house.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, house: KnownHouse) -> None:
        self._house = house
        self._runner = VisitExecutor(house)

    @abstractmethod
    def errand(self, percept: Percept) -> VisitTask | None:
        """What to do now; the same as before unless that is done or impossible. None where there is nothing to do."""

    def act(self, percept: Percept) -> Action:
        """Walk to where the errand leads; pick or place there."""
        errand = None if percept.busy else self.errand(percept)
        return IDLE if errand is None else self._runner.act(percept, errand)

    def foresee(self, percept: Percept, outlook: Outlook) -> NDArray[np.float64]:
        """Moves up to where the errand leads."""
        errand = self.errand(percept)
        return NO_MOVES if errand is None else self._runner.foresee(percept, outlook, errand)

    def went(self, steps: int) -> None:
        """So many of the moves foreseen were made."""
        self._runner.went(steps)
