"""No physics but for the fall of what is let go of: picks and places are worked out at once, and then played."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, EventKind, Move, Pick
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import Rows
from mjsim.fidelity.kinematic_world import Walker
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.fidelity.motion_planner import MotionPlanner, Plan
from mjsim.health.values import Health, HealthSample
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout
from mjsim.world_state import WorldState


@dataclass(eq=False)
class _Motion:
    """A pick or place that is being played."""

    plan: Plan
    result: ActionResult
    hand: int
    item: int
    played: int = 0

    @property
    def halt(self) -> int:
        """Where to stop next: at the first step with an incident, or the last one."""
        return min(
            (step for step, _, _ in self.plan.incidents if step >= self.played), default=self.plan.length - 1
        )


class Event:
    """The tier `event`.

    Attributes:
        episode_state: Who holds what, what is put away, what happened in the latest control step.
    """

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        self._scene = scene
        self._full = Full(scene, options)
        self.episode_state = self._full.episode_state
        self._walker = Walker(scene, options, self._full.person.rig, self._full.carrying)
        self._motion_planner = MotionPlanner(self._full, self._walker)
        self._motion: _Motion | None = None
        self._written = False

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays."""
        if not self._written:
            self._walker.write(self._full.data)
            self._written = True
        return self._full.data

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._walker.time

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
        """What the physics was like in the latest control step."""
        return self._walker.health_sample

    @property
    def locomotion(self) -> LocomotionState | None:
        """What the walk depends on; None while the person picks or places."""
        return None if self.busy else self._walker.locomotion

    def reset(self) -> None:
        """Return to the episode's beginning."""
        self._full.reset()
        self._walker.reset(self._full.data)
        self._motion, self._written = None, False

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step."""
        result = None
        if not isinstance(action, Move):
            _ = self.data
            result = self._full.resolve(action, busy=self.busy)
            if result is not None and result.applied:
                self._motion = self._begin(result)
        self.episode_state.events = []
        if self._motion is None:
            self._walker.step(action if isinstance(action, Move) else IDLE)
        else:
            self._play(self._motion, self._motion.played + 1)
        self._written = False
        return result

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4)."""
        self.episode_state.events = []
        self._written = self._written and not len(moves)
        return self._walker.stretch(self._walker.rows(moves), self.episode_state)

    def finish(self) -> Rollout:
        """Play what is under way to its end, or until a step brings events."""
        self.episode_state.events = []
        if self._motion is None:
            return self.walk(np.zeros((0, 4)))
        rows = self._play(self._motion, self._motion.halt + 1)
        self._written = False
        return self._walker.stretch(
            rows, self.episode_state, busy=self.busy, events=self.episode_state.events
        )

    def observation(self) -> Observation:
        """The present state."""
        return self._walker.observation(self.episode_state, busy=self.busy)

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return self._walker.state_hash()

    def state(self) -> WorldState:
        """Everything from which `restore` goes on."""
        return WorldState(self._walker.pack(), self.episode_state.details(self._full.monitor.get_state()))

    def restore(self, state: WorldState) -> None:
        """Go on from a state.

        Raises:
            StateError: It does not fit.
        """
        self._walker.unpack(state.physics)
        self.episode_state.restore(state.details)
        self._full.monitor.set_state(state.details.health)
        self._motion, self._written = None, False

    def _begin(self, result: ActionResult) -> _Motion:
        hand, item = self._full.hand_for(result)
        if isinstance(result.action, Pick):
            return _Motion(self._motion_planner.pick(hand, item), result, hand, item)
        receptacle = self._scene.receptacles[str(result.receptacle)]
        return _Motion(self._motion_planner.place(hand, item, receptacle), result, hand, item)

    def _play(self, motion: _Motion, until: int) -> Rows:
        """Go on to control step `until` of a motion, and report what happened in the last one."""
        walker, plan = self._walker, motion.plan
        before = float(plan.script.live[until - 2, 0]) if until > 1 else walker.time
        rows = walker.play(plan.script, motion.played, until)
        motion.played = until
        for step, kind, item in plan.incidents:
            if step == until - 1 and kind is EventKind.DISLODGED:
                self.episode_state.dislodged(walker.time, item)
            elif step == until - 1:
                self.episode_state.report(walker.time, kind, item)
        if until == plan.length:
            self._motion = None
            if isinstance(motion.result.action, Pick):
                self.episode_state.picked(before, motion.hand, motion.item, plan.success)
            else:
                self.episode_state.placed(before, motion.item, motion.result.receptacle, plan.success)
        return rows
