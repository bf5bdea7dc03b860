"""A participant who follows breadcrumbs if shown, and otherwise acts like `nearest` or `searcher`."""

import numpy as np

from experiments.house import House
from experiments.participants.base import Participant, Percept
from experiments.participants.nearest import Nearest
from experiments.participants.searcher import Searcher
from experiments.participants.visit_executor import VisitExecutor
from mjsim.values.actions import WAIT, Action


class BreadcrumbFollower:
    """A participant who walks along the breadcrumbs and picks up or places an object at their end."""

    needs = frozenset({"breadcrumb"})

    def __init__(self, house: House) -> None:
        self._executor = VisitExecutor(house)

    def act(self, percept: Percept) -> Action:
        """Return the action for the next control step."""
        if self._executor.waits(percept) or percept.guidance is None:
            return WAIT
        return self._executor.follow(percept, percept.guidance)


class Follower:
    """A participant who uses breadcrumbs or flagpoles if they are shown, and otherwise searches the rooms."""

    needs: frozenset[str] = frozenset()

    def __init__(self, house: House, rng: np.random.Generator) -> None:
        self._house, self._rng = house, rng
        self._conduct: Participant | None = None

    def act(self, percept: Percept) -> Action:
        """Return the action for the next control step."""
        if self._conduct is None:
            self._conduct = self._choose(percept.shown_roles)
        return self._conduct.act(percept)

    def _choose(self, shown: frozenset[str]) -> Participant:
        for conduct in (BreadcrumbFollower(self._house), Nearest(self._house)):
            if conduct.needs <= shown:
                return conduct
        return Searcher(self._house, self._rng)


def build(house: House, rng: np.random.Generator) -> Participant:
    return Follower(house, rng)
