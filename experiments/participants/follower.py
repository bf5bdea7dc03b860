"""Follows the breadcrumbs and does what the current step says (condition `optimal`)."""

import numpy as np

from experiments.known_house import KnownHouse
from experiments.participants.base import Participant, Percept
from experiments.participants.errands import Errand, ErrandRunner
from mjsim.actions import IDLE, Action


class Follower:
    """Complies fully with the guidance shown."""

    needs = frozenset({"goal"})

    def __init__(self, house: KnownHouse) -> None:
        self._runner = ErrandRunner(house)

    def act(self, percept: Percept) -> Action:
        """Walk along the breadcrumbs; pick or place at their end."""
        step = percept.guidance
        if step is None:
            return IDLE
        return self._runner.act(percept, Errand(step.kind, step.object, step.goal, step.path[-1]), step.path)


def build(house: KnownHouse, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that follows the guidance."""
    return Follower(house)
