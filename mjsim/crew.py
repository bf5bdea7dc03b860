"""A crew of threads that does many calls at once, again and again, with little said between two rounds."""

from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from threading import Lock, Thread
from types import TracebackType
from typing import Any, Self, TypeVar

from mjsim.errors import ActionError

T = TypeVar("T")


class Crew:
    """Threads, the caller's included, that divide calls among themselves.

    The calls must not share anything that changes. Then results do not depend on the number of threads.
    """

    def __init__(self, threads: int = 1) -> None:
        """Start the threads.

        Raises:
            ActionError: `threads` is below 1.
        """
        if threads < 1:
            raise ActionError(f"threads is {threads}; at least 1 is needed")
        self._hands = [_Hand() for _ in range(threads - 1)]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the threads; calls are then made by the caller's alone."""
        for hand in self._hands:
            hand.end()
        self._hands = []

    def all(self, calls: Sequence[Callable[[], T]]) -> list[T]:
        """Results of all calls; every thread makes its own, whose data are in its cache, then helps the others.

        Raises:
            Exception: What the first call that failed has raised, once all the others are done.
        """
        threads = 1 + len(self._hands)
        results: list[Any] = [None] * len(calls)
        errors: dict[int, BaseException] = {}
        shares = [deque(range(thread, len(calls), threads)) for thread in range(threads)]

        def work(thread: int) -> None:
            for share in (*shares[thread:], *shares[:thread]):
                while share:
                    try:
                        number = share.popleft()
                    except IndexError:  # another thread was quicker
                        break
                    try:
                        results[number] = calls[number]()
                    except Exception as error:
                        errors[number] = error

        for thread, hand in enumerate(self._hands, start=1):
            hand.begin(partial(work, thread))
        work(0)
        for hand in self._hands:
            hand.wait()
        if errors:
            raise errors[min(errors)]
        return results


class _Hand:
    """A thread that works when told to; a pool of futures takes as long to talk to as half a step of the engine."""

    def __init__(self) -> None:
        self._work: Callable[[], None] | None = None
        self._told, self._done = Lock(), Lock()
        self._told.acquire()
        self._done.acquire()
        Thread(target=self._serve, name="crew", daemon=True).start()

    def begin(self, work: Callable[[], None]) -> None:
        """Let the thread do some work, which must not raise."""
        self._work = work
        self._told.release()

    def wait(self) -> None:
        """Until the work is done."""
        self._done.acquire()

    def end(self) -> None:
        """Let the thread end."""
        self._work = None
        self._told.release()

    def _serve(self) -> None:
        while True:
            self._told.acquire()
            if self._work is None:
                return
            self._work()
            self._done.release()
