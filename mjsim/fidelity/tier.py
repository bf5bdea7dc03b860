"""What all tiers of fidelity have in common."""

from abc import ABC, abstractmethod
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, Move, Pick, Place
from mjsim.fidelity.episode_state import EpisodeState
from mjsim.health.values import HealthSample
from mjsim.observation import Observation
from mjsim.rollout import Rollout


class Tier(ABC):
    """One way to advance the person and the objects by control steps.

    Attributes:
        episode_state: Hands, statuses, and the events of the latest control step.
    """

    episode_state: EpisodeState

    @property
    @abstractmethod
    def busy(self) -> bool:
        """Whether a pick or place is under way."""

    @property
    @abstractmethod
    def health_sample(self) -> HealthSample:
        """Health of the physics in the latest control step."""

    @abstractmethod
    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step; its events are in `episode_state` afterwards."""

    @abstractmethod
    def answer(self, action: Pick | Place) -> ActionResult:
        """What the answer to a pick or place would be now; nothing changes."""

    @abstractmethod
    def observation(self) -> Observation:
        """The present state."""

    @abstractmethod
    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4), until a step brings events; not while busy."""
        return self.step_each(Move(*row) for row in moves.tolist())

    def finish(self) -> Rollout:
        """Idle until no pick or place is under way, or a step brings events."""
        return self.step_each(iter(lambda: IDLE if self.busy else None, None))

    def step_each(self, actions: Iterable[Action]) -> Rollout:
        """One control step per action, until a step brings events."""
        observations: list[Observation] = []
        hashes: list[int] = []
        health: list[tuple[float, ...]] = []
        for action in actions:
            self.step(action)
            observations.append(self.observation())
            hashes.append(self.state_hash())
            health.append(self.health_sample.row)
            if self.episode_state.events:
                break
        last = observations[-1] if observations else self.observation()
        events = tuple(self.episode_state.events) if observations else ()
        return Rollout.of_steps(observations, hashes, health, last, events)
