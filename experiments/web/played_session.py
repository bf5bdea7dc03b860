"""A session under way: joins a visit, a worker and the one browser that is connected."""

import asyncio
import logging
import time
from contextlib import suppress
from typing import Any, Protocol

from experiments.web import messages, protocol
from experiments.web.journal import JOURNAL
from experiments.web.messages import Message
from experiments.web.pool import Places, Pool, WorkerProcess
from experiments.web.visits import PLAYED, Visit

LOG = logging.getLogger("mjsim.play")
DEATHS = 3  # of workers in a row, without an input taken in between, after which a session fails
QUEUE_PATIENCE = 10.0  # s that a place in the queue is kept without a connection
MAX_AHEAD = 1000  # inputs that may be on their way
FAILED = (
    "The session cannot go on at the moment. Nothing of it is lost: load this page again to try once more."
)


class Browser(Protocol):
    """The connection to a browser."""

    def send(self, message: Message) -> None:
        """Send a message, without waiting."""
        ...

    def close(self, code: int, reason: str) -> None:
        """Close the connection once all is sent."""
        ...


class PlayedSession:
    """What a person plays now: the training or the task of a visit. It has a worker while it is `open`.

    Args:
        visit: The visit.
        pool: Gives workers.
        places: Limits how many sessions are open at a time.

    Attributes:
        visit: As above.
        browser: The one that is connected, or None.
        heard: When a person was last heard of, as `time.monotonic` has it.
    """

    def __init__(self, visit: Visit, pool: Pool, places: Places) -> None:
        self.visit = visit
        self.browser: Browser | None = None
        self.heard = time.monotonic()
        self._pool, self._places = pool, places
        self._task: asyncio.Task[None] | None = None
        self._worker: WorkerProcess | None = None
        self._ready: messages.Ready | None = None
        self._view: messages.View | None = None
        self._paused: str | None = None
        self._position: int | None = None
        self._forwarded = self._deaths = 0
        self._begun = False

    @property
    def open(self) -> bool:
        """Whether it has a worker, or waits for one."""
        return self._task is not None

    def attach(self, browser: Browser, view: messages.View) -> None:
        """Connect a browser; it takes the place of the one before."""
        if self.browser is not None:
            self.browser.send(protocol.Replaced())
            self.browser.close(protocol.REPLACED, "the session goes on elsewhere")
            self._pause("taken over")
        self.browser, self._view = browser, view
        self.heard = time.monotonic()
        if self._task is None:
            self._task = asyncio.create_task(self._run())
        elif self._ready is not None:
            self._welcome()
        elif self._position is not None:
            browser.send(protocol.Queue(self._position))
        else:
            browser.send(protocol.Recovering())

    def detach(self, browser: Browser) -> None:
        """A browser is gone; the clock stands until one is back."""
        if self.browser is not browser:
            return
        self.browser = None
        self.heard = time.monotonic()
        self._pause("disconnected")
        if self._position is not None:
            asyncio.get_running_loop().call_later(QUEUE_PATIENCE, self._leave_queue)

    def take(self, message: Any) -> protocol.Error | None:
        """A message from the browser; why it was refused, or None."""
        if not isinstance(message, messages.Seen):
            self.heard = time.monotonic()
        if isinstance(message, messages.View):
            self._view = message
        if isinstance(message, messages.Inputs):
            return self._take_inputs(message)
        if self._ready is None:
            if isinstance(message, messages.Begin | messages.Leave):
                return protocol.Error("too early", "the session is not ready")
            return None
        if isinstance(message, messages.Begin):
            self._begun = True
        elif isinstance(message, messages.Pause):
            self._pause(message.reason)
            return None
        elif isinstance(message, messages.Resume):
            self._paused = None
        self._send(message)
        return None

    async def release(self) -> None:
        """Give worker and place back; the journal holds everything."""
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    def _take_inputs(self, message: messages.Inputs) -> protocol.Error | None:
        if self._ready is None or not self._begun:
            # While a worker is replaced, the browser keeps what was not acknowledged, and sends it again.
            return None if self._begun else protocol.Error("too early", "the clock has not been started")
        numbers = [new.number for new in message.inputs]
        if numbers != sorted(set(numbers)):
            return protocol.Error("out of order", "numbers of inputs must ascend")
        if numbers and numbers[-1] > self._forwarded + MAX_AHEAD:
            return protocol.Error("out of order", f"input {numbers[-1]} follows input {self._forwarded}")
        new = [new for new in message.inputs if new.number > self._forwarded]
        if new:
            self._forwarded = new[-1].number
            self._send(messages.Inputs(new))
        return None

    def _pause(self, reason: str) -> None:
        if self._begun and self._paused is None:
            self._paused = reason
            self._send(messages.Pause(reason))

    def _leave_queue(self) -> None:
        if self.browser is None and self._position is not None and self._task is not None:
            self._task.cancel()
            self._task = None

    def _send(self, message: Message) -> None:
        if self._worker is not None and self._ready is not None:
            self._worker.send(message)

    def _tell(self, message: Message) -> None:
        if self.browser is not None:
            self.browser.send(message)

    def _welcome(self) -> None:
        """Tell a browser that has just connected where the session stands, and the worker how it wants to see it."""
        if self._ready is None or self._worker is None:
            return
        ready = messages.Ready(self._ready.step, self._forwarded, self._ready.resumed, self._begun)
        self._tell(ready)
        if self._paused is not None:
            self._tell(messages.Paused(self._paused))
        if self._view is not None:
            self._worker.send(self._view)

    async def _run(self) -> None:
        """Play what is left of the visit."""
        try:
            await self._places.take(self._queue_at)
        finally:
            self._position = None
        try:
            while self.visit.phase in PLAYED:
                await self._play(self.visit.phase)
        except OSError as error:
            LOG.error("session %s: %s", self.visit.name[:12], error)
            self._tell(messages.Failed(FAILED))
        except Exception:
            LOG.exception("session %s", self.visit.name[:12])
            self._tell(messages.Failed(FAILED))
        finally:
            self._places.give_back()
            if self._worker is not None:
                self._pool.discard(self._worker)
            self._worker = self._ready = None
            if self._task is asyncio.current_task():
                self._task = None

    def _queue_at(self, position: int) -> None:
        self._position = position
        self._tell(protocol.Queue(position))

    async def _play(self, phase: str) -> None:
        """Play the trial of a phase to its end, with one worker after the other if they die.

        Raises:
            OSError: It cannot go on.
        """
        visit = self.visit
        self._ready, self._begun, self._paused, self._deaths = None, False, None, 0
        if (visit.journal(phase) / JOURNAL).is_file():
            self._paused = "disconnected"
        while True:
            if self._worker is None:
                self._worker = await self._pool.take(visit.journal(phase))
            self._worker.send(
                messages.Open(
                    str(visit.journal(phase)),
                    str(visit.run(phase)),
                    visit.settings(phase),
                    self._paused,
                    visit.before(phase),
                )
            )
            over = await self._forward_until_over(self._worker)
            self._ready = None
            if over is not None:
                done = over.metrics or {}
                visit.finish(phase, done.get("completion_time_s", 0.0), done.get("ended"))
                LOG.info(
                    "session %s: %s is over (%s): %s", visit.name[:12], phase, over.reason, visit.run(phase)
                )
                self._tell(messages.Over(over.reason, None))
                return
            self._deaths += 1
            LOG.warning("session %s: its worker died", visit.name[:12])
            self._pool.discard(self._worker)
            self._worker = None
            if self._deaths >= DEATHS:
                raise OSError("its workers die again and again")
            self._tell(protocol.Recovering())

    async def _forward_until_over(self, worker: WorkerProcess) -> messages.Over | None:
        """Pass on what a worker says, until the trial is over; None if it died.

        Raises:
            OSError: It says that the session cannot go on.
        """
        while (message := await worker.receive()) is not None:
            if isinstance(message, messages.Over):
                return message
            if isinstance(message, messages.Failed):
                raise OSError(message.message)
            if isinstance(message, messages.Ready):
                self._opened(message)
            elif isinstance(message, messages.Taken):
                self._deaths = 0
                self._tell(message)
            elif isinstance(message, messages.Paused):
                if message.reason == self._paused:
                    self._tell(message)
            else:
                self._tell(message)
        return None

    def _opened(self, ready: messages.Ready) -> None:
        self._ready, self._forwarded = ready, ready.input
        self._begun = ready.begun
        if not ready.begun:
            self._paused = None
            self._send(messages.Resume())
        self._welcome()
