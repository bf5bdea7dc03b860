"""The world of a running episode, in which a person acts in a house at a fixed control rate."""

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

MAX_STEPS = 1000  # default maximum number of control steps per action

_STOPS = {ARRIVED: Stop.ARRIVED, BLOCKED: Stop.BLOCKED, CHANGED: Stop.CHANGED}


@dataclass(frozen=True, eq=False)
class StepResult:
    """The result of an action.

    Attributes:
        observation: State after the last control step.
        result: Answer to a pick or place, or None for other actions.
        events: Physical events during the last control step. Any event stops the action.
        stopped: Reason why the action stopped.
        steps: Control steps that were executed, and the states between them.
    """

    observation: Observation
    result: ActionResult | None
    events: tuple[WorldEvent, ...]
    stopped: Stop
    steps: Steps


class World:
    """A running episode that can be advanced, reset, saved and restored.

    During a pick or place (`Observation.busy`), a `Move` is ignored and a second `Pick` or `Place` is
    refused. A refused action has the same effect as `IDLE`. The progress along a path is not part of the
    state. `reset` clears it, but `restore` does not change it.

    Attributes:
        scene: The composed episode, whose model is never modified.
        options: Options of the world, including its fidelity (docs/simulation.md).

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
        """Create a world at the start of an episode.

        Args:
            scene: The composed episode.
            options: Options of the world, by default `WorldOptions()`.
            walls: Outline of the floor that a person on a path may use to walk around objects, as edges
                (x, y, x, y) in metres, shape (e, 4). By default, the person may use the whole floor.

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
        """The compiled MuJoCo model."""
        return self.scene.model

    @property
    def data(self) -> mujoco.MjData:
        """The `MjData` for rendering and ray casts. Do not modify it, and read it again after each step."""
        return self._tier.data

    def copy_data(self, into: mujoco.MjData | None = None) -> mujoco.MjData:
        """Return a copy of `data`, stored in `into` if given. It can be rendered while the world advances."""
        copied = mujoco.MjData(self.model) if into is None else into
        mujoco.mj_copyData(copied, self.model, self.data)
        return copied

    @property
    def control_timestep(self) -> float:
        """Duration of a control step, in seconds."""
        return self.options.control_timestep

    @property
    def health(self) -> Health:
        """The physics problems since the last reset, such as the deepest penetration."""
        return self._tier.health

    @property
    def health_sample(self) -> HealthSample:
        """The physics problems in the latest control step."""
        return self._tier.health_sample

    @property
    def busy(self) -> bool:
        """True while a pick or place is in progress."""
        return self._tier.busy

    @property
    def body(self) -> NDArray[np.float64]:
        """A copy of the body state, shape (BODY_SIZE,), with the layout of `mjsim.world.body.rig`."""
        return self._tier.body

    @property
    def hands(self) -> NDArray[np.float64]:
        """A copy of the positions of the left and right hand in the body frame, in metres, shape (2, 3)."""
        return self._tier.hands

    @property
    def blocked(self) -> bool:
        """True if the person is blocked on a path and has not yet resumed walking after backing off."""
        return self._walker.blocked

    def reset(self) -> Observation:
        """Return to the start of the episode. Repeating the same actions leads to bit-identical states."""
        self._tier.reset()
        self._walker.reset()
        return self._tier.observation()

    def state_hash(self) -> int:
        """Return a 64-bit hash of the physics state."""
        return self._tier.state_hash()

    def state(self) -> WorldState:
        """Return the complete state of the world, which can be passed to `restore`.

        Raises:
            StateError: A pick or place is in progress.
        """
        if self.busy:
            raise StateError(
                f"the world is busy at t = {self._tier.time:.2f} s; take its state between motions"
            )
        return self._tier.state()

    def restore(self, state: WorldState) -> Observation:
        """Continue from a state of this world, or of another world with the same scene and options.

        This resets the physics. If the world from which the state was taken is to continue identically, the
        state must be restored there too (see `mjsim.world.state`).

        Raises:
            StateError: The state belongs to another scene or to another fidelity.
        """
        try:
            self._tier.restore(state)
        except (ValueError, IndexError) as error:  # raised if an array has the wrong shape
            raise StateError(f"the state's details do not fit this version's worlds: {error}") from error
        return self._tier.observation()

    def step(self, action: Action, limit: int = MAX_STEPS) -> StepResult:
        """Execute an action for one control step, or for up to `limit` steps if it is a path or a wait.

        Args:
            action: Action that the person performs.
            limit: Maximum number of control steps, at least 1.

        Raises:
            ActionError: `action` is not an action.
            PhysicsError: MuJoCo reported a warning, or the state is not finite. Call `reset` before stepping.
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
        self._walker.record(phase, seen.time)
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
        steps = (time - TIME_TOLERANCE - now) / self.control_timestep
        return limit if steps >= limit else max(1, math.ceil(steps))

    def _result(self, steps: Steps, stopped: Stop, result: ActionResult | None = None) -> StepResult:
        events = tuple(self._tier.episode_state.events)
        return StepResult(self._tier.observation(), result, events, Stop.EVENT if events else stopped, steps)

    def answer(self, action: Pick | Place) -> ActionResult:
        """Return the result that `step` would return for a pick or place, without executing the action.

        Raises:
            ActionError: `action` is neither a pick nor a place.
        """
        return self._tier.answer(action)

    def observation(self) -> Observation:
        """Return the current observation."""
        return self._tier.observation()


def _check_timestep(model: mujoco.MjModel, control_timestep: float) -> None:
    ratio = control_timestep / model.opt.timestep
    if round(ratio) < 1 or not np.isclose(ratio, round(ratio), rtol=0, atol=1e-9):
        raise PhysicsError(
            f"control step {control_timestep} s is not a whole multiple of the model's timestep "
            f"{model.opt.timestep} s; choose one that is"
        )
