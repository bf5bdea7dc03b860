"""The state of a session and what the person pressed; one thread receives, another one steps."""

import threading
import time
from collections.abc import Callable
from typing import Any

import msgspec

from experiments.web.controls import Input
from experiments.web.protocol import State
from experiments.web.state import PAUSED, READY, RUNNING, SessionPhase, Trigger

Note = tuple[str, dict[str, Any]]  # name and fields of an event of the log


class SessionControl:
    """Thread-safe queue of inputs, and the state machine of a session; `announce` is called with every new state."""

    def __init__(self, announce: Callable[[State], None]) -> None:
        self.state = State()
        self._announce = announce
        self._inputs: list[Input] = []
        self._notes: list[Note] = []
        self._changed = threading.Condition()
        self._ready = 0.0  # when the session could first be started, monotonic

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
            elif (before.phase, after.phase) == (PAUSED, RUNNING):
                self._note("resume")
            elif after.phase is READY:
                self._ready = time.monotonic()
            elif (before.phase, after.phase) == (READY, RUNNING):
                self._note("started", waited_s=round(time.monotonic() - self._ready, 3))
            self._announce(after)
            self._changed.notify_all()

    def add(self, inputs: list[Input]) -> None:
        """Queue the inputs that are new; a browser that reconnects repeats those that were not acknowledged."""
        with self._changed:
            for new in inputs:
                if new.number > self.state.input:
                    self._inputs.append(new)
                    self.state = msgspec.structs.replace(self.state, input=new.number)

    def note(self, event: str, **fields: Any) -> None:
        """Note something that the page told, for the log."""
        with self._changed:
            self._note(event, **fields)

    def take_inputs(self) -> tuple[Input, ...]:
        """All inputs since the last call."""
        with self._changed:
            taken, self._inputs = tuple(self._inputs), []
        return taken

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
