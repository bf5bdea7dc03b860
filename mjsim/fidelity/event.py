"""No physics but for the fall of a released object: picks and places are worked out at once, and then played."""

import numpy as np

from mjsim.actions import ActionResult, EventKind, Pick
from mjsim.fidelity.kinematic_steps import TIME
from mjsim.fidelity.kinematic_tier import ActiveMotion, KinematicTier
from mjsim.fidelity.motion_planner import PlannedMotion
from mjsim.rollout import Rollout, RolloutArrays


class Event(KinematicTier):
    """The tier `event`."""

    def finish(self) -> Rollout:
        """Play the motion under way to its end, or until a step brings events."""
        self.episode_state.events = []
        if self._motion is None:
            return self.walk(np.zeros((0, 4)))
        rows = self._play_and_report(self._motion, _next_stop(self._motion))
        self._in_step = False
        return self._rollout(rows, self.episode_state.events)

    def _plan(self, result: ActionResult, hand: int, item: int) -> PlannedMotion:
        return self._planner.plan(result, hand, item)

    def _advance_motion(self, motion: ActiveMotion) -> None:
        self._play_and_report(motion, motion.played + 1)

    def _play_and_report(self, motion: ActiveMotion, until: int) -> RolloutArrays:
        """Play a motion up to control step `until`, and report the events of the last one."""
        plan, state, item = motion.plan, self.episode_state, motion.item
        before = float(plan.trajectory.vectors[until - 2, TIME]) if until > 1 else self.time
        rows = self._play(motion, until)
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


def _next_stop(motion: ActiveMotion) -> int:
    """The control step up to which a motion can be played at once: the next one with an incident, or the last one."""
    incidents = (step + 1 for step, _, _ in motion.plan.incidents if step >= motion.played)
    return min(incidents, default=motion.plan.length)
