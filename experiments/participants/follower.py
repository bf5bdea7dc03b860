"""Follows the breadcrumbs and does what the current step says (condition `optimal`)."""

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from experiments.participants.base import Guidance, Outlook, Participant, Percept
from experiments.participants.visit_tasks import NO_MOVES, VisitExecutor, VisitTask
from mjsim.actions import IDLE, Action


class Follower:
    """Complies fully with the guidance shown."""

    needs = frozenset({"goal"})

    def __init__(self, house: KnownHouse) -> None:
        self._runner = VisitExecutor(house)

    def act(self, percept: Percept) -> Action:
        """Walk along the breadcrumbs; pick or place at their end."""
        if percept.busy or percept.guidance is None:
            return IDLE
        return self._runner.act(percept, _errand(percept.guidance), percept.guidance.path)

    def foresee(self, percept: Percept, outlook: Outlook) -> NDArray[np.float64]:
        """Moves up to the end of the breadcrumbs."""
        if percept.guidance is None:
            return NO_MOVES
        return self._runner.foresee(percept, outlook, _errand(percept.guidance), percept.guidance.way)

    def went(self, steps: int) -> None:
        """So many of the moves foreseen were made."""
        self._runner.went(steps)

    def waits(self) -> bool:
        """It reaches and looks on."""
        return True


def _errand(step: Guidance) -> VisitTask:
    return VisitTask(step.kind, step.object, step.goal, step.path[-1])


def build(house: KnownHouse, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that follows the guidance."""
    return Follower(house)
