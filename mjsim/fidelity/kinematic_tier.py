"""Walking without physics, with picks and places that are worked out at once and then played."""

import math
from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, Move, Pick, Place, Refusal, WorldEvent
from mjsim.fidelity.body_state import PITCH, VX, VY, X
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_world import KinematicWorld
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.fidelity.motion_planner import MotionPlanner, PlannedMotion
from mjsim.fidelity.tier import Tier
from mjsim.health.values import Health, HealthSample
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout, RolloutArrays
from mjsim.world_state import WorldState


@dataclass(eq=False)
class ActiveMotion:
    """A planned motion that is being played.

    Attributes:
        plan: The motion.
        result: The answer to the action that began it.
        hand: Hand that does it.
        item: Object.
        pitch: Where the head looked before, rad.
        played: Control steps so far.
    """

    plan: PlannedMotion
    result: ActionResult
    hand: int
    item: int
    pitch: float
    played: int = 0


class KinematicTier(Tier):
    """What `windows` and `event` have in common: everything moves without physics unless the tier says otherwise.

    Attributes:
        episode_state: Hands, statuses, and the events of the latest control step.
    """

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        self._full = Full(scene, options)
        self.episode_state = self._full.episode_state
        self._kinematic = KinematicWorld(self._full, options)
        self._planner = MotionPlanner(self._full, self._kinematic)
        self._motion: ActiveMotion | None = None
        self._in_step = False  # whether the data of the physics show the present state

    @abstractmethod
    def _plan(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        """Work out a feasible pick or place."""

    @abstractmethod
    def _advance_motion(self, motion: ActiveMotion) -> None:
        """One control step of a motion."""

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays."""
        if not self._in_step:
            self._kinematic.write(self._full.data)
            self._in_step = True
        return self._full.data

    def answer(self, action: Pick | Place) -> ActionResult:
        """What the answer to a pick or place would be now."""
        if self.busy:
            return ActionResult(action, Refusal.BUSY, action.object)
        _ = self.data  # the decision reads them
        return self._full.answer(action)

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._kinematic.time

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return self._motion is not None

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        return self._full.health

    @property
    def health_sample(self) -> HealthSample:
        """Held objects are in line with their hands, and nothing else touches anything."""
        left, right = (math.nan if grasp is None else 0.0 for grasp in self._kinematic.grasps)
        return HealthSample(weld_error_m=(left, right), weld_error_rad=(left, right))

    @property
    def locomotion(self) -> LocomotionState | None:
        """What walking depends on; None while the person picks or places."""
        return None if self.busy else self._kinematic.locomotion

    def reset(self) -> None:
        """Return to the episode's beginning."""
        self._full.reset()
        self._kinematic.reset(self._full.data)
        self._motion, self._in_step = None, False

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step."""
        result = None if isinstance(action, Move) else self._begin(action)
        self.episode_state.events = []
        self._in_step = False
        if self._motion is not None:
            self._advance_motion(self._motion)
        else:
            move = action if isinstance(action, Move) else IDLE
            self._kinematic.walk(np.array([[move.forward, move.left, move.turn, move.look]]))
        return result

    def _begin(self, action: Action) -> ActionResult | None:
        """Decide on a pick or place, and plan it if it is feasible."""
        _ = self.data  # the decision reads them
        result = self._full.resolve(action, busy=self.busy)
        if result is not None and result.applied:
            hand, item = self._full.hand_for(result)
            pitch = self._kinematic.pitch_target
            self._motion = ActiveMotion(self._plan(result, hand, item), result, hand, item, pitch)
        return result

    def _play(self, motion: ActiveMotion, until: int) -> RolloutArrays:
        """Play a motion up to control step `until`."""
        rows = self._kinematic.play(motion.plan.trajectory, motion.played, until)
        motion.played = until
        return rows

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4)."""
        self.episode_state.events = []
        self._in_step = self._in_step and not len(moves)
        return self._rollout(self._kinematic.walk(moves))

    def _rollout(self, rows: RolloutArrays, events: Sequence[WorldEvent] = ()) -> Rollout:
        """Rows that end in the present state."""
        return Rollout(rows, self.observation(), tuple(events))

    def observation(self) -> Observation:
        """The present state."""
        body, poses = self._kinematic.body, self._kinematic.state.poses.copy()
        person, velocity, objects = body[X : PITCH + 1], body[VX : VY + 1], (poses[:, :3], poses[:, 3:])
        return self.episode_state.observation(self.time, person, velocity, objects, busy=self.busy)

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return self._kinematic.state_hash()

    def state(self) -> WorldState:
        """Everything that `restore` needs to continue from here."""
        details = self.episode_state.details(self._full.monitor.get_state())
        return WorldState(self._kinematic.pack(), details)

    def restore(self, state: WorldState) -> None:
        """Continue from a state.

        Raises:
            StateError: It does not fit.
        """
        self._kinematic.unpack(state.physics)
        self.episode_state.restore(state.details)
        self._full.monitor.set_state(state.details.health)
        self._motion, self._in_step = None, False
