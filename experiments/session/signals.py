"""Signal handlers for SIGINT (Ctrl-C), SIGTERM (sent by job schedulers) and SIGHUP (closed terminal)."""

import asyncio
import os
import signal
import sys
import threading
from collections.abc import Callable, Coroutine, Iterator
from contextlib import contextmanager
from types import FrameType
from typing import Any, NoReturn, TypeVar

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
T = TypeVar("T")
RETRY_S = 0.02  # time until a signal is sent again whose exception Python has ignored
CHECK_TIMEOUT_S = 2.0  # time after which a trial that does not check for signals is interrupted


class Stopped(KeyboardInterrupt):
    """Raised if the process was asked to stop by the signal `number`."""

    def __init__(self, number: int) -> None:
        super().__init__(signal.Signals(number).name)
        self.number = number


def signal_of(stop: KeyboardInterrupt) -> signal.Signals:
    return signal.Signals(stop.number if isinstance(stop, Stopped) else signal.SIGINT)


def exit_code(number: int) -> int:
    """Return the exit code that shells report for a process stopped by a signal."""
    return 128 + number


@contextmanager
def signals_raised() -> Iterator[None]:
    """Raise `Stopped` in the main thread when a signal arrives.

    Python ignores exceptions in destructors and in callbacks of weak references. A signal that arrives there is
    sent again a little later.
    """
    report, timers = sys.unraisablehook, list[threading.Timer]()

    def stop(number: int, _frame: FrameType | None) -> None:
        raise Stopped(number)

    def send_again(ignored: "sys.UnraisableHookArgs") -> None:
        if isinstance(ignored.exc_value, Stopped):
            timers.append(threading.Timer(RETRY_S, os.kill, (os.getpid(), ignored.exc_value.number)))
            timers[-1].start()
        else:
            report(ignored)

    sys.unraisablehook = send_again
    try:
        with _handled(stop):
            yield
    finally:
        sys.unraisablehook = report
        for timer in timers:
            timer.cancel()


@contextmanager
def exit_raised() -> Iterator[None]:
    """Make `os._exit` raise `SystemExit` in this thread during the block.

    Other threads and processes are not affected.
    """
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
    """A record of signals that have not been handled yet. `number` is the first signal, or None."""

    def __init__(self) -> None:
        self.number: int | None = None
        self._saving = False

    def check(self) -> None:
        """Raise `Stopped` if a signal has arrived."""
        if self.number is not None:
            self._stop_timer()
            raise Stopped(self.number)

    def save(self) -> None:
        """Prevent interruptions from now on, so that results can be saved."""
        self._saving = True
        self._stop_timer()

    def record(self, number: int, _frame: FrameType | None) -> None:
        """Record a signal. Code that does not call `check` within `CHECK_TIMEOUT_S` is interrupted."""
        first, self.number = self.number is None, self.number or number
        if first and not self._saving:
            signal.signal(signal.SIGALRM, self._interrupt)
            signal.setitimer(signal.ITIMER_REAL, CHECK_TIMEOUT_S)

    def _interrupt(self, _number: int, _frame: FrameType | None) -> None:
        if self.number is not None and not self._saving:
            raise Stopped(self.number)

    def _stop_timer(self) -> None:
        if self.number is not None and threading.current_thread() is threading.main_thread():
            signal.setitimer(signal.ITIMER_REAL, 0.0)


@contextmanager
def signals_postponed() -> Iterator[PostponedSignals]:
    """Record signals instead of interrupting the block. This has no effect outside the main thread."""
    postponed = PostponedSignals()
    with _handled(postponed.record):
        yield postponed


def run_until_signal(work: Coroutine[Any, Any, T]) -> T:
    """Run a coroutine like `asyncio.run`. A signal cancels the coroutine and then raises `Stopped`."""
    came: list[int] = []

    async def watched() -> T:
        task, loop = asyncio.current_task(), asyncio.get_running_loop()

        def stop(number: int, _frame: FrameType | None) -> None:
            if task is not None and not came:  # a second signal does not interrupt the cleanup
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
