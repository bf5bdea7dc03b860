"""Physics while something is picked up or put away; in between the person walks without it."""

from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, Move
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_world import Walker
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.fidelity.motion_planner import MotionPlanner
from mjsim.fidelity.motion_primitives import Script
from mjsim.fidelity.tier import by_steps
from mjsim.fidelity.transitions import enter, leave
from mjsim.health.values import Health, HealthSample
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout
from mjsim.world_state import WorldState


@dataclass(eq=False)
class _Approach:
    """What of a pick or place comes before physics: braking, turning, the reach of a pick, and bringing over the slot.

    Attributes:
        script: The state after each control step.
        length: How many.
        result: The answer that it was begun with.
        hand: Hand that does it.
        item: Object that it does it to.
        pitch: Where the head was told to look before, rad.
        played: Control steps so far.
    """

    script: Script
    length: int
    result: ActionResult
    hand: int
    item: int
    pitch: float
    played: int = 0


class Windows:
    """The tier `windows`.

    With a pick or place that is feasible the person first brakes and turns, and reaches for what is picked or brings
    what is placed over its slot, still without physics: nothing is touched until then. Then a window opens. Its
    physics starts from exactly the state of the walk, and always from a reset, so that what happens in a window
    depends on that state alone. It closes after the first control step at which the motion has ended and everything
    that nobody holds sleeps or is slow.

    Attributes:
        episode_state: Who holds what, what is put away, what happened in the latest control step.
    """

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        self._scene, self._options = scene, options
        self._full = Full(scene, options)
        self.episode_state = self._full.episode_state
        self._walker = Walker(scene, options, self._full.person.rig, self._full.carrying)
        self._motion_planner = MotionPlanner(self._full, self._walker)
        self._coming: _Approach | None = None
        self._open = False
        self._written = False

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays."""
        self._write()
        return self._full.data

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._full.time if self._open else self._walker.time

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return self._coming is not None or self._full.busy

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        return self._full.health

    @property
    def health_sample(self) -> HealthSample:
        """What the physics was like in the latest control step."""
        return self._full.health_sample if self._open else self._walker.health_sample

    @property
    def locomotion(self) -> LocomotionState | None:
        """What the walk depends on; None while physics or a motion moves the person."""
        return None if self._open or self.busy else self._walker.locomotion

    def reset(self) -> None:
        """Return to the episode's beginning."""
        self._full.reset()
        self._walker.reset(self._full.data)
        self._coming, self._open, self._written = None, False, False

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step."""
        if self._open:
            result = self._full.step(action)
            self._close_if_calm()
            return result
        result = None
        if not isinstance(action, Move):
            self._write()
            result = self._full.resolve(action, busy=self.busy)
            if result is not None and result.applied:
                self._coming = self._approach(result)
        self.episode_state.events = []
        self._written = False
        if self._coming is None:
            self._walker.step(action if isinstance(action, Move) else IDLE)
        elif self._coming.played < self._coming.length:
            self._walker.play(self._coming.script, self._coming.played, self._coming.played + 1)
            self._coming.played += 1
        else:
            self._open_window(self._coming)
        return result

    def walk(self, moves: NDArray[np.float64]) -> Rollout:
        """One control step per row (n, 4), until a step brings events."""
        if not self._open:
            self.episode_state.events = []
            self._written = self._written and not len(moves)
            return self._walker.stretch(self._walker.rows(moves), self.episode_state)
        steps = iter(moves.tolist())
        physical = by_steps(self, (Move(*next(steps)) for _ in moves if self._open))
        rest = moves[len(physical) :]
        if physical.events or not len(rest):
            return physical
        return physical.then(self.walk(rest))

    def finish(self) -> Rollout:
        """Idle until no pick or place is under way, or a step brings events."""
        return by_steps(self, iter(lambda: IDLE if self.busy else None, None))

    def observation(self) -> Observation:
        """The present state."""
        if self._open:
            return self._full.observation()
        return self._walker.observation(self.episode_state, busy=self.busy)

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return self._full.state_hash() if self._open else self._walker.state_hash()

    def state(self) -> WorldState:
        """Everything from which `restore` goes on."""
        if self._open:
            return self._full.state()
        return WorldState(self._walker.pack(), self.episode_state.details(self._full.monitor.get_state()))

    def restore(self, state: WorldState) -> None:
        """Go on from a state.

        Raises:
            StateError: It does not fit.
        """
        self._coming, self._open = None, state.details.person is not None
        if self._open:
            self._full.restore(state)
            return
        self._full.reset()
        self._walker.unpack(state.physics)
        self.episode_state.restore(state.details)
        self._full.monitor.set_state(state.details.health)
        self._written = False

    def _write(self) -> None:
        if not self._open and not self._written:
            self._walker.write(self._full.data)
            self._written = True

    def _approach(self, result: ActionResult) -> _Approach:
        """How the person gets to where physics has to begin."""
        hand, item = self._full.hand_for(result)
        pitch = self._walker.pitch_target
        script, length = self._motion_planner.approach(result, hand, item)
        return _Approach(script, length, result, hand, item, pitch)

    def _open_window(self, approach: _Approach) -> None:
        """Let the physics go on from where the person has come to, with one control step."""
        enter(self._full, self._walker)
        self._coming, self._open = None, True
        self._full.take_up(approach.result, approach.hand, approach.item, approach.pitch)
        self._full.advance(IDLE)
        self._close_if_calm()

    def _close_if_calm(self) -> None:
        full = self._full
        if full.busy:
            return
        if full.calm(self._options.settle_speed):
            leave(full, self._walker)
            self._open = False
