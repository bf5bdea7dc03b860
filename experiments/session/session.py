"""The main loop of a session, which is shared by live trials and replays."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

from experiments.errors import RecordError, SessionError, UserCodeError, describe
from experiments.participants.base import Participant
from experiments.record.phases import ALL_DELIVERED, ERROR, INTERRUPTED, PHYSICS_ERROR, TIME_LIMIT
from experiments.record.reader import Record
from experiments.record.writer import RecordWriter
from experiments.session.assistant import Assistant
from experiments.session.perception import SessionPercept
from experiments.session.signals import signal_of
from experiments.session.user_code import decide, needs_of
from hud.projection import CameraView
from hud.state import HudState
from mjsim.values.actions import IDLE, Action, ActionResult, StepAction, WorldEvent
from mjsim.values.errors import PhysicsError
from mjsim.values.observation import ObjectStatus, Observation, Steps
from mjsim.world.world import World

# logged events with a cause outside the simulation, which a replay repeats
EXTERNAL_EVENTS = ("scroll", "overrun", "started", "pause", "resume", "blur", "display", "draw")
FINAL_HOLD = 1.6  # how long the viewer continues after the last delivery, in seconds


class Viewer(Protocol):
    """The interface of viewers, which receive the state of every control step, for example to film it."""

    def camera(self, world: World) -> CameraView | None:
        """Return the eye camera through which the HUD is seen, or None for a third-person view."""
        ...

    def show(self, world: World, observation: Observation, hud_state: HudState) -> None: ...


@dataclass(frozen=True)
class Progress:
    """The simulated time and the number of delivered objects in a session."""

    time: float
    delivered: int
    total: int


OnProgress = Callable[[Progress], None]


class Session:
    """A trial, which lasts until all objects are delivered or the time limit is reached.

    Args:
        world: Newly created world.
        assistant: Assistant that makes plans and determines what the HUD shows.
        participant: Participant who performs the task.
        record: Writer that stores control steps, checkpoints and events.
        time_limit: Simulated time in seconds after which the session ends.
        viewer: Viewer that receives every control step, or None. Without a viewer, many control steps of a
            walk or a wait are simulated at once, with the same result.

    Attributes:
        shows_each_step: False if the viewer receives only the control steps for which `show` is called.
    """

    def __init__(
        self,
        world: World,
        assistant: Assistant,
        participant: Participant,
        record: RecordWriter,
        *,
        time_limit: float,
        viewer: Viewer | None = None,
    ) -> None:
        self.shows_each_step = True
        self._world = world
        self.assistant = assistant
        self._participant = participant
        self.record, self._log = record, record.log
        self._time_limit = time_limit
        self._viewer = viewer
        self._answer: ActionResult | None = None
        self._hud: tuple[Observation, HudState] | None = None
        self._restored_step = -1

    def run(self, on_progress: OnProgress = lambda _: None) -> str:
        """Run the session and return the reason for its end: `all delivered`, `time limit` or `interrupted`.

        Raises:
            SessionError: The participant requires guidance that the assistance condition does not show.
            PhysicsError: The physics failed. The event log contains the time.
        """
        self.begin()
        return self.finish(on_progress)

    def begin(self) -> None:
        """Make and show the first plan before the simulation starts. Raises the same errors as `run`."""
        self._now = self._world.reset()
        self._first_state = self._now, self._world.health_sample, self._world.state_hash()
        try:
            self.assistant.begin(self._now)
        except UserCodeError as error:
            self._log_end(self._now.time, ERROR, error=describe(error))
            raise
        self._start(self._now)

    def _start(self, observation: Observation) -> None:
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
        """Run a session to its end after `begin`. The result and the errors are those of `run`."""
        try:
            while (reason := self.end_reason) is None:
                self.advance()
                on_progress(self.progress)
            self.end(reason)
        except KeyboardInterrupt as stop:
            self.end(INTERRUPTED, signal=signal_of(stop).name)
            return INTERRUPTED
        except Exception as error:
            self.fail(error)
            raise
        return reason

    def end(self, reason: str, **details: str) -> None:
        """End the session and log the reason. The last state is recorded unless the run was interrupted."""
        if reason != INTERRUPTED:
            self._record_end(reason)
        self.assistant.finish(self._now.time)
        self._log_end(self._now.time, reason, **details)

    def fail(self, error: Exception) -> None:
        reason = PHYSICS_ERROR if isinstance(error, PhysicsError) else ERROR
        self._log_end(self.record.time, reason, error=describe(error))

    @property
    def observation(self) -> Observation:
        return self._now

    @property
    def time(self) -> float:
        """Simulated time in seconds."""
        return self._now.time

    @property
    def progress(self) -> Progress:
        return Progress(self._now.time, self._delivered, len(self._now.object_names))

    @property
    def end_reason(self) -> str | None:
        """Reason why the session ended, or None while it continues."""
        if self._delivered == len(self._now.object_names):
            return ALL_DELIVERED
        return TIME_LIMIT if self._now.time >= self._time_limit - 1e-9 else None

    def advance(self) -> None:
        """Let the participant act once. A walk or a wait can take many control steps."""
        self._observe()
        if self.assistant.is_custom:
            self._hud_state()  # detects a faulty condition even if there is no viewer
        world = self._world
        percept = SessionPercept(
            self._now, self._answer, world, self.assistant, self._hud_state, blocked=world.blocked
        )
        self._step(decide(self._participant, percept), self._step_limit())

    def restore(self, record: Record, step: int | None) -> None:
        """Restore a session from the checkpoint before a recorded step, or from the start if `step` is None.

        The assistant observes the recorded steps again, because checkpoints do not contain the assistant's
        state. Raises StateError if the checkpoint does not match the world.
        """
        if step is None:
            self.begin()
            return
        restored = self._world.restore(record.checkpoint(step))
        self._now = record.observation(0)
        self.assistant.begin(self._now)
        for before in range(step):
            self._now = record.observation(before + 1)
            self.assistant.observe_recorded(self._now, record.events_of(before))
        self.record.restore(record, step)
        self._restored_step = step
        self._start(restored)

    def resume(self, record: Record) -> None:
        """Restore the end of an unfinished record by simulating the actions after its last checkpoint again.

        Raises RecordError if the simulated states differ from the recorded ones.
        """
        self.restore(record, max(record.checkpoint_steps, default=None))
        for step in range(self.record.step, record.steps):
            self.repeat_events(record, step)
            self.repeat(record.action(step))
            if self.record.last_state_hash != record.recording["state_hash"][step]:
                raise RecordError(
                    f"step {step} leads to another state than the recorded one; the record was made by another "
                    "version or on another machine"
                )
        self.record.restore(record, record.steps)

    def repeat(self, action: StepAction) -> None:
        """Execute a recorded action. Raises PhysicsError if the physics fails."""
        self._observe()
        self._step(action, 1)

    def repeat_events(self, record: Record, step: int) -> None:
        """Repeat the external events logged before a control step, such as scrolling the task list."""
        if step == self._restored_step:
            return
        first = record.events_before(step - 1) if step else 0
        for event in record.events[first : record.events_before(step)]:
            kind, fields = event["event"], {name: event[name] for name in event if name not in ("t", "event")}
            if kind == "scroll":
                self.scroll(fields["rows"])
            elif kind in EXTERNAL_EVENTS:
                self.note(kind, **fields)

    def note(self, event: str, **fields: Any) -> None:
        """Log an external event at the current simulated time."""
        self._log.append(self._now.time, event, **fields)

    def scroll(self, rows: int) -> None:
        """Scroll the task list by a number of rows, positive towards its end, and log the event."""
        self.note("scroll", rows=rows)
        self.assistant.board.scroll(rows)
        self._hud = None

    def _log_end(self, time: float, reason: str, **details: str) -> None:
        if not self.record.step:
            self.record.append(*self._first_state, Steps(IDLE))
        self._log.append(time, "end", reason=reason, **details)

    def _observe(self) -> None:
        self._now = self.record.pass_checkpoint(self._world, self._now)
        if self.shows_each_step:
            self.show()

    def _step_limit(self) -> int:
        if self._viewer is not None or self.assistant.expecting:
            return 1
        left = int((self._time_limit - self._now.time) / self._world.control_timestep) - 1
        return max(1, left if self._now.busy else min(left, self.record.steps_to_checkpoint(self._world)))

    def _step(self, action: Action, limit: int) -> None:
        before = self._now, self._world.health_sample, self._world.state_hash()
        try:
            step = self._world.step(action, limit)
        except PhysicsError as error:
            self.record.append(*before, error.steps)
            raise
        self.record.append(*before, step.steps)
        self._now, self._answer = step.observation, step.result
        if step.result is not None:
            self._log_attempt(step.result)
        if step.steps.passed is not None:
            self.assistant.observe_walk(step.steps.passed.position, self._now)
        self._log_events(step.events)

    def _record_end(self, reason: str) -> None:
        if reason == ALL_DELIVERED:
            self.assistant.board.show_message("finished", self._now.time)
        self.record.append(self._now, self._world.health_sample, self._world.state_hash(), Steps(IDLE))
        end = self._now
        while reason == ALL_DELIVERED and self._viewer is not None and self._now.time < end.time + FINAL_HOLD:
            self.show()
            self._now = self._world.step(IDLE).observation
        self._now = end

    def _log_events(self, events: tuple[WorldEvent, ...]) -> None:
        for event in events:
            self._log.append(event.time, event.kind.value, object=event.object, receptacle=event.receptacle)
        self.assistant.observe(self._now, events)
        if events:
            self._delivered = len(self._now.names_with(ObjectStatus.DELIVERED))

    def _log_attempt(self, result: ActionResult) -> None:
        time, refusal = self._now.time, result.refusal.value if result.refusal else None
        kind = type(result.action).__name__.lower()
        self._log.append(
            time, "attempt", action=kind, object=result.object, applied=result.applied, refusal=refusal
        )
        if refusal is not None:
            self.assistant.board.show_message(refusal, time, result.object)

    def _hud_state(self) -> HudState:
        if self._hud is None or self._hud[0] is not self._now:
            camera = self._viewer.camera(self._world) if self._viewer is not None else None
            self._hud = self._now, self.assistant.hud_state(self._now, camera)
        return self._hud[1]

    def show(self) -> None:
        """Pass the current state to the viewer, if there is one."""
        if self._viewer is not None:
            self._viewer.show(self._world, self._now, self._hud_state())
