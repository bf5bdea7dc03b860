"""Reward functions based on elapsed time, with optional shaping."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mjsim.house.scene.scene import Scene
from mjsim.values.episode import CAPACITY
from mjsim.values.errors import EnvironmentConfigError
from mjsim.values.observation import ObjectStatus, Observation

HANDLING_TIME = 2.0  # approximate duration of a pick or place, in seconds


class RewardFunction(Protocol):
    """Protocol for functions that compute the reward for an environment step."""

    def __call__(self, scene: Scene, before: Observation, after: Observation) -> float:
        """Return the reward for the step from `before` to `after`."""
        ...


@dataclass(frozen=True)
class TimeReward:
    """A reward that penalizes elapsed time, with optional potential-based shaping.

    The shaping term is `shaping * (discount * potential(after) - potential(before))`, where the potential is
    the negative estimated time to finish. Even with a poor estimate, this term does not change the optimal
    policy of an agent that uses the same discount factor (Ng, Harada and Russell 1999).

    Attributes:
        per_second: Penalty per second of elapsed time.
        shaping: Weight of the shaping term. If it is 1, an estimated second counts as much as an elapsed one.
        discount: The agent's discount factor per environment step, from 0 to 1.

    Raises:
        EnvironmentConfigError: A value is not finite, or `discount` is not from 0 to 1.
    """

    per_second: float = 1.0
    shaping: float = 0.0
    discount: float = 1.0

    def __post_init__(self) -> None:
        if not 0.0 <= self.discount <= 1.0:
            raise EnvironmentConfigError(f"discount must be 0 to 1, got {self.discount}")
        if not (math.isfinite(self.per_second) and math.isfinite(self.shaping)):
            raise EnvironmentConfigError(
                f"per_second and shaping must be finite, got {self.per_second} and {self.shaping}"
            )

    def __call__(self, scene: Scene, before: Observation, after: Observation) -> float:
        reward = -self.per_second * (after.time - before.time)
        if self.shaping:
            gain = self.discount * potential(scene, after) - potential(scene, before)
            reward += self.shaping * gain
        return reward


def potential(scene: Scene, observation: Observation) -> float:
    """Return the negative estimated time to finish in seconds, for straight walks with single objects."""
    status = observation.object_status
    bins = np.array(
        [scene.receptacles[scene.episode.targets[n]].center[:2] for n in observation.object_names]
    )
    loose = np.array([s is ObjectStatus.LOOSE for s in status])
    carried = np.array([s is ObjectStatus.CARRIED for s in status])
    objects = observation.object_positions[:, :2]
    walk = np.linalg.norm(bins - objects, axis=1)[loose].sum()
    walk += np.linalg.norm(bins - observation.position, axis=1)[carried].sum()
    if loose.any() and carried.sum() < CAPACITY:
        walk += np.linalg.norm(objects - observation.position, axis=1)[loose].min()
    handling = HANDLING_TIME * (2 * loose.sum() + carried.sum())
    return -float(walk / scene.person.walking_speed + handling)


REWARDS: dict[str, RewardFunction] = {"time": TimeReward(), "shaped": TimeReward(shaping=1.0)}
