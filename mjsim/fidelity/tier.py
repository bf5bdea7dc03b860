"""What a world needs of the tier of fidelity that it runs in."""

from collections.abc import Iterable
from typing import Protocol

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Action, ActionResult
from mjsim.fidelity.episode_state import EpisodeState
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.health.values import Health, HealthSample
from mjsim.observation import Observation
from mjsim.rollout import Rollout
from mjsim.world_state import WorldState


class Tier(Protocol):
    """One way to advance the person and the objects by control steps.

    Attributes:
        episode_state: Hands, statuses, and the events of the latest control step.
    """

    episode_state: EpisodeState

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays, in step with the tier's own."""
        ...

    @property
    def time(self) -> float:
        """Simulated time, s."""
        ...

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        ...

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        ...

    @property
    def health_sample(self) -> HealthSample:
        """Health of the physics in the latest control step."""
        ...

    @property
    def locomotion(self) -> LocomotionState | None:
        """What walking depends on, for roll-out kernels; None while physics or a motion moves the person."""
        ...

    def reset(self) -> None:
        """Return to the episode's beginning."""
        ...

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step; its events are in `episode_state` afterwards."""
        ...

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4), until a step brings events; not while busy."""
        ...

    def finish(self) -> Rollout:
        """Idle until no pick or place is under way, or a step brings events."""
        ...

    def observation(self) -> Observation:
        """The present state."""
        ...

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        ...

    def state(self) -> WorldState:
        """Everything that `restore` needs to continue from here; not while busy."""
        ...

    def restore(self, state: WorldState) -> None:
        """Continue from a state.

        Raises:
            StateError: It does not fit.
        """
        ...


def by_steps(tier: Tier, actions: Iterable[Action]) -> Rollout:
    """One control step per action, until a step brings events."""
    observations: list[Observation] = []
    hashes: list[int] = []
    health: list[tuple[float, ...]] = []
    for action in actions:
        tier.step(action)
        observations.append(tier.observation())
        hashes.append(tier.state_hash())
        health.append(tier.health_sample.row)
        if tier.episode_state.events:
            break
    last = observations[-1] if observations else tier.observation()
    events = tuple(tier.episode_state.events) if observations else ()
    return Rollout.of_steps(observations, hashes, health, last, events)
