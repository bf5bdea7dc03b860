"""The one loop: observe, show, let the user act, step the world. A script, a person and a replay all run in it."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import SessionError, UserCodeError
from experiments.participants.base import Decision, Participant, Wait, WalkAlong
from experiments.runs.recording import Recording
from experiments.runs.trajectory import Trajectory
from experiments.session.assistant import Assistant
from experiments.session.endings import ALL_DELIVERED, ERROR, INTERRUPTED, PHYSICS_ERROR, TIME_LIMIT
from experiments.session.locomotion import LocomotionController
from experiments.session.perception import SessionPercept
from experiments.session.recorded_rollout import roll_out
from experiments.session.user_code import decide, describe, needs_of
from experiments.session.viewer import OnProgress, Progress, Viewer
from experiments.signals import signal_of
from hud.state import HudState
from mjsim.actions import IDLE, Action, ActionResult, WorldEvent
from mjsim.errors import PhysicsError
from mjsim.observation import ObjectStatus, Observation
from mjsim.rollout import Rollout
from mjsim.world import World

FINAL_HOLD = 1.6  # s the session goes on after the last delivery, so that the person sees that all is done
MAX_MOTION = 30.0  # s; no pick or place takes as long


class Session:
    """One trial from the start pose until everything is delivered or the time is up.

    Args:
        world: The physics, freshly made.
        assistant: Plans and says what the HUD shows.
        participant: The user.
        recording: Takes hashes and checkpoints; its log takes the events.
        walls: Outline of the navigable floor, ends x, y, x, y of its edges, m, shape (e, 4).
        time_limit: Simulated time after which the session ends, s.
        viewer: Sees every control step, or None.
        rollouts: Take many control steps at once where nobody watches them and they can be foreseen. The run is
            the same without.

    Attributes:
        assistant: As above.
        trajectory: Poses and actions so far.
        recording: Hashes and checkpoints so far.
        rollouts: Whether many control steps are taken at once; may be switched off.
    """

    def __init__(
        self,
        world: World,
        assistant: Assistant,
        participant: Participant,
        recording: Recording,
        *,
        walls: NDArray[np.float64],
        time_limit: float,
        viewer: Viewer | None = None,
        rollouts: bool = True,
    ) -> None:
        self._world = world
        self.assistant = assistant
        self._participant = participant
        self._log = recording.log
        self._time_limit = time_limit
        self._viewer = viewer
        self.rollouts = rollouts and viewer is None
        self._controller = LocomotionController(walls, world.scene.person)
        self._answer: ActionResult | None = None
        self._on_progress: OnProgress = lambda _: None
        self._hud: tuple[Observation, HudState] | None = None
        self._recorded_until = 0.0
        self.trajectory = Trajectory(world.scene.index.names)
        self.recording = recording

    def run(self, on_progress: OnProgress = lambda _: None) -> str:
        """Run from the start to the end; returns why it ended: `all delivered`, `time limit` or `interrupted`.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
            PhysicsError: The physics failed; the log says when.
        """
        self.begin()
        return self.finish(on_progress)

    def begin(self) -> None:
        """Make the first plan and show it; nothing is simulated yet.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
            UserCodeError: A condition of somebody's own failed.
        """
        self._now = self._world.reset()
        try:
            self.assistant.begin(self._now)
        except UserCodeError as error:
            self._log_end(self._now.time, ERROR, error=describe(error))
            raise
        self.start(self._now)

    def start(self, observation: Observation) -> None:
        """Start from where the world and the assistant are now.

        Raises:
            SessionError: The participant needs guidance that the assistance condition does not show.
        """
        self._now = observation
        self._delivered = len(observation.names_with(ObjectStatus.DELIVERED))
        shown, needs = self.assistant.shown_roles, needs_of(self._participant)
        if not needs <= shown:
            name = type(self._participant).__qualname__
            raise SessionError(
                f"participant {name} needs {sorted(needs)} markers but the assistance condition shows "
                f"{sorted(shown) or 'none'}; choose another --user or --assistance"
            )

    def finish(self, on_progress: OnProgress = lambda _: None) -> str:
        """Go on to the end, once started; returns and raises as `run` does. Whatever ends the session is logged."""
        self._on_progress = on_progress
        try:
            while (reason := self.end_reason) is None:
                self.advance()
                on_progress(self.progress)
            self.end(reason)
        except KeyboardInterrupt as stop:
            self.end(INTERRUPTED, signal=signal_of(stop).name)
            return INTERRUPTED
        except Exception as error:
            reason = PHYSICS_ERROR if isinstance(error, PhysicsError) else ERROR
            self._log_end(self._recorded_until, reason, error=describe(error))
            raise
        return reason

    def end(self, reason: str, **details: str) -> None:
        """End the session, and log why; after the last step its state is recorded."""
        if reason != INTERRUPTED:
            self._record_end(reason)
        self.assistant.finish(self._now.time)
        self._log_end(self._now.time, reason, **details)

    @property
    def progress(self) -> Progress:
        """How far the session has got."""
        return Progress(self._now.time, self._delivered, len(self._now.object_names))

    @property
    def end_reason(self) -> str | None:
        """Why the session is over; None while it goes on."""
        if self._delivered == len(self._now.object_names):
            return ALL_DELIVERED
        return TIME_LIMIT if self._now.time >= self._time_limit - 1e-9 else None

    def advance(self) -> None:
        """Let the participant decide once, and carry that out: one control step, or a rollout of many.

        Raises:
            PhysicsError: The physics failed.
        """
        self._now = self.recording.pass_checkpoint(self._now)
        self.show()
        blocked = self._controller.blocked
        percept = SessionPercept(
            self._now, self._answer, self._world, self.assistant, self._hud_state, blocked=blocked
        )
        decision = decide(self._participant, percept)
        if self.rollouts and self._roll_out(decision):
            return
        if self.rollouts and isinstance(decision, WalkAlong) and decision.shown:
            self._walk_on(decision)
        else:
            self._step(self._controller.action(decision, self._now))

    def note(self, event: str, **fields: Any) -> None:
        """Log something from outside of the simulation, in the present state."""
        self._log.append(self._now.time, event, **fields)

    def scroll(self, rows: int) -> None:
        """Scroll the task list by so many rows, positive towards its end; logged for replays."""
        self.note("scroll", rows=rows)
        self.assistant.scroll(rows)
        self._hud = None

    def _log_end(self, time: float, reason: str, **details: str) -> None:
        """Log the end; a record has one state at least."""
        if not self.recording.step:
            self.recording.append()
        if not len(self.trajectory):
            self.trajectory.append(self._now, IDLE, self._world.health_sample)
        self._log.append(time, "end", reason=reason, **details)

    def _step(self, action: Action) -> None:
        """One control step, observed by everybody."""
        self._note_events(self._recorded_step(action))

    def _recorded_step(self, action: Action) -> tuple[WorldEvent, ...]:
        """One control step, and what happened in it."""
        self._record(action)
        step = self._world.step(action)
        self._now, self._answer = step.observation, step.result
        if step.result is not None:
            self._note_attempt(step.result)
        return step.events

    def _walk_on(self, walk: WalkAlong) -> None:
        """Go on along a shown path without asking again, for as long as the answer would stay the same."""
        asked, positions = self._now, list[NDArray[np.float64]]()
        while not (events := self._recorded_step(self._controller.step(walk, self._now))):
            positions.append(self._now.position)
            over = self._answer is not None or self.end_reason is not None or self.assistant.expecting
            if over or not self._controller.keeps_on(walk, asked, self._now):
                break
            self._on_progress(self.progress)
            self._now = self.recording.pass_checkpoint(self._now)
        if positions:
            self.assistant.observe_walk(np.array(positions), self._now)
        self._note_events(events)

    def _roll_out(self, decision: Decision) -> bool:
        """Carry out many control steps at once, if all of them follow from the decision; whether that was so."""
        if self.assistant.expecting:
            return False
        left = int((self._time_limit - self._now.time) / self._world.control_timestep) - 1
        if isinstance(decision, Wait):
            if not self._now.busy or left * self._world.control_timestep <= MAX_MOTION:
                return False
            self._note_events(self._recorded(None).events)
            return True
        limit = min(left, self.recording.steps_to_checkpoint)
        moves = self._controller.moves(decision, self._now, self._world.locomotion, limit)
        if not len(moves):
            return False
        rollout = self._recorded(moves)
        if isinstance(decision, WalkAlong):
            self._controller.commit(len(rollout))
        self.assistant.observe_walk(
            rollout.states.positions[: len(rollout) - bool(rollout.events)], self._now
        )
        if rollout.events:
            self._note_events(rollout.events)
        return True

    def _recorded(self, moves: NDArray[np.float64] | None) -> Rollout:
        self._recorded_until = self._now.time
        rollout = roll_out(self._world, self._now, moves, self.recording, self.trajectory)
        self._now, self._answer = rollout.observation, None
        return rollout

    def _record(self, action: Action) -> None:
        self._recorded_until = self._now.time
        self.recording.append()
        self.trajectory.append(self._now, action, self._world.health_sample)

    def _record_end(self, reason: str) -> None:
        """Record the last state; let the viewer see for a moment that all is done. That is not measured."""
        if reason == ALL_DELIVERED:
            self.assistant.show_message("finished", self._now.time)
        self._record(IDLE)
        end = self._now
        while reason == ALL_DELIVERED and self._viewer is not None and self._now.time < end.time + FINAL_HOLD:
            self.show()
            self._now = self._world.step(IDLE).observation
        self._now = end

    def _note_events(self, events: tuple[WorldEvent, ...]) -> None:
        """Log what happened in the world and tell the assistant."""
        for event in events:
            self._log.append(event.time, event.kind.value, object=event.object, receptacle=event.receptacle)
        self.assistant.observe(self._now, events)
        if events:
            self._delivered = len(self._now.names_with(ObjectStatus.DELIVERED))

    def _note_attempt(self, result: ActionResult) -> None:
        """Log an attempt to pick or place; a refusal is shown."""
        time, refusal = self._now.time, result.refusal.value if result.refusal else None
        kind = type(result.action).__name__.lower()
        self._log.append(
            time, "attempt", action=kind, object=result.object, applied=result.applied, refusal=refusal
        )
        if refusal is not None:
            self.assistant.show_message(refusal, time, result.object)

    def _hud_state(self) -> HudState:
        """What the HUD shows now; composed once per state, and only when asked for."""
        if self._hud is None or self._hud[0] is not self._now:
            camera = self._viewer.camera(self._world) if self._viewer is not None else None
            self._hud = self._now, self.assistant.hud_state(self._now, camera)
        return self._hud[1]

    def show(self) -> None:
        """Let the viewer see the present state."""
        if self._viewer is not None:
            self._viewer.show(self._world, self._now, self._hud_state())
