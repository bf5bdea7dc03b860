"""Goes to the nearest flagpole while a hand is free, or to the nearest bin (condition `highlight`)."""

import numpy as np

from experiments.known_house import KnownHouse
from experiments.participants.base import Participant, Percept
from experiments.participants.errands import (
    Errand,
    ErrandRunner,
    estimated_distance,
    pick_errand,
    place_errand,
)
from mjsim.actions import IDLE, Action


class Nearest:
    """Greedy: goes to the nearest place where something can be done, and keeps to a decision once made."""

    needs = frozenset({"flagpole"})

    def __init__(self, house: KnownHouse) -> None:
        self._house = house
        self._runner = ErrandRunner(house)
        self._choice: tuple[str, str] | None = None

    def act(self, percept: Percept) -> Action:
        """Walk to the chosen flagpole or bin; pick or place there."""
        errands = {e.key: e for e in self._feasible(percept)}
        if not errands:
            return IDLE
        if self._choice not in errands:
            here = percept.position
            self._choice = min(
                errands, key=lambda k: (estimated_distance(self._house, here, errands[k].stand), k)
            )
        return self._runner.act(percept, errands[self._choice])

    def _feasible(self, percept: Percept) -> list[Errand]:
        bins = [place_errand(self._house, n, percept.targets[n]) for n in percept.carried]
        if None not in percept.hands:
            return bins
        return bins + [pick_errand(self._house, n, xy) for n, xy in percept.flagpoles.items()]


def build(house: KnownHouse, rng: np.random.Generator) -> Participant:  # noqa: ARG001 - it leaves nothing to chance
    """Make a participant that goes for what is nearest."""
    return Nearest(house)
