"""A live session, which connects a participant's browser with a worker process."""

import asyncio
import logging
import math
import time
from collections import deque
from collections.abc import MutableMapping, Sequence
from contextlib import suppress
from typing import Any

import msgspec

from experiments.errors import StoreError
from experiments.web import protocol
from experiments.web.controls import Input
from experiments.web.server.limit import SessionLimit
from experiments.web.server.player import LiveTrial, Meter, Player
from experiments.web.server.pool import WorkerPool, WorkerProcess
from experiments.web.server.spectators import Browser, Spectators
from experiments.web.state import (
    FAILED,
    LOADING,
    READY,
    RUNNING,
    SceneMessage,
    Snapshot,
    State,
    Trigger,
    WireMessage,
)

LOG = logging.getLogger("mjsim.play")
MAX_CRASHES = 3  # number of worker crashes without progress after which a session fails
MAX_AHEAD = 1000  # maximum number of inputs that have not been processed
FAILURE = "The session cannot continue at the moment. Nothing is lost: reload this page to try again."


class PlayedSession:
    """A session in which a participant completes trials one after the other.

    Attributes:
        heard: Time of the participant's last activity, as returned by `time.monotonic`.
        display: Last report on the display quality from the page, or None.
    """

    def __init__(
        self,
        player: Player,
        pool: WorkerPool,
        limit: SessionLimit,
        scenes: MutableMapping[str, str],
        meter: Meter | None = None,
        *,
        as_inputs_come: bool = False,
    ) -> None:
        self.player, self._scenes = player, scenes
        self.trial: LiveTrial | None = None
        self._as_inputs_come = as_inputs_come
        self._meter = meter or Meter()
        self.browser: Browser | None = None
        self.heard = time.monotonic()
        self.state = State()
        self.display: protocol.Display | None = None
        self.spectators = Spectators()
        self._pool, self._limit = pool, limit
        self._task: asyncio.Task[None] | None = None
        self._worker: WorkerProcess | None = None
        self._view: protocol.View | None = None
        self._taken = self._step = 0  # numbers of the last input on disk and the next control step
        self._lost = False  # True if a worker died and the browser may not know this yet
        self._came = deque[tuple[int, float]](maxlen=MAX_AHEAD)  # numbers and arrival times of unsaved inputs

    @property
    def processor_time(self) -> float | None:
        """The CPU time of the worker in seconds, or None if the clock is stopped."""
        if self._worker is None or self.state.phase is not RUNNING:
            return None
        return self._worker.processor_time()

    def attach(self, browser: Browser, view: protocol.View) -> None:
        """Connect a browser and disconnect the previous one."""
        if self.browser is not None:
            self.browser.send(protocol.Replaced())
            self.browser.close(protocol.REPLACED, "the session is open elsewhere")
            self._pause("taken over" if self.browser.tab != browser.tab else "disconnected")
        self.browser, self.heard, self._lost = browser, time.monotonic(), False
        self.take(view)
        if self._task is None:
            self._task = asyncio.create_task(self._run())
        else:
            browser.send(self.state)

    def detach(self, browser: Browser) -> None:
        """Disconnect a browser and pause the session."""
        if self.browser is not browser:
            return
        self.browser = None
        self.heard = time.monotonic()
        self._pause("disconnected")

    def take(self, message: Any) -> protocol.Error | None:
        """Handle a message from the browser. Return an error if the message is rejected."""
        by_itself = isinstance(message, protocol.Seen | protocol.Beat | protocol.Display | protocol.Draw) or (
            isinstance(message, protocol.Inputs) and not message.inputs
        )
        if not by_itself:
            self.heard = time.monotonic()
        match message:
            case protocol.View():
                self._view = message
            case protocol.Inputs(inputs) if self.state.phase is LOADING or self._lacks_some_before(inputs):
                return None  # ignored, because the browser will send the inputs again
            case protocol.Inputs(inputs):
                if (error := self._input_error(message)) is not None:
                    return error
                numbers = [new.number for new in inputs]
                self.state = msgspec.structs.replace(self.state, input=max(self.state.input, *numbers, 0))
                if numbers and self.state.phase is RUNNING:
                    self._came.append((numbers[-1], time.monotonic()))
            case protocol.Display():
                self.display = message
            case protocol.RunMessage() | protocol.Leave() if self.state.phase is LOADING:
                return protocol.Error("too early", "the session is not ready")
            case protocol.Leave() if (wait := self._leave_at - time.monotonic()) > 0.0:
                return protocol.Error("too early", f"this phase can be ended in {wait:.0f} s")
            case protocol.RunMessage():
                self._lost, self.state = False, self.state.after(Trigger.RUN)
            case protocol.Pause(reason):
                self._pause(reason)
                return None
        self._send(message)
        return None

    async def release(self) -> None:
        """Stop the session and release its worker and slot. The state remains in the journal."""
        self.spectators.close()
        task, self._task = self._task, None
        if task is not None:
            task.cancel()
            with suppress(asyncio.CancelledError):
                await task

    def _lacks_some_before(self, inputs: Sequence[Input]) -> bool:
        """Return True if inputs before these inputs were lost because a worker died."""
        return self._lost and len(inputs) > 0 and inputs[0].number > self.state.input + 1

    def _input_error(self, message: protocol.Inputs) -> protocol.Error | None:
        numbers = [new.number for new in message.inputs]
        latest = max((new.step or 0 for new in message.inputs), default=0)
        if self.state.phase is READY:
            return protocol.Error("too early", "the clock has not been started")
        if numbers != sorted(set(numbers)):
            return protocol.Error("out of order", "numbers of inputs must ascend")
        if numbers and numbers[-1] > self._taken + MAX_AHEAD:
            return protocol.Error(
                "out of order", f"input {numbers[-1]} comes while {self._taken} was taken last"
            )
        if (latest := max(latest, message.until or 0)) > self._step + protocol.MAX_STEPS_AHEAD:
            return protocol.Error(
                "out of order", f"control step {latest} comes while {self._step} is the next one"
            )
        return None

    def _pause(self, reason: protocol.PauseReason) -> None:
        self.state = self.state.after(Trigger.PAUSE, reason)
        self._send(protocol.Pause(reason))

    def _send(self, message: WireMessage) -> None:
        if self._worker is not None:
            self._worker.send(message)

    def _tell(self, message: WireMessage) -> None:
        if self.browser is not None:
            self.browser.send(message)
        self.spectators.tell(message)

    def _set(self, state: State) -> None:
        self.state = state
        self._tell(state)

    @property
    def _leave_at(self) -> float:
        return math.inf if self.trial is None else self.trial.leave_at

    async def _run(self) -> None:
        key, duration = self.player.key, None
        if not self._limit.hold(key):
            self._tell(protocol.Queue())
            self._task = None
            return
        self.heard = began = time.monotonic()
        try:
            while (trial := await self.player.trial()) is not None:
                self.trial = trial
                await self._play(trial)
            duration = time.monotonic() - began
        except (OSError, StoreError) as error:
            LOG.error("session %s: %s", key[:12], error)
            self._set(State(FAILED, FAILURE))
        except Exception:
            LOG.exception("session %s", key[:12])
            self._set(State(FAILED, FAILURE))
        finally:
            self.trial = None
            self._limit.release(key, duration)
            self._discard_worker()
            if self._task is asyncio.current_task():
                self._task = None

    async def _play(self, trial: LiveTrial) -> None:
        crashes, safe = 0, 0
        self._taken = self._step = 0
        self._came.clear()
        opening = msgspec.structs.replace(trial.opening, as_inputs_come=self._as_inputs_come)
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
                            self._taken = number  # number of the last input in a restored session
                        message = msgspec.structs.replace(message, input=max(number, self.state.input))
                        self.state = message
                    case protocol.Taken(number, step):
                        crashes = 0 if step > safe else crashes
                        self._taken, safe, self._step = number, step, max(self._step, step)
                        self._measure(number)
                    case SceneMessage(path=str(path)):
                        self._scenes[opening.config["house"]] = path
                    case Snapshot(step):
                        self._step = max(self._step, step)
                    case protocol.Saved():
                        await self.player.over()
                        self.trial = None
                        LOG.info("session %s: %s is over", self.player.key[:12], trial.phase)
                        self._tell(message)
                        return
                self._tell(message)
            LOG.warning("session %s: its worker died", self.player.key[:12])
            self._meter.worker_lost()
            self._came.clear()
            self._lost = True
            opening = msgspec.structs.replace(opening, restarted=True)
            self._discard_worker()
            crashes += 1
        raise OSError(f"the worker crashed {MAX_CRASHES} times in a row")

    def _measure(self, safe: int) -> None:
        while self._came and self._came[0][0] <= safe:
            self._meter.acknowledged(time.monotonic() - self._came.popleft()[1])

    def _discard_worker(self) -> None:
        if self._worker is not None:
            self._pool.discard(self._worker)
            self._worker = None
