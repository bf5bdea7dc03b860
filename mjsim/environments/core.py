"""The rearrangement task, which the dm_env and Gymnasium environments wrap."""

import contextlib
import math
from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.control import Control
from mjsim.environments.episodes import CompiledEpisode, EpisodeCache
from mjsim.environments.rewards import RewardFunction
from mjsim.environments.sensors import SENSORS, Sensor, SensorInput
from mjsim.environments.sensors.base import ObservationLayout
from mjsim.environments.sensors.vision import visible_pixels
from mjsim.values.actions import EventKind
from mjsim.values.errors import (
    ActionError,
    EnvironmentConfigError,
    EnvironmentStateError,
    PhysicsError,
    SamplingError,
)
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.world.world import StepResult, World

ObservationDict = dict[str, NDArray[Any]]
"""A mapping from sensor names to observation arrays."""
MAX_SEED = 2**31 - 1
MAX_DRAWS = 10  # maximum number of seeds that `reset_random` tries before it raises an error


@dataclass(frozen=True, eq=False)
class Transition:
    """The result of one environment step."""

    observation: ObservationDict
    reward: float
    terminated: bool  # True if all objects have been delivered
    truncated: bool  # True if the time limit or a physics error ended the episode
    info: dict[str, Any]  # values for logging and statistics
    steps: tuple[StepResult, ...]  # results of the control steps, in order


