"""The state of a session and what the person pressed; one thread receives, another one steps."""

import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec

from experiments.web.controls import Input
from experiments.web.protocol import MAX_SILENCE, State
from experiments.web.state import PAUSED, READY, RUNNING, SessionPhase, Trigger

MAX_NOTES = 1000  # that wait for a control step
Note = tuple[str, dict[str, Any]]  # name and fields of an event of the log


class SessionControl:
    """Thread-safe queue of inputs, and the state machine of a session; `announce` is called with every new state."""

    def __init__(self, announce: Callable[[State], None]) -> None:
        self.state = State()
        self._announce = announce
        self._inputs: list[Input] = []
        self._until: int | None = (
            None  # all inputs for the control steps before it have come; None if none is promised
        )
        self._notes: list[Note] = []
        self._changed = threading.Condition()
        self._ready = 0.0  # when the session could first be started, monotonic
        self._heard = time.monotonic()  # when the page was heard last

    def apply(self, trigger: Trigger, reason: str = "", *, last: int | None = None) -> None:
        """Change the state as the table says; `last` is the number of the last input of a restored session."""
        with self._changed:
            before = self.state if last is None else msgspec.structs.replace(self.state, input=last)
            after = before.after(trigger, reason)
            if after is before:
                return
            self.state = after
            if after.phase is PAUSED:
                self._note("pause", reason=reason)
                self._inputs = [new.at_rest() for new in self._inputs]
                self._until = None
            elif (before.phase, after.phase) == (PAUSED, RUNNING):
                self._note("resume")
            elif after.phase is READY:
                self._ready = time.monotonic()
            elif (before.phase, after.phase) == (READY, RUNNING):
                self._note("started", waited_s=round(time.monotonic() - self._ready, 3))
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
                self._until = max(until, self._until or 0)
                self._changed.notify_all()

    def hear(self) -> None:
        """The page gave a sign of life."""
        with self._changed:
            self.pause_if_silent()
            self._heard = time.monotonic()

    def pause_if_silent(self) -> None:
        """Stop the clock of a page that gave no sign of life for a while."""
        with self._changed:
            if self.state.phase is RUNNING and time.monotonic() - self._heard > MAX_SILENCE:
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

    def wait_for_inputs(self, step: int, seconds: float) -> bool:
        """Wait until all inputs for a control step have come, or the session stops, but no longer than `seconds`.

        Returns whether they have come; a page that promises nothing is not waited for.
        """
        with self._changed:
            return self._changed.wait_for(
                lambda: self.state.phase is not RUNNING or self._until is None or self._until > step, seconds
            )

    def take_notes(self) -> list[Note]:
        """All that is to be logged since the last call."""
        with self._changed:
            taken, self._notes = self._notes, []
        return taken

    def wait_for_change(self, phase: SessionPhase, seconds: float) -> None:
        """Wait until the session has left a phase, but no longer than `seconds`."""
        with self._changed:
            self._changed.wait_for(lambda: self.state.phase is not phase, seconds)

    def _note(self, event: str, **fields: Any) -> None:
        self._notes.append((event, {**fields, "wall": round(time.time(), 3)}))
