"""Physics while an object is gripped and lifted or lowered and released; in between the person moves without it."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, Move
from mjsim.fidelity.kinematic_tier import ActiveMotion, KinematicTier
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.fidelity.motion_planner import PlannedMotion
from mjsim.fidelity.transitions import enter, leave
from mjsim.health.values import HealthSample
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout
from mjsim.world_state import WorldState


class Windows(KinematicTier):
    """The tier `windows`.

    At a feasible pick or place the person first brakes and turns, and reaches for the object or brings it over its
    slot, still without physics: nothing is touched until then. Then a window opens. Its physics starts from exactly
    the present state, and always from a reset, so that a window depends on that state alone. It closes after the
    first control step at which the motion has ended and every object that no hand holds sleeps or is slow.
    """

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        super().__init__(scene, options)
        self._settle_speed = options.settle_speed
        self._open = False

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays."""
        return self._full.data if self._open else super().data

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._full.time if self._open else super().time

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return super().busy or self._full.busy

    @property
    def health_sample(self) -> HealthSample:
        """Health of the physics in the latest control step."""
        return self._full.health_sample if self._open else super().health_sample

    @property
    def locomotion(self) -> LocomotionState | None:
        """What walking depends on; None while physics or a motion moves the person."""
        return None if self._open else super().locomotion

    def reset(self) -> None:
        """Return to the episode's beginning."""
        super().reset()
        self._open = False

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step."""
        if not self._open:
            return super().step(action)
        result = self._full.step(action)
        self._close_if_settled()
        return result

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4), until a step brings events."""
        if not self._open:
            return super().walk(moves)
        steps = iter(moves.tolist())
        physical = self.step_each(Move(*next(steps)) for _ in moves if self._open)
        rest = moves[len(physical) :]
        if physical.events or not len(rest):
            return physical
        return physical.followed_by(super().walk(rest))

    def observation(self) -> Observation:
        """The present state."""
        return self._full.observation() if self._open else super().observation()

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return self._full.state_hash() if self._open else super().state_hash()

    def state(self) -> WorldState:
        """Everything that `restore` needs to continue from here."""
        return self._full.state() if self._open else super().state()

    def restore(self, state: WorldState) -> None:
        """Continue from a state.

        Raises:
            StateError: It does not fit.
        """
        self._motion, self._open = None, state.details.person is not None
        if self._open:
            self._full.restore(state)
        else:
            self._full.reset()
            super().restore(state)

    def _plan(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        return self._planner.approach(result, hand, item)

    def _advance_motion(self, motion: ActiveMotion) -> None:
        if motion.played < motion.plan.length:
            self._play(motion, motion.played + 1)
        else:
            self._open_window(motion)

    def _open_window(self, motion: ActiveMotion) -> None:
        """Let the physics continue from the present state, with one control step."""
        enter(self._full, self._kinematic)
        self._motion, self._open = None, True
        self._full.begin(motion.result, motion.hand, motion.item, motion.pitch, reached=True)
        self._full.advance(IDLE)
        self._close_if_settled()

    def _close_if_settled(self) -> None:
        if not self._full.busy and self._full.is_settled(self._settle_speed):
            leave(self._full, self._kinematic)
            self._open = False
