"""The clock of a session. It runs 25 control steps per second and acknowledges each step once it is on disk."""

import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

from experiments.web.protocol import Taken
from experiments.web.state import OVER, READY, RUNNING, Trigger, WireMessage
from experiments.web.worker.control import Promise, SessionControl
from experiments.web.worker.live_session import LiveSession

LATE = 0.02  # delay above which a control step counts as late, in seconds
MAX_LAG = 1.0  # delay after which the clock restarts, for example after a suspension, in seconds
MAX_UNWRITTEN = 10  # maximum number of control steps without inputs before the journal is synced
SHOW_PERIOD = 0.1  # interval between polls of a session that is not running, in seconds

Send = Callable[[WireMessage], None]


class Clock:
    """A clock that runs a session in real time. `sync` writes the journal to disk. `show` shows the state.

    If `as_inputs_come` is true, each control step is due as soon as its inputs have arrived, and intermediate
    states are not shown.
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
        self._missed = False  # True if promised inputs were missing in the last step

    def run(self) -> str:
        """Run the session until it ends, and return the reason for its end.

        A failed session continues to run until the server terminates the process.
        """
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
        """Wait until the next control step is due and its inputs have arrived, and then run the step."""
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
            self._show()  # a state is not shown if the next step follows immediately
        self._acknowledger.request(live.input, session.record.step)

    def _follows_at_once(self) -> bool:
        if self._control.state.phase is not RUNNING:
            return False
        promise = self._control.wait_for_promise(self._live.session.record.step, 0.0)
        if promise.came is None:
            return False
        if self._as_inputs_come:
            return not promise.missing
        return self._schedule.wait(time.monotonic(), promised=True) <= 0.0

    def _note_lateness(self, promise: Promise) -> None:
        """Log steps that this machine delays, and the first of a series of steps without promised inputs."""
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
    """A thread that syncs the journal and then acknowledges the synced inputs and control steps."""

    def __init__(self, sync: Callable[[], None], send: Send) -> None:
        self._sync, self._send = sync, send
        self._thread = ThreadPoolExecutor(1, "journal")
        self._number = self._newest = 0
        self._error: OSError | None = None

    def request(self, number: int, step: int) -> None:
        """Acknowledge all inputs and steps up to these numbers soon. This may be delayed if there is no new input."""
        if number == self._number and step < self._newest + MAX_UNWRITTEN:
            return
        self._number, self._newest = number, step
        self._thread.submit(self._acknowledge, number, step)

    def check(self) -> None:
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        self._thread.shutdown()

    def _acknowledge(self, number: int, step: int) -> None:
        if step < self._newest or self._error is not None:
            return  # a later request will include these steps
        try:
            self._sync()
        except OSError as error:
            self._error = error
        else:
            self._send(Taken(number, step))


PATIENCE = 0.75  # how long a control step waits for its promised inputs, in seconds
WINDOW = 25  # number of control steps between adjustments of the schedule to the page's clock
PULL = 0.05  # maximum speed-up per adjustment, as a fraction of the clock's rate


class Schedule:
    """A schedule with one control step every `period` seconds.

    A page that promises its inputs has its own clock, and its promises take time to arrive. If all promises
    in an interval arrive after their steps are due, the schedule is delayed. If all of them arrive early, the
    schedule is advanced. After a single late promise, the steps that have become due follow immediately.

    Attributes:
        due: Due time of the next control step, in seconds.
    """

    def __init__(self, period: float, now: float) -> None:
        self.due = now
        self._period = period
        self._late: list[float] = []  # delay of each promise relative to the due time of its step, in seconds

    def start(self, now: float) -> None:
        """Restart the schedule so that the next control step is due now."""
        self.due = now
        self._late.clear()

    def wait(self, now: float, *, promised: bool) -> float:
        """Return the time until the next control step in seconds. `promised` is True if its inputs have arrived."""
        return max(0.0, self.due + (0.0 if promised else PATIENCE) - now)

    def take(self, came: float | None) -> None:
        """Record a control step. `came` is the arrival time of its promised inputs, or None."""
        if came is None:
            self._late.clear()
        else:
            self._late.append(came - self.due)
        self.due += self._period
        if len(self._late) == WINDOW:
            earliest, latest = min(self._late), max(self._late)
            self._late.clear()
            self.due += max(0.0, earliest) + max(min(0.0, latest), -PULL * WINDOW * self._period)
