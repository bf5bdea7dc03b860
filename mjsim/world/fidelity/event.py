"""Fidelity `event`, in which picks and places are planned in advance. Physics moves only falling objects."""

import math
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene.scene import Scene
from mjsim.values.actions import IDLE, ActionResult, EventKind, Move, Pick, Place, Refusal, StepAction
from mjsim.values.observation import Observation, Steps, StepStates
from mjsim.values.options import WorldOptions
from mjsim.world.body.rig import PITCH, VX, VY, X
from mjsim.world.fidelity.full import Full
from mjsim.world.fidelity.kinematic_steps import TIME
from mjsim.world.fidelity.kinematic_world import MAX_ROWS, KinematicWorld
from mjsim.world.fidelity.motion_planner import MotionPlanner, PlannedMotion
from mjsim.world.fidelity.tier import Tier
from mjsim.world.health.monitor import Health, HealthSample
from mjsim.world.state import WorldState
from mjsim.world.walking.path_following import Walk


@dataclass(eq=False)
class ActiveMotion:
    """A planned motion that is in progress."""

    plan: PlannedMotion
    result: ActionResult  # result of the action that started the motion
    hand: int
    item: int
    played: int = 0  # number of control steps played so far

    @property
    def next_stop(self) -> int:
        """The next control step at which an event occurs, or the last control step if there is none."""
        incidents = (step + 1 for step, _, _ in self.plan.incidents if step >= self.played)
        return min(incidents, default=self.plan.length)


class Event(Tier):
    """A kinematic simulation of the person, in which picks and places follow planned trajectories."""

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        self._full = Full(scene, options)
        self.episode_state = self._full.episode_state
        self._kinematic = KinematicWorld(self._full, options)
        self._planner = MotionPlanner(self._full, self._kinematic)
        self._motion: ActiveMotion | None = None
        self._in_step = False  # True if the physics data are up to date

    @property
    def data(self) -> mujoco.MjData:
        """The physics data for rendering and ray casts, updated to the current state."""
        if not self._in_step:
            self._kinematic.write(self._full.data)
            self._in_step = True
        return self._full.data

    def answer(self, action: Pick | Place) -> ActionResult:
        if self.busy:
            return ActionResult(action, Refusal.BUSY, action.object)
        _ = self.data  # update the physics data, which `Full.answer` reads
        return self._full.answer(action)

    @property
    def time(self) -> float:
        return self._kinematic.time

    @property
    def busy(self) -> bool:
        return self._motion is not None

    @property
    def body(self) -> NDArray[np.float64]:
        return self._kinematic.body.copy()

    @property
    def hands(self) -> NDArray[np.float64]:
        return self._kinematic.hands.copy()

    @property
    def health(self) -> Health:
        return self._full.health

    @property
    def health_sample(self) -> HealthSample:
        # Held objects are aligned exactly with the hands, and there are no contacts.
        left, right = (math.nan if grasp is None else 0.0 for grasp in self._kinematic.grasps)
        return HealthSample(weld_error_m=(left, right), weld_error_rad=(left, right))

    def reset(self) -> None:
        self._full.reset()
        self._kinematic.reset(self._full.data)
        self._motion, self._in_step = None, False

    def step(self, action: StepAction) -> ActionResult | None:
        result = None if isinstance(action, Move) else self._begin(action)
        self.episode_state.events = []
        self._in_step = False
        if self._motion is not None:
            self._play(self._motion, self._motion.played + 1)
        else:
            move = action if isinstance(action, Move) else IDLE
            self._kinematic.walk(np.array([[move.forward, move.left, move.turn, move.look]]))
        return result

    def follow(self, walk: Walk, progress: NDArray[np.float64], limit: int) -> tuple[int, Steps | None]:
        if self.busy:
            return super().follow(walk, progress, limit)
        self.episode_state.events = []
        phase, moves, states = self._kinematic.follow(walk, progress, limit)
        if not len(moves):
            return phase, None
        self._in_step = False
        return phase, Steps(moves, states)

    def wait(self, limit: int) -> Steps:
        self.episode_state.events = []
        self._in_step = False
        limit = min(limit, MAX_ROWS)
        if self._motion is None:
            moves = np.zeros((limit, 4))
            return Steps(moves, self._kinematic.walk(moves))
        before, until = self._motion.played, min(self._motion.played + limit, self._motion.next_stop)
        return Steps(np.zeros((until - before, 4)), self._play(self._motion, until))

    def observation(self) -> Observation:
        body, poses = self._kinematic.body, self._kinematic.state.poses.copy()
        person, velocity, objects = body[X : PITCH + 1], body[VX : VY + 1], (poses[:, :3], poses[:, 3:])
        return self.episode_state.observation(self.time, person, velocity, objects, busy=self.busy)

    def state_hash(self) -> int:
        return self._kinematic.state_hash()

    def state(self) -> WorldState:
        details = self.episode_state.details(self._full.monitor.get_state())
        return WorldState(self._kinematic.pack(), details)

    def restore(self, state: WorldState) -> None:
        self._kinematic.unpack(state.physics)
        self.episode_state.restore(state.details)
        self._full.monitor.set_state(state.details.health)
        self._motion, self._in_step = None, False

    def _begin(self, action: StepAction) -> ActionResult | None:
        _ = self.data  # update the physics data, which `Full.resolve` reads
        result = self._full.resolve(action, busy=self.busy)
        if result is not None and result.applied:
            hand, item = self._full.hand_for(result)
            self._motion = ActiveMotion(self._planner.plan(result, hand, item), result, hand, item)
        return result

    def _play(self, motion: ActiveMotion, until: int) -> StepStates | None:
        plan, state, item = motion.plan, self.episode_state, motion.item
        before = float(plan.trajectory.vectors[until - 2, TIME]) if until > 1 else self.time
        rows = self._kinematic.play(plan.trajectory, motion.played, until)
        motion.played = until
        for step, kind, which in plan.incidents:
            if step == until - 1 and kind is EventKind.DISLODGED:
                state.dislodged(self.time, which)
            elif step == until - 1:
                state.report(self.time, kind, which)
        if until == plan.length:
            self._motion = None
            if isinstance(motion.result.action, Pick):
                state.picked(before, motion.hand, item, plan.success)
            else:
                state.placed(before, item, motion.result.receptacle, plan.success)
        return rows
