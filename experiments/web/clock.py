"""The clock of a session: a control step every 40 ms, none skipped, and each acknowledged once it is on the disk."""

import threading
import time
from typing import Any

from experiments.session.endings import INTERRUPTED
from experiments.web import messages
from experiments.web.connection import Connection
from experiments.web.live_session import LiveSession
from experiments.web.mailbox import Mailbox

LATE = 0.02  # s after its time at which a control step counts as late
ASLEEP = 1.0  # s behind at which the process must have been stopped, and the clock goes on from now


class Clock:
    """Steps a session in real time until it is over, left, or the server is gone."""

    def __init__(self, live: LiveSession, mailbox: Mailbox, sync: Any, connection: Connection) -> None:
        self._live, self._mailbox, self._connection = live, mailbox, connection
        self._sync = _Sync(sync, connection)

    def run(self) -> str | None:
        """Why the session is over; None if the server is gone.

        Raises:
            PhysicsError: The physics failed.
            OSError: The journal cannot be written.
        """
        live, mailbox = self._live, self._mailbox
        deadline, paused = time.monotonic(), False
        try:
            while (reason := live.end_reason) is None:
                if mailbox.begun:
                    self._note_blurs()
                if not mailbox.runs:
                    if mailbox.closed:
                        return None
                    if mailbox.leave:
                        return INTERRUPTED
                    if mailbox.begun and not paused:
                        paused = self._pause(mailbox.paused or "")
                    live.session.show()
                    mailbox.wait_until_running(0.1)
                    deadline = time.monotonic()
                    continue
                if paused:
                    paused = self._resume()
                deadline = self._step_at(deadline)
        finally:
            self._sync.close()
        self._sync.check()
        return reason

    def _step_at(self, deadline: float) -> float:
        """Take a control step at its time; when the next one is due."""
        late = time.monotonic() - deadline
        if late < 0.0:
            time.sleep(-late)
        elif late > ASLEEP:
            self._live.session.note("overrun", seconds=round(late, 3), skipped=True)
            deadline += late
        elif late > LATE:
            self._live.session.note("overrun", seconds=round(late, 3), skipped=False)
        self._sync.check()
        self._live.step(self._mailbox.take())
        if self._live.end_reason is None:
            self._live.session.show()  # what the inputs led to is on its way a control step earlier
        self._sync.request(self._live.input, self._live.session.recording.step)
        return deadline + self._live.world.control_timestep

    def _note_blurs(self) -> None:
        for away, wall in self._mailbox.take_blurs():
            self._live.session.note("blur", away=away, wall=round(wall, 3))

    def _pause(self, reason: str) -> bool:
        self._live.session.note("pause", reason=reason, wall=round(time.time(), 3))
        self._connection.send(messages.Paused(reason))
        return True

    def _resume(self) -> bool:
        self._live.session.note("resume", wall=round(time.time(), 3))
        self._connection.send(messages.Paused(None))
        return False


class _Sync:
    """Writes the journal through to the disk in a thread of its own, then acknowledges."""

    def __init__(self, sync: Any, connection: Connection) -> None:
        self._sync, self._connection = sync, connection
        self._changed = threading.Condition()
        self._wanted: tuple[int, int] | None = None
        self._error: OSError | None = None
        self._closed = False
        self._thread = threading.Thread(target=self._run, name="journal", daemon=True)
        self._thread.start()

    def request(self, number: int, step: int) -> None:
        """Everything up to this input and control step is in the journal."""
        with self._changed:
            self._wanted = number, step
            self._changed.notify()

    def check(self) -> None:
        """Nothing goes on that cannot be kept.

        Raises:
            OSError: The disk did not take what was written.
        """
        if self._error is not None:
            raise self._error

    def close(self) -> None:
        """Write through what is left."""
        with self._changed:
            self._closed = True
            self._changed.notify()
        self._thread.join()

    def _run(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._wanted is not None or self._closed)
                if self._wanted is None:
                    return
                (number, step), self._wanted = self._wanted, None
            try:
                self._sync()
            except OSError as error:
                self._error = error
                return
            self._connection.send(messages.Taken(number, step))
