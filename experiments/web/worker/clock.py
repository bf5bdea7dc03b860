"""The clock of a session: 25 control steps a second, none skipped, each acknowledged once it is on the disk."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from experiments.web.protocol import Taken, WireMessage
from experiments.web.state import OVER, READY, RUNNING, Trigger
from experiments.web.worker.control import Promise, SessionControl
from experiments.web.worker.live_session import LiveSession

LATE = 0.02  # s after its time at which a control step counts as late
MAX_LAG = 1.0  # s behind schedule from which the process must have been stopped: the clock restarts from now
MAX_UNWRITTEN = 10  # control steps without an input that are not written through to the disk at once
SHOW_PERIOD = 0.1  # s between two looks at a session that is not running

Send = Callable[[WireMessage], None]


class Clock:
    """Steps a session in real time; `sync` writes its journal through to the disk, `show` shows its state.

    With `as_inputs_come` a control step is due as soon as its inputs are promised, and states between are not shown.
    """

    def __init__(
        self,
        live: LiveSession,
        control: SessionControl,
        sync: Callable[[], None],
        send: Send,
        show: Callable[[], None],
        *,
        as_inputs_come: bool = False,
    ) -> None:
        self._as_inputs_come = as_inputs_come
        self._live, self._control, self._show = live, control, show
        self._schedule = Schedule(live.world.control_timestep, time.monotonic())
        self._acknowledger = _Acknowledger(sync, send)
        self._missed = False  # whether the last step was taken without the inputs that were promised

    def run(self) -> str:
        """Run until the session is over; the reason. After a failure, run until the server ends this process."""
        live, control = self._live, self._control
        try:
            while live.end_reason is None and (phase := control.state.phase) is not OVER:
                if phase is not READY:
                    self._log_notes()
                if not (self._as_inputs_come and self._follows_at_once()):
                    self._show()
                if phase is RUNNING:
                    self._wait_and_step()
                    control.pause_if_silent()
                else:
                    live.release()
                    control.wait_for_change(phase, SHOW_PERIOD)
                    self._schedule.start(time.monotonic())
            self._log_notes()
        finally:
            self._acknowledger.close()
        self._acknowledger.check()
        control.apply(Trigger.END, live.end_reason or "")
        return control.state.reason

    def _wait_and_step(self) -> None:
        """Take a control step when it is due and its inputs are there, unless the session stops meanwhile."""
        live, schedule = self._live, self._schedule
        session, step = live.session, live.session.record.step
        if self._as_inputs_come:
            schedule.start(time.monotonic())
        if (early := schedule.wait(time.monotonic(), promised=True)) > 0.0:
            time.sleep(early)
        left = schedule.wait(time.monotonic(), promised=False)
        promise = self._control.wait_for_promise(step, left)
        if self._control.state.phase is not RUNNING:
            return
        self._note_lateness(promise)
        self._acknowledger.check()
        live.step(self._control.take_inputs(step))
        schedule.take(promise.came)
        if not self._follows_at_once():
            self._show()  # else the state after the next step is shown
        self._acknowledger.request(live.input, session.record.step)

    def _follows_at_once(self) -> bool:
        """Whether the inputs of the next control step are there, and it is due."""
        if self._control.state.phase is not RUNNING:
            return False
        promise = self._control.wait_for_promise(self._live.session.record.step, 0.0)
        if promise.came is None:
            return False
        if self._as_inputs_come:
            return not promise.missing
        return self._schedule.wait(time.monotonic(), promised=True) <= 0.0

    def _note_lateness(self, promise: Promise) -> None:
        """Log a control step that is late by this machine's fault, and the first one without promised inputs."""
        due, now = self._schedule.due, time.monotonic()
        late = now - (due if promise.came is None else max(due, promise.came))
        if promise.missing:
            if not self._missed:
                self._live.session.note("overrun", seconds=round(late, 3), skipped=False, missing=True)
        elif late > LATE:
            skipped = late > MAX_LAG
            self._live.session.note("overrun", seconds=round(late, 3), skipped=skipped, missing=False)
            if skipped:
                self._schedule.start(now)
        self._missed = promise.missing

    def _log_notes(self) -> None:
        for event, fields in self._control.take_notes():
            self._live.session.note(event, **fields)


class _Acknowledger:
    """Writes the journal through to the disk in a thread of its own, then acknowledges what it holds."""

    def __init__(self, sync: Callable[[], None], send: Send) -> None:
        self._sync, self._send = sync, send
        self._thread = ThreadPoolExecutor(1, "journal")
        self._number = self._newest = 0
        self._error: OSError | None = None

    def request(self, number: int, step: int) -> None:
        """Everything up to this input and control step is in the journal; without a new input, some steps may wait."""
        if number == self._number and step < self._newest + MAX_UNWRITTEN:
            return
        self._number, self._newest = number, step
        self._thread.submit(self._acknowledge, number, step)

    def check(self) -> None:
        """Raise the error of a disk that did not take what was written."""
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        self._thread.shutdown()

    def _acknowledge(self, number: int, step: int) -> None:
        if step < self._newest or self._error is not None:
            return  # a later call writes this as well
        try:
            self._sync()
        except OSError as error:
            self._error = error
        else:
            self._send(Taken(number, step))


PATIENCE = 0.75  # s after its time at which a control step is taken without the inputs that were promised
WINDOW = 25  # control steps after which the clock follows that of the page
PULL = 0.05  # share by which it may run faster for that


class Schedule:
    """Control steps are due every `period` s from `due` on.

    A page that promises its inputs has a clock of its own, and its promises travel. If all promises of a while came
    after the steps for which they were due, steps are due later from then on; if all came before, earlier. What comes
    late once is waited for, and the steps that have become due meanwhile follow at once.

    Attributes:
        due: When the next control step is due, s.
    """

    def __init__(self, period: float, now: float) -> None:
        self.due = now
        self._period = period
        self._late: list[float] = []  # by how much promises came after their steps were due, s

    def start(self, now: float) -> None:
        """Begin anew: a control step is due now."""
        self.due = now
        self._late.clear()

    def wait(self, now: float, *, promised: bool) -> float:
        """How long to wait before the next control step, s; `promised` is whether its inputs are there."""
        return max(0.0, self.due + (0.0 if promised else PATIENCE) - now)

    def take(self, came: float | None) -> None:
        """The control step is taken; `came` is when its inputs were there, None where nothing is promised."""
        if came is None:
            self._late.clear()
        else:
            self._late.append(came - self.due)
        self.due += self._period
        if len(self._late) == WINDOW:
            earliest, latest = min(self._late), max(self._late)
            self._late.clear()
            self.due += max(0.0, earliest) + max(min(0.0, latest), -PULL * WINDOW * self._period)
