"""The state and the input queue of a session, which the receiving and the stepping thread share."""

import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, NamedTuple

import msgspec

from experiments.web.controls import Input
from experiments.web.protocol import MAX_SILENCE
from experiments.web.state import PAUSED, READY, RUNNING, SessionPhase, State, Trigger

MAX_NOTES = 1000  # maximum number of queued log events
MAX_PROMISES = 64  # maximum number of stored promises of a client (see `Inputs`)
Note = tuple[str, dict[str, Any]]  # name and fields of a log event


class Promise(NamedTuple):
    """The arrival of a control step's promised inputs. `came` is the monotonic arrival time, or None."""

    came: float | None
    missing: bool  # True if promised inputs have not arrived


class SessionControl:
    """A thread-safe state machine and input queue of a session. `announce` is called with each new state."""

    def __init__(self, announce: Callable[[State], None], now: Callable[[], float] = time.monotonic) -> None:
        self.state = State()
        self._now = now
        self._announce = announce
        self._inputs: list[Input] = []
        # Promises, oldest first. Each pair is (control step before which inputs are complete, arrival time).
        self._promises: deque[tuple[int, float]] = deque(maxlen=MAX_PROMISES)
        self._notes: list[Note] = []
        self._changed = threading.Condition()
        self._asked = False  # True if a frame has been requested
        self._ready = 0.0  # monotonic time at which the session became ready, or 0
        self._heard = now()  # monotonic time of the page's last message

    def apply(
        self, trigger: Trigger, reason: str = "", *, last: int | None = None, until: int | None = None
    ) -> None:
        """Change the state according to `TRANSITIONS`.

        `last` is the number of the last input in a restored session. `until` is the first promise of a page
        that starts the clock.
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
        """Queue inputs. Inputs that a reconnected browser sends again are ignored.

        `until` is a promise that all inputs for earlier control steps have arrived.
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
        """Record that the page has sent a message."""
        with self._changed:
            self.pause_if_silent()
            self._heard = self._now()

    def pause_if_silent(self) -> None:
        with self._changed:
            if self.state.phase is RUNNING and self._now() - self._heard > MAX_SILENCE:
                self.apply(Trigger.PAUSE, "silent")

    def note(self, event: str, **fields: Any) -> None:
        """Queue an event for the log. Drop the event if the queue is full."""
        with self._changed:
            if len(self._notes) < MAX_NOTES:
                self._note(event, **fields)

    def take_inputs(self, step: int) -> tuple[Input, ...]:
        """Remove and return all queued inputs before the first input for a later control step."""
        with self._changed:
            later = (i for i, new in enumerate(self._inputs) if new.step is not None and new.step > step)
            count = next(later, len(self._inputs))
            taken, self._inputs = tuple(self._inputs[:count]), self._inputs[count:]
        return taken

    def wait_for_promise(self, step: int, seconds: float) -> Promise:
        """Wait up to `seconds` until all inputs for a control step have arrived or the session stops.

        Return immediately if the page makes no promises.
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
        """Remove and return all queued events for the log."""
        with self._changed:
            taken, self._notes = self._notes, []
        return taken

    def ask_to_show(self) -> None:
        """Request a frame after a new connection or a change of the view."""
        with self._changed:
            self._asked = True
            self._ready = self._ready or self._now()
            self._changed.notify_all()

    def wait_for_change(self, phase: SessionPhase, seconds: float) -> None:
        """Wait up to `seconds` until the session has left a phase or a frame is requested."""
        with self._changed:
            self._changed.wait_for(lambda: self._asked or self.state.phase is not phase, seconds)
            self._asked = False

    def _promise(self, until: int) -> None:
        if not self._promises or until > self._promises[-1][0]:
            self._promises.append((until, self._now()))
            self._changed.notify_all()

    def _note(self, event: str, **fields: Any) -> None:
        self._notes.append((event, {**fields, "wall": round(time.time(), 3)}))
