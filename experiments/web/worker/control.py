"""The state of a session and what the person pressed; one thread receives, another one steps."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from experiments.web.controls import Input
from experiments.web.protocol import MAX_SILENCE, State
from experiments.web.state import PAUSED, READY, RUNNING, SessionPhase, Trigger

MAX_NOTES = 1000  # that wait for a control step
MAX_PROMISES = 64  # whose times are remembered
Note = tuple[str, dict[str, Any]]  # name and fields of an event of the log


class Promise(NamedTuple):
    """Whether the inputs of a control step are there: since when, monotonic; None where nothing was promised."""

    came: float | None
    missing: bool  # whether they were promised, and are not there


class SessionControl:
    """Thread-safe queue of inputs, and the state machine of a session.

    Args:
        announce: Called with every new state.
        now: A clock, s.
    """

    def __init__(self, announce: Callable[[State], None], now: Callable[[], float] = time.monotonic) -> None:
        self.state = State()
        self._now = now
        self._announce = announce
        self._inputs: list[Input] = []
        # promises, the oldest first: all inputs for control steps before the first number have come, and when
        self._promises: deque[tuple[int, float]] = deque(maxlen=MAX_PROMISES)
        self._notes: list[Note] = []
        self._changed = threading.Condition()
        self._asked = False  # to be shown at once
        self._ready = 0.0  # when the session could first be started, monotonic
        self._heard = now()  # when the page was heard last

    def apply(
        self, trigger: Trigger, reason: str = "", *, last: int | None = None, until: int | None = None
    ) -> None:
        """Change the state as the table says.

        `last` is the number of the last input of a restored session, `until` what a page promises that lets the clock
        run.
        """
        with self._changed:
            before = self.state if last is None else msgspec.structs.replace(self.state, input=last)
            after = before.after(trigger, reason)
            if after is before:
                return
            self.state = after
            if until is not None:
                self._promise(until)
            if after.phase is PAUSED:
                self._note("pause", reason=reason)
                self._inputs = [new.at_rest() for new in self._inputs]
                self._promises.clear()
            elif (before.phase, after.phase) == (PAUSED, RUNNING):
                self._note("resume")
            elif after.phase is READY:
                self._ready = self._now() if self._asked else 0.0
            elif (before.phase, after.phase) == (READY, RUNNING):
                self._note("started", waited_s=round(self._now() - self._ready, 3))
            self._announce(after)
            self._changed.notify_all()

    def add(self, inputs: list[Input], until: int | None = None) -> None:
        """Queue the inputs that are new; a browser that reconnects repeats those that were not acknowledged.

        `until` promises that all inputs for the control steps before it have come.
        """
        with self._changed:
            running = self.state.phase is RUNNING
            for new in inputs:
                if new.number > self.state.input:
                    self._inputs.append(new if running else new.at_rest())
                    self.state = msgspec.structs.replace(self.state, input=new.number)
            if until is not None and running:
                self._promise(until)

    def hear(self) -> None:
        """The page gave a sign of life."""
        with self._changed:
            self.pause_if_silent()
            self._heard = self._now()

    def pause_if_silent(self) -> None:
        """Stop the clock of a page that gave no sign of life for a while."""
        with self._changed:
            if self.state.phase is RUNNING and self._now() - self._heard > MAX_SILENCE:
                self.apply(Trigger.PAUSE, "silent")

    def note(self, event: str, **fields: Any) -> None:
        """Note something that the page told, for the log; too much of it is dropped."""
        with self._changed:
            if len(self._notes) < MAX_NOTES:
                self._note(event, **fields)

    def take_inputs(self, step: int) -> tuple[Input, ...]:
        """The inputs that count at a control step, in order: those for it, for earlier ones, and for none."""
        with self._changed:
            later = (i for i, new in enumerate(self._inputs) if new.step is not None and new.step > step)
            count = next(later, len(self._inputs))
            taken, self._inputs = tuple(self._inputs[:count]), self._inputs[count:]
        return taken

    def wait_for_promise(self, step: int, seconds: float) -> Promise:
        """Wait until all inputs for a control step have come, or the session stops, but no longer than `seconds`.

        A page that promises nothing is not waited for.
        """
        with self._changed:
            self._changed.wait_for(
                lambda: self.state.phase is not RUNNING or not self._promises or self._promises[-1][0] > step,
                seconds,
            )
            promises = self._promises
            while len(promises) > 1 and promises[0][0] <= step:
                promises.popleft()
            if not promises:
                return Promise(None, missing=False)
            until, came = promises[0]
            return Promise(came, missing=False) if until > step else Promise(None, missing=True)

    def take_notes(self) -> list[Note]:
        """All that is to be logged since the last call."""
        with self._changed:
            taken, self._notes = self._notes, []
        return taken

    def ask_to_show(self) -> None:
        """Somebody has just connected, or has another view."""
        with self._changed:
            self._asked = True
            self._ready = self._ready or self._now()
            self._changed.notify_all()

    def wait_for_change(self, phase: SessionPhase, seconds: float) -> None:
        """Wait until the session has left a phase or is to be shown, but no longer than `seconds`."""
        with self._changed:
            self._changed.wait_for(lambda: self._asked or self.state.phase is not phase, seconds)
            self._asked = False

    def _promise(self, until: int) -> None:
        if not self._promises or until > self._promises[-1][0]:
            self._promises.append((until, self._now()))
            self._changed.notify_all()

    def _note(self, event: str, **fields: Any) -> None:
        self._notes.append((event, {**fields, "wall": round(time.time(), 3)}))
