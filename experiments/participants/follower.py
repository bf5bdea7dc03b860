"""Follows the breadcrumbs and does what the current step says (condition `optimal`)."""

import numpy as np

from experiments.house import House
from experiments.participants.base import WAIT, Decision, Participant, Percept
from experiments.participants.visit_executor import VisitExecutor


class Follower:
    """Complies fully with the guidance shown."""

    needs = frozenset({"goal"})

    def __init__(self, house: House) -> None:
        self._executor = VisitExecutor(house)

    def act(self, percept: Percept) -> Decision:
        """Walk along the breadcrumbs; pick or place at their end."""
        if percept.busy or percept.guidance is None:
            return WAIT
        return self._executor.follow(percept, percept.guidance)


def build(house: House, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that follows the guidance."""
    return Follower(house)
