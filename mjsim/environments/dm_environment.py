"""The rearrangement environment with the dm_env interface."""

from typing import Any

import dm_env
import numpy as np
from dm_env import specs

from mjsim.environments.core import MAX_SEED, Rearrangement
from mjsim.environments.options import build, parse_options


def make(*, seed: int | None = None, **options: Any) -> "RearrangeDmEnvironment":
    """Create a rearrangement environment with the dm_env interface.

    Args:
        seed: Seed of the first episode, which also seeds the generator for later episodes. Random by default.
        **options: Fields of `mjsim.environments.EnvironmentOptions`.

    Raises:
        EnvironmentConfigError: An option is unknown or invalid.
        AssetError: The house is malformed.

    Example:
        >>> env = make(objects=2, seed=0, observations=("state", "in_view"), actions="discrete")
        >>> env.reset().observation["in_view"].shape
        (2,)
        >>> env.step(0).last()  # walk 0.25 m
        False
    """
    return RearrangeDmEnvironment(build(parse_options(options)), seed=seed)


class RearrangeDmEnvironment(dm_env.Environment):  # type: ignore[misc]  # dm_env has no types
    """The rearrangement task as a dm_env environment.

    The last step has discount 0 if all objects have been delivered. If the time limit truncates the episode,
    the discount is 1, so that a critic still bootstraps.
    """

    def __init__(self, core: Rearrangement, *, seed: int | None = None) -> None:
        self.core = core
        self._next_seed = seed
        self._rng = np.random.default_rng(seed)
        self._is_running = False

    @property
    def physics(self) -> Any:
        """The current state as a `dm_control.mujoco.Physics` object, which dm_control's viewer requires.

        Before the first reset, this is the start state of the first episode.
        """
        if not self.core.has_episode:
            if self._next_seed is None:
                self._next_seed = int(self._rng.integers(MAX_SEED))
            self.core.prepare(self._next_seed)
        return self.core.episode.physics

    def reset(self) -> dm_env.TimeStep:
        seed, self._next_seed = self._next_seed, None
        observation, _ = self.core.reset_random(self._rng) if seed is None else self.core.reset(seed)
        self._is_running = True
        return dm_env.restart(observation)

    def step(self, action: Any) -> dm_env.TimeStep:
        """Execute an action. If the episode is over or has not started, start the next episode instead.

        Raises:
            ActionError: The action does not conform to its spec.
            PhysicsError: MuJoCo issued a warning. The episode is over.
        """
        if not self._is_running:
            return self.reset()
        self._is_running = False  # stays False if `step` raises an error
        taken = self.core.step(action)
        if taken.terminated:
            return dm_env.termination(taken.reward, taken.observation)
        if taken.truncated:
            return dm_env.truncation(taken.reward, taken.observation)
        self._is_running = True
        return dm_env.transition(taken.reward, taken.observation)

    def observation_spec(self) -> dict[str, specs.Array]:
        return self.core.observation_spec

    def action_spec(self) -> specs.BoundedArray:
        return self.core.action_spec

    def close(self) -> None:
        self._is_running = False
        self.core.close()
