"""A session under way: joins a visit, its worker, and the browser that is connected."""

import asyncio
import logging
import time
from collections import deque
from collections.abc import Mapping, MutableMapping, Sequence
from contextlib import suppress
from typing import Any, Protocol

import msgspec

from experiments.record.phases import TASK
from experiments.web import protocol
from experiments.web.controls import Input
from experiments.web.protocol import (
    Beat,
    Display,
    Draw,
    Error,
    Inputs,
    Leave,
    Open,
    Pause,
    Run,
    Saved,
    Scene,
    Seen,
    Snapshot,
    State,
    Taken,
    View,
    WireMessage,
)
from experiments.web.server.limit import SessionLimit
from experiments.web.server.meter import Meter
from experiments.web.server.pool import WorkerPool, WorkerProcess
from experiments.web.server.spectators import Spectators
from experiments.web.server.visits import PLAYED, Visit
from experiments.web.state import FAILED, LOADING, READY, RUNNING, Trigger

LOG = logging.getLogger("mjsim.play")
MAX_CRASHES = 3  # of workers in a row, without an input taken in between, after which a session fails
QUEUE_TIMEOUT = 10.0  # s that a place in the queue is kept without a connection
MAX_AHEAD = 1000  # inputs that may wait to be taken
FAILURE = "The session cannot continue at the moment. Nothing is lost: reload this page to try again."


class Browser(Protocol):
    """A connection to a page, of which each tab has one at a time."""

    tab: str

    def send(self, message: WireMessage) -> None:
        """Send a message, without waiting."""

    def close(self, code: int, reason: str) -> None:
        """Close the connection once all is sent."""


