"""The world: one person, one house, stepped at a fixed control rate."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjsim.actions import Action, ActionResult, Pick, Place, WorldEvent
from mjsim.errors import ActionError, PhysicsError, StateError
from mjsim.fidelity import make_tier
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.health.values import Health, HealthSample
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout
from mjsim.world_state import WorldState


@dataclass(frozen=True, eq=False)
class StepResult:
    """The result of one control step.

    Attributes:
        observation: State after the step.
        result: Answer to a pick or place, None for a move.
        events: What happened in the physics during the step.
    """

    observation: Observation
    result: ActionResult | None
    events: tuple[WorldEvent, ...]


class World:
    """A running episode.

    During a pick or place (`Observation.busy`) a `Move` is ignored and another `Pick` or `Place` is refused. A
    refused action leaves the world exactly as `IDLE` would.

    Attributes:
        scene: The composed episode; its model is never modified.
        options: The rules, and how much of the world is physics (docs/fidelity.md).
    """

    def __init__(self, scene: Scene, options: WorldOptions | None = None) -> None:
        """Start at the beginning of the episode.

        Raises:
            AssetError: The scene has no person, or an object lacks a grip site.
            PhysicsError: The control step is not a multiple of the model's timestep.
        """
        self.scene = scene
        self.options = options or WorldOptions()
        _check_timestep(scene.model, self.options.control_timestep)
        self._tier = make_tier(scene, self.options)
        self.reset()

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.scene.model

    @property
    def data(self) -> mujoco.MjData:
        """The state, for rendering and rays; read-only. Get it anew after every step."""
        return self._tier.data

    def copy_data(self, into: mujoco.MjData | None = None) -> mujoco.MjData:
        """A copy of `data`, to draw while the world goes on; in one made before, where it is given."""
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
    def locomotion(self) -> LocomotionState | None:
        """What walking depends on, for kernels of `mjsim.fidelity.kinematics`; None while physics moves the person."""
        return self._tier.locomotion

    def reset(self) -> Observation:
        """Return to the episode's beginning; the same actions then lead to bit-identical states."""
        self._tier.reset()
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
        too (`mjsim.world_state`).

        Raises:
            StateError: The state does not fit the scene, or is of another fidelity.
        """
        try:
            self._tier.restore(state)
        except (ValueError, IndexError) as error:  # of arrays that have other shapes
            raise StateError(f"the state's details do not fit this version's worlds: {error}") from error
        return self._tier.observation()

    def step(self, action: Action) -> StepResult:
        """Advance by one control step.

        Raises:
            ActionError: `action` is not an action.
            PhysicsError: MuJoCo warned or the state is not finite; call `reset` before stepping on.
        """
        result = self._tier.step(action)
        return StepResult(self._tier.observation(), result, tuple(self._tier.episode_state.events))

    def answer(self, action: Pick | Place) -> ActionResult:
        """What `step` would answer to a pick or place now; nothing changes.

        Raises:
            ActionError: `action` is neither.
        """
        return self._tier.answer(action)

    def walk(self, moves: ArrayLike) -> Rollout:
        """Take one control step per row, as `step(Move(*row))` would; stop early after a step with events.

        Args:
            moves: Columns forward, left (m/s), turn and look (rad/s), shape (n, 4).

        Raises:
            ActionError: A pick or place is under way, or the moves have another shape or are not finite.
            PhysicsError: As in `step`.
        """
        rows = np.ascontiguousarray(moves, dtype=np.float64)
        if self.busy:
            raise ActionError("a pick or place is under way; `finish` it before walking")
        if rows.ndim != 2 or rows.shape[1] != 4 or not np.isfinite(rows).all():
            raise ActionError(f"moves must be finite numbers of shape (n, 4), got shape {rows.shape}")
        return self._tier.walk(rows)

    def finish(self) -> Rollout:
        """Step with `IDLE` until no pick or place is under way; no step at all when none is.

        Stops early after a step with events, as `walk` does. If the motion has not ended then, the world is still busy.

        Raises:
            PhysicsError: As in `step`.
        """
        return self._tier.finish()

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
