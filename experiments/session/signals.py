"""Signals that ask a process to stop: Ctrl-C, SIGTERM (what clusters send) and SIGHUP (a terminal that is closed)."""

import asyncio
import os
import signal
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn, TypeVar

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
T = TypeVar("T")
PATIENCE = 2.0  # s that a trial has to notice a signal, before it is interrupted wherever it is


class Stopped(KeyboardInterrupt):
    """A signal asked to stop.

    Attributes:
        number: The signal.
    """

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


def signal_of(stop: KeyboardInterrupt) -> signal.Signals:
    return signal.Signals(stop.number if isinstance(stop, Stopped) else signal.SIGINT)


def exit_code(number: int) -> int:
    """The exit code of a process that a signal stopped, as shells have it."""
    return 128 + number


@contextmanager
def signals_raised() -> Iterator[None]:
    """Raise `Stopped` wherever the main thread is when a signal comes."""

    def stop(number: int, _frame: FrameType | None) -> None:
        raise Stopped(number)

    with _handled(stop):
        yield


@contextmanager
def exit_raised() -> Iterator[None]:
    """Let `os._exit` of this thread raise `SystemExit` in the block; other threads and processes end as they ask."""
    leave, here = os._exit, (os.getpid(), threading.get_ident())

    def refuse(status: int) -> NoReturn:
        if here == (os.getpid(), threading.get_ident()):
            raise SystemExit(status)
        leave(status)

    os._exit = refuse
    try:
        yield
    finally:
        os._exit = leave


class PostponedSignals:
    """Signals that have come, and wait until it is convenient.

    Attributes:
        number: The first of them, or None.
    """

    def __init__(self) -> None:
        self.number: int | None = None
        self._saving = False

    def check(self) -> None:
        """Stop here, if a signal has come.

        Raises:
            Stopped: It has.
        """
        if self.number is not None:
            self._stop_timer()
            raise Stopped(self.number)

    def save(self) -> None:
        """From here on nothing is interrupted any more."""
        self._saving = True
        self._stop_timer()

    def note(self, number: int, _frame: FrameType | None) -> None:
        """Take a signal; who does not `check` in time, such as a participant that hangs, is interrupted."""
        first, self.number = self.number is None, self.number or number
        if first and not self._saving:
            signal.signal(signal.SIGALRM, self._interrupt)
            signal.setitimer(signal.ITIMER_REAL, PATIENCE)

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        if self.number is not None and not self._saving:
            raise Stopped(self.number)

    def _stop_timer(self) -> None:
        if self.number is not None and threading.current_thread() is threading.main_thread():
            signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def signals_postponed() -> Iterator[PostponedSignals]:
    """Note signals instead of being interrupted by them; in other threads than the main one, nothing changes."""
    postponed = PostponedSignals()
    with _handled(postponed.note):
        yield postponed


def run_until_signal(work: Coroutine[Any, Any, T]) -> T:
    """What a coroutine gives, as `asyncio.run` does it; a signal cancels it, so that it tidies up.

    Raises:
        Stopped: A signal came.
    """
    came: list[int] = []

    async def watched() -> T:
        task, loop = asyncio.current_task(), asyncio.get_running_loop()

        def stop(number: int, _frame: FrameType | None) -> None:
            if task is not None and not came:  # it is tidying up after the first one
                came.append(number)
                loop.call_soon_threadsafe(task.cancel)

        with _handled(stop):
            return await work

    try:
        return asyncio.run(watched())
    except asyncio.CancelledError:
        if came:
            raise Stopped(came[0]) from None
        raise


@contextmanager
def _handled(handler: Callable[[int, FrameType | None], Any]) -> Iterator[None]:
    """Handle all signals but those that the process ignores (as after `nohup`) by `handler`."""
    previous: dict[signal.Signals, Any] = {}
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            before = signal.getsignal(number)
            if before is not None and before != signal.SIG_IGN:
                previous[number] = before
                signal.signal(number, handler)
    try:
        yield
    finally:
        for number, before in previous.items():
            signal.signal(number, before)