class Rearrangement:
    """A task in which an agent carries misplaced objects to their receptacles.

    `episodes` compiles the episode for a seed, `sensors` compute the arrays of an observation, and `control`
    converts agent actions. Physics errors are raised, or truncate the episode if
    `truncate_on_physics_error` is True. `on_control_step`, if set, is called after every control step.

    Compiled models and ongoing motions cannot be pickled. A copied or unpickled task is therefore created by
    `rebuild` and replays the actions of the current episode. Equal seeds and actions lead to equal states.
    """

    def __init__(
        self,
        episodes: EpisodeCache,
        layout: ObservationLayout,
        *,
        sensors: Sequence[Sensor],
        control: Control,
        reward: RewardFunction,
        rebuild: Callable[[], "Rearrangement"],
        truncate_on_physics_error: bool = False,
    ) -> None:
        self.layout = layout
        self.sensors = tuple(sensors)
        self.control = control
        self.on_control_step: Callable[[World], None] | None = None
        self._episodes = episodes
        self._reward = reward
        self._rebuild = rebuild
        self._truncate_on_error = truncate_on_physics_error
        self._own_sensors = [s for s in self.sensors if SENSORS.get(s.name) is not s]
        self._images = frozenset[str]().union(*(s.images for s in sensors))
        self._episode: CompiledEpisode | None = None
        self._state: Observation  # state after the latest step, set by `reset`
        self._seed = 0
        self._actions: list[Any] = []  # actions executed in the current episode
        self._is_over = True
        self._last_observation: ObservationDict = {}

    def __reduce__(self) -> tuple[Any, ...]:
        progress = (self._seed, self._actions) if self._actions or not self._is_over else None
        return _restored, (self._rebuild, progress)

    @property
    def observation_spec(self) -> dict[str, specs.Array]:
        """Specifications of the observation arrays, by sensor name."""
        return {s.name: s.spec(self.layout) for s in self.sensors}

    @property
    def action_spec(self) -> specs.BoundedArray:
        """The specification of an action."""
        return self.control.spec()

    @property
    def has_episode(self) -> bool:
        """True if `prepare` or `reset` was called since the last `close`."""
        return self._episode is not None

    @property
    def episode(self) -> CompiledEpisode:
        """The current compiled episode. Raises an EnvironmentStateError before the first reset."""
        if self._episode is None:
            raise EnvironmentStateError("there is no episode yet; call reset first")
        return self._episode

    @property
    def world(self) -> World:
        """The simulated world, which must not be changed. Raises an EnvironmentStateError before the first reset."""
        return self.episode.world

    @property
    def state(self) -> Observation:
        """The current state. Raises an EnvironmentStateError before the first reset."""
        return self.world.observation()

    def prepare(self, seed: int) -> None:
        """Compile the episode for a seed without starting it."""
        self._episode, self._is_over = self._episodes.get(seed), True
        self._seed, self._actions = seed, []

    def reset(self, seed: int) -> tuple[ObservationDict, dict[str, Any]]:
        """Start the episode for a seed. Return the first observation and the info dictionary.

        Raises:
            SamplingError: The objects for this seed do not fit into the house.
            AssetError: A model is malformed.
            RenderError: A sensor needs an image, but images cannot be rendered.
        """
        self.prepare(seed)
        self._is_over = False
        self._state = self.world.reset()
        inputs = self._sensor_input(self._state)
        return self._observe(inputs), self._info(inputs, ())

    def reset_random(self, rng: np.random.Generator) -> tuple[ObservationDict, dict[str, Any]]:
        """Start an episode with a random seed. Raise a SamplingError after `MAX_DRAWS` failed attempts."""
        for _ in range(MAX_DRAWS - 1):
            try:
                return self.reset(int(rng.integers(MAX_SEED)))
            except SamplingError:
                continue
        return self.reset(int(rng.integers(MAX_SEED)))

    def step(self, action: Any) -> Transition:
        """Execute an action until it is complete or the episode ends.

        Raises:
            EnvironmentStateError: The episode is over or has not started.
            ActionError: The action does not conform to its spec.
            PhysicsError: MuJoCo issued a warning, and `truncate_on_physics_error` is False. The episode is over.
        """
        world = self.world
        if self._is_over:
            raise EnvironmentStateError("the episode is over; call reset before the next step")
        self._actions.append(copy(action))  # copied because the agent may reuse its array
        before = self._state
        steps, error = self._run(world, action, before)
        after = self._state = steps[-1].observation if steps else before
        terminated, timed_out = self._end(after)
        self._is_over = terminated or timed_out or error is not None
        inputs = self._sensor_input(after)
        return Transition(
            # The state is invalid after a physics error, so the last observation is returned again.
            observation=self._observe(inputs) if error is None else _copied(self._last_observation),
            reward=self._compute_reward(world, before, after),
            terminated=terminated,
            truncated=self._is_over and not terminated,
            info=self._info(inputs, steps, error),
            steps=steps,
        )

    def rgb(self, width: int, height: int, profile: str) -> NDArray[np.uint8]:
        """Render the current first-person view as a uint8 array of shape (height, width, 3).

        Raises:
            EnvironmentStateError: There is no episode yet.
            RenderError: No OpenGL context can be created.
        """
        return self.episode.renderer(width, height, profile).rgb(self.world.data)

    def close(self) -> None:
        """Free all compiled episodes. A later reset compiles its episode again."""
        self._episode, self._is_over, self._actions = None, True, []
        self._episodes.close()

    def _run(
        self, world: World, action: Any, before: Observation
    ) -> tuple[tuple[StepResult, ...], PhysicsError | None]:
        commands = self.control.steps(action, before, world)
        results: list[StepResult] = []
        command = next(commands)
        while True:
            try:
                results.append(world.step(command))
            except PhysicsError as error:
                self._is_over = True
                if not self._truncate_on_error:
                    raise
                return tuple(results), error
            if self.on_control_step is not None:
                self.on_control_step(world)
            if any(self._end(results[-1].observation)):
                commands.close()
                return tuple(results), None
            try:
                command = commands.send(results[-1])
            except StopIteration:
                return tuple(results), None

    def _end(self, observation: Observation) -> tuple[bool, bool]:
        """Return whether the task is complete, and whether it has timed out."""
        done = observation.object_status.count(ObjectStatus.DELIVERED) == len(observation.object_names)
        return done, not done and observation.time >= self.layout.time_limit - 1e-9

    def _sensor_input(self, state: Observation) -> SensorInput:
        return SensorInput(self.layout, self.episode, state, self._images)

    def _compute_reward(self, world: World, before: Observation, after: Observation) -> float:
        given = self._reward(world.scene, before, after)
        try:
            reward = math.nan if isinstance(given, str) else float(given)
        except (TypeError, ValueError):
            reward = math.nan
        if not math.isfinite(reward):
            raise EnvironmentConfigError(
                f"the reward is {given!r:.200}; it must be a finite number{_place(self._reward)}"
            )
        return reward

    def _observe(self, inputs: SensorInput) -> ObservationDict:
        arrays = {s.name: s.read(inputs) for s in self.sensors}
        for sensor in self._own_sensors:
            try:
                array = arrays[sensor.name] = sensor.spec(self.layout).validate(arrays[sensor.name])
                finite = np.isfinite(array).all()
            except (TypeError, ValueError) as error:
                raise EnvironmentConfigError(
                    f"sensor {sensor.name!r}: {error}{_place(sensor.read)}"
                ) from error
            if not finite:
                raise EnvironmentConfigError(
                    f"sensor {sensor.name!r}: not all is finite{_place(sensor.read)}"
                )
        if self._truncate_on_error:
            self._last_observation = _copied(arrays)
        return arrays

    def _info(
        self, inputs: SensorInput, steps: Sequence[StepResult], error: PhysicsError | None = None
    ) -> dict[str, Any]:
        state = inputs.state
        delivered = state.object_status.count(ObjectStatus.DELIVERED)
        kinds = [event.kind for step in steps for event in step.events]
        refusals = [s.result.refusal for s in steps if s.result is not None and s.result.refusal is not None]
        info: dict[str, Any] = {
            "episode_seed": self._seed,
            "time": state.time,
            "objects": len(state.object_names),
            "delivered": delivered,
            "is_success": delivered == len(state.object_names),
            "picked": kinds.count(EventKind.PICKED),
            "placed": kinds.count(EventKind.PLACED),
            "refusal": refusals[0].value if refusals else "",
        }
        if error is not None:
            info["physics_error"] = str(error)
        elif "segmentation" in self._images:
            info["visible"] = visible_pixels(inputs)
        return info


def _restored(rebuild: Callable[[], Rearrangement], progress: tuple[int, list[Any]] | None) -> Rearrangement:
    core = rebuild()
    if progress is not None:
        seed, actions = progress
        core.reset(seed)
        for action in actions:
            with contextlib.suppress(ActionError, PhysicsError):  # the original run raised the same error
                core.step(action)
    return core


def _place(code: object) -> str:
    found = getattr(code, "__code__", None)
    return f" ({found.co_filename}, line {found.co_firstlineno})" if found is not None else ""


def _copied(observation: ObservationDict) -> ObservationDict:
    return {name: array.copy() for name, array in observation.items()}
