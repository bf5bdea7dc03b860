"""The task as one small machine: reset, step, observe. Both public interfaces are thin views of it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.actions import EventKind, WorldEvent
from mjsim.environments.control import Control
from mjsim.environments.episodes import EpisodeSource, Stage
from mjsim.environments.errors import EnvironmentStateError
from mjsim.environments.layout import Layout
from mjsim.environments.rewards import RewardFunction
from mjsim.environments.sensors import Moment, Sensor
from mjsim.environments.sensors.sight import visible_pixels
from mjsim.errors import PhysicsError, SamplingError
from mjsim.observation import ObjectStatus, Observation
from mjsim.render import Frame
from mjsim.world import StepResult, World

ObservationDict = dict[str, NDArray[Any]]
MAX_SEED = 2**31 - 1
DRAWS = 10  # of another seed when a house has no room for the first


@dataclass(frozen=True, eq=False)
class Transition:
    """What one step of the environment brought.

    Attributes:
        observation: Sensor name -> array.
        reward: Of this step.
        terminated: Whether everything is delivered.
        truncated: Whether the time is up, with something left to do.
        info: For people and statistics; no part of the task.
        steps: What each control step of the action brought.
    """

    observation: ObservationDict
    reward: float
    terminated: bool
    truncated: bool
    info: dict[str, Any]
    steps: tuple[StepResult, ...]


class Rearrangement:
    """Tidying up as a task with observations, actions and rewards.

    Args:
        episodes: Where the episodes come from.
        layout: Sizes and scales of the arrays.
        sensors: What is observed.
        control: What can be done.
        reward: What it is worth.
        forgiving: Whether a failure of the physics cuts the episode off instead of being raised.
    """

    def __init__(
        self,
        episodes: EpisodeSource,
        layout: Layout,
        *,
        sensors: Sequence[Sensor],
        control: Control,
        reward: RewardFunction,
        forgiving: bool = False,
    ) -> None:
        self.layout = layout
        self.sensors = tuple(sensors)
        self.control = control
        self._episodes = episodes
        self._reward = reward
        self._forgiving = forgiving
        self._images = frozenset[str]().union(*(s.images for s in sensors))
        self._stage: Stage | None = None
        self._seed = 0
        self._over = True
        self._seen: ObservationDict = {}
        self.on_control_step: Callable[[World], None] | None = None

    @property
    def observation_spec(self) -> dict[str, specs.Array]:
        """Sensor name -> what it gives."""
        return {s.name: s.spec(self.layout) for s in self.sensors}

    @property
    def action_spec(self) -> specs.BoundedArray:
        """What an action is."""
        return self.control.spec()

    @property
    def begun(self) -> bool:
        """Whether there is an episode to look at."""
        return self._stage is not None

    @property
    def stage(self) -> Stage:
        """The compiled episode that runs.

        Raises:
            EnvironmentStateError: Before the first reset.
        """
        if self._stage is None:
            raise EnvironmentStateError("there is no episode yet; call reset first")
        return self._stage

    @property
    def world(self) -> World:
        """The running episode; read only. Raises `EnvironmentStateError` before the first reset."""
        return self.stage.world

    @property
    def state(self) -> Observation:
        """Everything about the present moment; raises `EnvironmentStateError` before the first reset."""
        return self.world.observation()

    def prepare(self, seed: int) -> None:
        """Compile the episode of a seed ahead of its reset.

        Raises:
            SamplingError, AssetError: As for `reset`.
        """
        self._stage, self._over = self._episodes.stage(seed), True

    def reset(self, seed: int) -> tuple[ObservationDict, dict[str, Any]]:
        """Begin the episode of a seed.

        Returns:
            The observation and the info.

        Raises:
            SamplingError: The house has no room for this seed's objects.
            AssetError, RenderError: A model is malformed; images were asked for and cannot be drawn.
        """
        self.prepare(seed)
        self._seed, self._over = seed, False
        moment = self._moment(self.world.reset())
        return self._observe(moment), self._info(moment, ())

    def reset_drawn(self, rng: np.random.Generator) -> tuple[ObservationDict, dict[str, Any]]:
        """Begin the episode of a drawn seed; of another one if the house has no room for the first.

        Raises:
            SamplingError: There was no room in any of several draws.
        """
        for _ in range(DRAWS - 1):
            try:
                return self.reset(int(rng.integers(MAX_SEED)))
            except SamplingError:
                continue
        return self.reset(int(rng.integers(MAX_SEED)))

    def step(self, action: Any) -> Transition:
        """Carry out one action, for as many control steps as it takes or until the episode ends.

        Raises:
            EnvironmentStateError: The episode is over, or none was begun.
            ActionError: The action does not conform to its spec.
            PhysicsError: MuJoCo warned and that is not forgiven; the episode is over.
        """
        world = self.world
        if self._over:
            raise EnvironmentStateError("the episode is over; call reset before the next step")
        before = world.observation()
        steps, failure = self._run(world, action, before)
        after = steps[-1].observation if steps else before
        terminated, truncated = self._ends(after)
        self._over = terminated or truncated or failure is not None
        moment = self._moment(after)
        # A state that the physics failed in cannot be read; what was last seen has to do.
        observation = self._observe(moment) if failure is None else self._seen_again()
        return Transition(
            observation=observation,
            reward=float(self._reward(world.scene, before, after)),
            terminated=terminated,
            truncated=self._over and not terminated,
            info=self._info(moment, steps, failure),
            steps=steps,
        )

    def rgb(self, width: int, height: int, profile: str) -> NDArray[np.uint8]:
        """What the eye sees now, uint8, shape (height, width, 3).

        Raises:
            EnvironmentStateError: Before the first reset.
            RenderError: No OpenGL context could be made.
        """
        return self.stage.renderer(width, height, profile).rgb(self.world.data)

    def close(self) -> None:
        """Free what was compiled; a later reset makes it anew."""
        self._stage, self._over = None, True
        self._episodes.close()

    def _run(
        self, world: World, action: Any, before: Observation
    ) -> tuple[tuple[StepResult, ...], PhysicsError | None]:
        """The control steps of one action, up to its end, the episode's, or a failure that is forgiven."""
        commands = self.control.steps(action, before, world.options)
        results: list[StepResult] = []
        command = next(commands)
        while True:
            try:
                results.append(world.step(command))
            except PhysicsError as failure:
                self._over = True
                if not self._forgiving:
                    raise
                return tuple(results), failure
            if self.on_control_step is not None:
                self.on_control_step(world)
            if any(self._ends(results[-1].observation)):
                commands.close()
                return tuple(results), None
            try:
                command = commands.send(results[-1])
            except StopIteration:
                return tuple(results), None

    def _ends(self, observation: Observation) -> tuple[bool, bool]:
        """Whether the episode is terminated, and whether it is truncated."""
        done = all(s is ObjectStatus.DELIVERED for s in observation.object_status)
        return done, not done and observation.time >= self.layout.time_limit - 1e-9

    def _moment(self, observation: Observation) -> Moment:
        drawn: list[Frame] = []

        def frame() -> Frame:
            if not drawn:
                drawn.append(self._draw())
            return drawn[0]

        return Moment(self.layout, self.world, observation, frame, lambda: self.stage.labels)

    def _draw(self) -> Frame:
        camera = self.layout.camera
        renderer = self.stage.renderer(camera.width, camera.height, camera.profile)
        return renderer.frame(
            self.world.data,
            rgb="rgb" in self._images,
            depth="depth" in self._images,
            segmentation="segmentation" in self._images,
        )

    def _observe(self, moment: Moment) -> ObservationDict:
        seen = {s.name: s.read(moment) for s in self.sensors}
        if self._forgiving:
            self._seen = {name: array.copy() for name, array in seen.items()}
        return seen

    def _seen_again(self) -> ObservationDict:
        return {name: array.copy() for name, array in self._seen.items()}

    def _info(
        self, moment: Moment, steps: Sequence[StepResult], failure: PhysicsError | None = None
    ) -> dict[str, Any]:
        seen = moment.observation
        delivered = len(seen.names_with(ObjectStatus.DELIVERED))
        events = [e for step in steps for e in step.events]
        refusals = [s.result.refusal for s in steps if s.result is not None and s.result.refusal is not None]
        info: dict[str, Any] = {
            "episode_seed": self._seed,
            "time": seen.time,
            "objects": len(seen.object_names),
            "delivered": delivered,
            "is_success": delivered == len(seen.object_names),
            "picked": _count(events, EventKind.PICKED),
            "placed": _count(events, EventKind.PLACED),
            "refusal": refusals[0].value if refusals else "",
        }
        if failure is not None:
            info["physics_error"] = str(failure)
        elif "segmentation" in self._images:
            info["visible"] = visible_pixels(moment)
        return info


def _count(events: Sequence[WorldEvent], kind: EventKind) -> int:
    return sum(e.kind is kind for e in events)
