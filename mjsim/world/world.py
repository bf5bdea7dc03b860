"""The world: one person, one house, stepped at a fixed control rate."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike, NDArray

from mjsim.house.scene.scene import Scene
from mjsim.values.actions import (
    IDLE,
    TIME_TOLERANCE,
    Action,
    ActionResult,
    FollowPath,
    Pick,
    Place,
    StepAction,
    Stop,
    Wait,
    WorldEvent,
)
from mjsim.values.errors import PhysicsError, StateError
from mjsim.values.observation import Observation, Steps
from mjsim.values.options import WorldOptions
from mjsim.world.fidelity import make_tier
from mjsim.world.health.monitor import Health, HealthSample
from mjsim.world.state import WorldState
from mjsim.world.walking.path_following import ARRIVED, BLOCKED, CHANGED
from mjsim.world.walking.walker import BACK_OFF, Walker

MAX_STEPS = 1000  # control steps of one action, unless another limit is given

_STOPS = {ARRIVED: Stop.ARRIVED, BLOCKED: Stop.BLOCKED, CHANGED: Stop.CHANGED}


@dataclass(frozen=True, eq=False)
class StepResult:
    """The result of an action.

    Attributes:
        observation: State after the last control step.
        result: Answer to a pick or place, None for the other actions.
        events: What happened in the physics during the last control step; an event stops every action.
        stopped: Why the action stopped.
        steps: The control steps taken, and the states between them.
    """

    observation: Observation
    result: ActionResult | None
    events: tuple[WorldEvent, ...]
    stopped: Stop
    steps: Steps


class World:
    """A running episode.

    During a pick or place (`Observation.busy`) a `Move` is ignored and another `Pick` or `Place` is refused. A
    refused action leaves the world exactly as `IDLE` would. How far the person has got along a path is no part of the
    state: `restore` leaves it as it is, `reset` forgets it.

    Attributes:
        scene: The composed episode; its model is never modified.
        options: The rules, and how much of the world is physics (docs/simulation.md).

    Example:
        >>> import mjsim
        >>> catalogue = mjsim.Catalogue.load("apartment")
        >>> episode = mjsim.sample_episode(catalogue, objects=2, seed=3)
        >>> world = World(mjsim.compose(episode, catalogue))
        >>> step = world.step(mjsim.Move(forward=1.0))
        >>> round(step.observation.time, 2)
        0.04
        >>> world.step(mjsim.Pick()).result.refusal
        <Refusal.NOTHING_IN_REACH: 'nothing_in_reach'>
    """

    def __init__(
        self, scene: Scene, options: WorldOptions | None = None, *, walls: ArrayLike | None = None
    ) -> None:
        """Start at the beginning of the episode.

        Args:
            scene: The composed episode.
            options: The rules; None for the usual ones.
            walls: Outline of the floor on which a person who follows a path passes objects, ends x, y, x, y of its
                edges, m, shape (e, 4); None if all of it is free.

        Raises:
            AssetError: The scene has no person, or an object lacks a grip site.
            PhysicsError: The control step is not a multiple of the model's timestep.
        """
        self.scene = scene
        self.options = options or WorldOptions()
        _check_timestep(scene.model, self.options.control_timestep)
        self._tier = make_tier(scene, self.options)
        outline = np.zeros((0, 4)) if walls is None else np.ascontiguousarray(walls, np.float64)
        self._walker = Walker(scene.person, outline)
        self.reset()

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.scene.model

    @property
    def data(self) -> mujoco.MjData:
        """The state, for rendering and rays; read-only. Read it anew after every step."""
        return self._tier.data

    def copy_data(self, into: mujoco.MjData | None = None) -> mujoco.MjData:
        """A copy of `data`, to draw while the world is stepped; in an earlier copy, if it is given."""
        copied = mujoco.MjData(self.model) if into is None else into
        mujoco.mj_copyData(copied, self.model, self.data)
        return copied

    @property
    def control_timestep(self) -> float:
        """Simulated time of one `step`, s."""
        return self.options.control_timestep

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        return self._tier.health

    @property
    def health_sample(self) -> HealthSample:
        """Health of the physics in the latest control step."""
        return self._tier.health_sample

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return self._tier.busy

    @property
    def body(self) -> NDArray[np.float64]:
        """The person's body as `mjsim.world.fidelity.body_state` lays it out, a copy of shape (BODY_SIZE,)."""
        return self._tier.body

    @property
    def hands(self) -> NDArray[np.float64]:
        """Where the left and the right hand are in the body's frame, m, a copy of shape (2, 3)."""
        return self._tier.hands

    @property
    def blocked(self) -> bool:
        """Whether the path that is followed makes no progress; until the first step after backing off."""
        return self._walker.blocked

    def reset(self) -> Observation:
        """Return to the episode's beginning; the same actions then lead to bit-identical states."""
        self._tier.reset()
        self._walker.reset()
        return self._tier.observation()

    def state_hash(self) -> int:
        """64 bits that differ whenever the state of the physics differs (up to chance)."""
        return self._tier.state_hash()

    def state(self) -> WorldState:
        """The complete state as a value; `restore` continues from it.

        Raises:
            StateError: A pick or place is under way.
        """
        if self.busy:
            raise StateError(
                f"the world is busy at t = {self._tier.time:.2f} s; take its state between motions"
            )
        return self._tier.state()

    def restore(self, state: WorldState) -> Observation:
        """Continue from a state of this world, or of another one of the same scene and options.

        This resets the physics: the world that the state was taken from continues identically only if it is restored,
        too (`mjsim.world.state`).

        Raises:
            StateError: The state does not fit the scene, or is of another fidelity.
        """
        try:
            self._tier.restore(state)
        except (ValueError, IndexError) as error:  # of arrays that have other shapes
            raise StateError(f"the state's details do not fit this version's worlds: {error}") from error
        return self._tier.observation()

    def step(self, action: Action, limit: int = MAX_STEPS) -> StepResult:
        """Carry out an action: one control step for `Move`, `Pick` and `Place`, up to `limit` for the others.

        Args:
            action: What the person does.
            limit: How many control steps to take at most, 1 or more.

        Raises:
            ActionError: `action` is not an action.
            PhysicsError: MuJoCo warned or the state is not finite; call `reset` before the next step.
        """
        if isinstance(action, FollowPath):
            return self._follow(action, limit)
        if isinstance(action, Wait):
            return self._wait(action, limit)
        return self._single_step(action)

    def _single_step(self, action: StepAction, stopped: Stop = Stop.DONE) -> StepResult:
        steps = Steps(action)
        try:
            result = self._tier.step(action)
        except PhysicsError as error:
            error.steps = steps
            raise
        return self._result(steps, stopped, result)

    def _follow(self, action: FollowPath, limit: int) -> StepResult:
        seen = self._tier.observation()
        walk = self._walker.walk(action, seen)
        if walk is None:
            return self._single_step(BACK_OFF, Stop.BLOCKED)
        if action.until is not None:
            limit = self._steps_until(action.until, seen.time, limit)
        phase, steps = self._tier.follow(walk, self._walker.progress, 1 if seen.busy else limit)
        self._walker.note(phase, seen.time)
        if steps is None:
            return self._single_step(action.then or IDLE, Stop.ARRIVED)
        return self._result(steps, _STOPS.get(phase, Stop.DUE))

    def _wait(self, action: Wait, limit: int) -> StepResult:
        if action.until is None:
            limit = limit if self.busy else 1
        else:
            limit = self._steps_until(action.until, self._tier.time, limit)
        steps = self._tier.wait(limit)
        return self._result(steps, Stop.DUE if self.busy else Stop.DONE)

    def _steps_until(self, time: float, now: float, limit: int) -> int:
        """Control steps up to a time, s, at least 1 and at most `limit`."""
        steps = (time - TIME_TOLERANCE - now) / self.control_timestep
        return limit if steps >= limit else max(1, math.ceil(steps))

    def _result(self, steps: Steps, stopped: Stop, result: ActionResult | None = None) -> StepResult:
        events = tuple(self._tier.episode_state.events)
        return StepResult(self._tier.observation(), result, events, Stop.EVENT if events else stopped, steps)

    def answer(self, action: Pick | Place) -> ActionResult:
        """What `step` would answer to a pick or place now; nothing changes.

        Raises:
            ActionError: `action` is neither.
        """
        return self._tier.answer(action)

    def observation(self) -> Observation:
        """The present state."""
        return self._tier.observation()


def _check_timestep(model: mujoco.MjModel, control_timestep: float) -> None:
    ratio = control_timestep / model.opt.timestep
    if round(ratio) < 1 or not np.isclose(ratio, round(ratio), rtol=0, atol=1e-9):
        raise PhysicsError(
            f"control step {control_timestep} s is not a whole multiple of the model's timestep "
            f"{model.opt.timestep} s; choose one that is"
        )