class PlayedSession:
    """The training or the task of a visit.

    Attributes:
        visit: The visit.
        browser: The one that is connected, or None.
        heard: When the person last did something, as `time.monotonic` has it.
        state: Copy of the worker's state.
        display: How well the person sees the session, by the page; None before it says so.
        spectators: Who watches.
    """

    def __init__(
        self,
        visit: Visit,
        pool: WorkerPool,
        limit: SessionLimit,
        minimum: Mapping[str, float],
        scenes: MutableMapping[str, str],
        meter: Meter | None = None,
        *,
        as_inputs_come: bool = False,
        floor_plan: bool = True,
        language: str = "en",
        texts: Mapping[str, str] | None = None,
    ) -> None:
        self.visit, self._minimum, self._scenes = visit, minimum, scenes
        self._as_inputs_come, self._floor_plan = as_inputs_come, floor_plan
        self._language, self._texts = language, dict(texts or {})
        self._meter = meter or Meter()
        self.browser: Browser | None = None
        self.heard = time.monotonic()
        self.state = State()
        self.display: Display | None = None
        self.spectators = Spectators()
        self._pool, self._limit = pool, limit
        self._task: asyncio.Task[None] | None = None
        self._worker: WorkerProcess | None = None
        self._view: View | None = None
        self._taken = self._step = 0  # number of the last input that is safe, and the next control step
        self._lost = False  # whether a worker died, and the browser may not know it yet
        self._came: deque[tuple[int, float]] = deque(
            maxlen=MAX_AHEAD
        )  # inputs that are not safe yet, and when

    @property
    def processor_time(self) -> float | None:
        """Of the worker, s; None while the clock does not run."""
        if self._worker is None or self.state.phase is not RUNNING:
            return None
        return self._worker.processor_time()

    def attach(self, browser: Browser, view: View) -> None:
        """Connect a browser; it replaces the one before."""
        if self.browser is not None:
            self.browser.send(protocol.Replaced())
            self.browser.close(protocol.REPLACED, "the session is open elsewhere")
            self._pause("taken over")
        self.browser, self.heard, self._lost = browser, time.monotonic(), False
        self.take(view)
        if self._task is None:
            self._task = asyncio.create_task(self._run())
        elif (position := self._limit.position(self.visit.name)) is not None:
            browser.send(protocol.Queue(position))
        else:
            browser.send(self.state)

    def detach(self, browser: Browser) -> None:
        """A browser is gone; the session is paused until one is back."""
        if self.browser is not browser:
            return
        self.browser = None
        self.heard = time.monotonic()
        self._pause("disconnected")
        if self._limit.position(self.visit.name) is not None:
            asyncio.get_running_loop().call_later(QUEUE_TIMEOUT, self._leave_queue)

    def take(self, message: Any) -> Error | None:
        """Take a message from the browser; why it was refused, or None."""
        by_itself = isinstance(message, Seen | Beat | Display | Draw) or (
            isinstance(message, Inputs) and not message.inputs
        )
        if not by_itself:
            self.heard = time.monotonic()
        match message:
            case View():
                self._view = message
            case Inputs(inputs) if self.state.phase is LOADING or self._lacks_some_before(inputs):
                return None  # the browser keeps them, and sends them again
            case Inputs(inputs):
                if (error := self._input_error(message)) is not None:
                    return error
                numbers = [new.number for new in inputs]
                self.state = msgspec.structs.replace(self.state, input=max(self.state.input, *numbers, 0))
                if numbers and self.state.phase is RUNNING:
                    self._came.append((numbers[-1], time.monotonic()))
            case Display():
                self.display = message
            case Run() | Leave() if self.state.phase is LOADING:
                return Error("too early", "the session is not ready")
            case Leave() if wait := self.visit.wait(self._minimum):
                return Error("too early", f"this phase can be ended in {wait:.0f} s")
            case Run():
                self._lost, self.state = False, self.state.after(Trigger.RUN)
            case Pause(reason):
                self._pause(reason)
                return None
        self._send(message)
        return None

    async def release(self) -> None:
        """Give worker and place back; the journal holds everything."""
        self.spectators.close()
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    def _lacks_some_before(self, inputs: Sequence[Input]) -> bool:
        """Whether a browser that does not know yet that a worker died sends what follows inputs lost with it.

        To take these would acknowledge the lost ones, and the browser would not send them again.
        """
        return self._lost and len(inputs) > 0 and inputs[0].number > self.state.input + 1

    def _input_error(self, message: Inputs) -> Error | None:
        numbers = [new.number for new in message.inputs]
        latest = max((new.step or 0 for new in message.inputs), default=0)
        if self.state.phase is READY:
            return Error("too early", "the clock has not been started")
        if numbers != sorted(set(numbers)):
            return Error("out of order", "numbers of inputs must ascend")
        if numbers and numbers[-1] > self._taken + MAX_AHEAD:
            return Error("out of order", f"input {numbers[-1]} comes while {self._taken} was taken last")
        if (latest := max(latest, message.until or 0)) > self._step + protocol.MAX_STEPS_AHEAD:
            return Error("out of order", f"control step {latest} comes while {self._step} is the next one")
        return None

    def _pause(self, reason: protocol.PauseReason) -> None:
        self.state = self.state.after(Trigger.PAUSE, reason)
        self._send(Pause(reason))

    def _leave_queue(self) -> None:
        waits = self._limit.position(self.visit.name) is not None
        if self.browser is None and waits and self._task is not None:
            self._task.cancel()
            self._task = None

    def _tell_position(self, position: int) -> None:
        self._tell(protocol.Queue(position))

    def _send(self, message: protocol.WireMessage) -> None:
        if self._worker is not None:
            self._worker.send(message)

    def _tell(self, message: protocol.WireMessage) -> None:
        if self.browser is not None:
            self.browser.send(message)
        self.spectators.tell(message)

    def _set(self, state: State) -> None:
        self.state = state
        self._tell(state)

    async def _run(self) -> None:
        """Play what is left of the visit."""
        name, duration = self.visit.name, None
        await self._limit.acquire(name, self._tell_position)
        self.heard = began = time.monotonic()  # who waits in the queue need do nothing
        try:
            while self.visit.phase in PLAYED:
                await self._play(self.visit.phase)
            duration = time.monotonic() - began
        except OSError as error:
            LOG.error("session %s: %s", self.visit.name[:12], error)
            self._set(State(FAILED, FAILURE))
        except Exception:
            LOG.exception("session %s", self.visit.name[:12])
            self._set(State(FAILED, FAILURE))
        finally:
            self._limit.release(name, duration)
            self._discard_worker()
            if self._task is asyncio.current_task():
                self._task = None

    async def _play(self, trial: str) -> None:
        """Play a trial to its end, with another worker whenever one dies."""
        visit, crashes, safe = self.visit, 0, 0
        self._taken = self._step = 0
        self._came.clear()
        opening = Open(
            str(visit.journal(trial)),
            str(visit.run(trial)),
            visit.settings(trial),
            visit.before(trial),
            as_inputs_come=self._as_inputs_come,
            floor_plan=self._floor_plan and trial == TASK,
            language=self._language,
            texts=self._texts,
        )
        while crashes < MAX_CRASHES:
            self._set(State())
            worker = self._worker = self._worker or await self._pool.start()
            worker.send(opening)
            if self._view is not None:
                worker.send(self._view)
            while (message := await worker.receive()) is not None:
                match message:
                    case State(phase, reason) if phase is FAILED:
                        raise OSError(reason)
                    case State(input=number):
                        if self.state.phase is LOADING:
                            self._taken = number  # of a session that was restored
                        message = msgspec.structs.replace(message, input=max(number, self.state.input))
                        self.state = message
                    case Taken(number, step):
                        crashes = 0 if step > safe else crashes
                        self._taken, safe, self._step = number, step, max(self._step, step)
                        self._measure(number)
                    case Scene(path=str(path)):
                        self._scenes[opening.config["house"]] = path
                    case Snapshot(step):
                        self._step = max(self._step, step)
                    case Saved():
                        await asyncio.to_thread(self._finish, trial)
                        self._tell(message)
                        return
                self._tell(message)
            LOG.warning("session %s: its worker died", visit.name[:12])
            self._meter.worker_lost()
            self._came.clear()
            self._lost = True
            opening = msgspec.structs.replace(opening, restarted=True)
            self._discard_worker()
            crashes += 1
        raise OSError(f"the worker crashed {MAX_CRASHES} times in a row")

    def _measure(self, safe: int) -> None:
        """Note how long it took until inputs were safe."""
        while self._came and self._came[0][0] <= safe:
            self._meter.acknowledged(time.monotonic() - self._came.popleft()[1])

    def _finish(self, trial: str) -> None:
        visit = self.visit
        metrics = visit.metrics(trial)
        visit.finish(trial, metrics.get("completion_time_s", 0.0), metrics["ended"])
        LOG.info("session %s: %s is over (%s)", visit.name[:12], trial, metrics["ended"])

    def _discard_worker(self) -> None:
        if self._worker is not None:
            self._pool.discard(self._worker)
            self._worker = None
