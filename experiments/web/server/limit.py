"""Limit the number of concurrent sessions, and queue the pages that wait for a slot."""

import time
from collections import deque
from collections.abc import Collection
from statistics import fmean

ADMITTED_S = 60.0  # how long the slot of an admitted page is reserved, in seconds
FORGOTTEN_S = 3600.0  # time without polling after which a page loses its position in the queue, in seconds


class SessionLimit:
    """A limit on the number of concurrent sessions. Slots are given out by name, first come, first served.

    The number of slots `count` may change. Running sessions then keep their slots.
    A waiting page polls for a slot with :meth:`ask`. If it stops polling, later pages may overtake it, but it
    regains its position when it polls again. The session of an admitted page then calls :meth:`hold`.
    """

    def __init__(self, count: int) -> None:
        self.count = count
        self._held: dict[str, float] = {}  # expiry time of each slot, by name
        self._queue: dict[str, float] = {}  # deadline of each page's next poll, by name
        self._durations: deque[float] = deque(maxlen=100)

    @property
    def held(self) -> Collection[str]:
        return self._held.keys()

    @property
    def waiting(self) -> int:
        return len(self._present())

    def expected_wait(self, position: int, default: float) -> float:
        """Return the expected wait at a position in the queue, in seconds.

        Until a session has ended, sessions are assumed to last `default` seconds.
        """
        return position * (fmean(self._durations) if self._durations else default) / self.count

    def ask(self, name: str, patience: float) -> int | None:
        """Request a slot for a page. Return its position in the queue, or None if it has a slot.

        The page must repeat the request within `patience` seconds.
        """
        self._tidy()
        now = time.monotonic()
        if name not in self._held:
            self._queue[name] = now + patience
            position = self._present().index(name) + 1
            if position > self._free:
                return position - self._free
            del self._queue[name]
            self._held[name] = 0.0
        self._held[name] = max(self._held[name], now + ADMITTED_S)
        return None

    def hold(self, name: str) -> bool:
        """Occupy a slot for a session until :meth:`release` is called. Return False if the page must wait."""
        self._tidy()
        if name not in self._held and (name in self._queue or len(self._present()) >= self._free):
            return False
        self._held[name] = float("inf")
        return True

    def release(self, name: str, duration: float | None = None) -> None:
        """Release a slot. `duration` is the session's duration in seconds, or None if it has not ended."""
        if duration is not None:
            self._durations.append(duration)
        self._held.pop(name, None)

    @property
    def _free(self) -> int:
        return max(0, self.count - len(self._held))

    def _present(self) -> list[str]:
        now = time.monotonic()
        return [name for name, until in self._queue.items() if until > now]

    def _tidy(self) -> None:
        now = time.monotonic()
        self._held = {name: until for name, until in self._held.items() if until > now}
        self._queue = {name: until for name, until in self._queue.items() if until > now - FORGOTTEN_S}
