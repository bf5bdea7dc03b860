"""One person for all conditions: uses breadcrumbs where they are shown, else flagpoles, else its own eyes."""

import numpy as np

from experiments.house import House
from experiments.participants.base import WAIT, Decision, Participant, Percept
from experiments.participants.nearest import Nearest
from experiments.participants.searcher import Searcher
from experiments.participants.visit_executor import VisitExecutor


class BreadcrumbFollower:
    """Walks along the breadcrumbs and does what the current step says."""

    needs = frozenset({"breadcrumb"})

    def __init__(self, house: House) -> None:
        self._executor = VisitExecutor(house)

    def act(self, percept: Percept) -> Decision:
        """Walk along the breadcrumbs; pick or place at their end."""
        if percept.busy or percept.guidance is None:
            return WAIT
        return self._executor.follow(percept, percept.guidance)


class Follower:
    """Follows breadcrumbs where they are shown, goes for flagpoles as `nearest` does, and else is a `searcher`.

    Guidance that was shown once is waited for: flagpoles are gone when the last object is in a hand.
    """

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._along_breadcrumbs = BreadcrumbFollower(house)
        self._to_flagpoles = Nearest(house)
        self._conduct: Participant = Searcher(house, rng)

    def act(self, percept: Percept) -> Decision:
        """Do as the best guidance that was ever on display suggests."""
        if percept.guidance is not None:
            self._conduct = self._along_breadcrumbs
        elif self._conduct is not self._along_breadcrumbs and percept.flagpoles:
            self._conduct = self._to_flagpoles
        return self._conduct.act(percept)


def build(house: House, rng: np.random.Generator) -> Participant:
    """Make a participant that makes the most of what it is shown."""
    return Follower(house, rng)
