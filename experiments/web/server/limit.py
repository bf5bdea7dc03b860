"""The limit of sessions at a time, and the queue of pages that wait for a slot."""

import time
from collections import deque
from collections.abc import Collection
from statistics import fmean

ADMITTED_S = 60.0  # how long a slot is kept for a page that was admitted, until its session takes it
FORGOTTEN_S = 3600.0  # silence after which a page loses its position in the queue


class SessionLimit:
    """Limits how many sessions are open at a time, first come, first served. Sessions have names.

    A page that waits asks for a slot again and again (:meth:`ask`). While it is silent, others go before it. Once it
    asks again, it has its position back. The session of an admitted page takes the slot (:meth:`hold`).
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._held: dict[str, float] = {}  # until when
        self._queue: dict[str, float] = {}  # until when a page is expected to ask again
        self._durations: deque[float] = deque(maxlen=100)

    @property
    def count(self) -> int:
        return self._count

    @property
    def held(self) -> Collection[str]:
        return self._held.keys()

    @property
    def waiting(self) -> int:
        return len(self._present())

    def expected_wait(self, position: int, default: float) -> float:
        """Expected wait at a position in the queue, in seconds.

        `default` is the duration of a session that is assumed until one has ended.
        """
        return position * (fmean(self._durations) if self._durations else default) / self._count

    def resize(self, count: int) -> None:
        """Change the number of slots. Sessions that hold one keep it."""
        self._count = count

    def ask(self, name: str, patience: float) -> int | None:
        """Ask for a slot for a page. Return its position in the queue, or None if it has a slot.

        The page asks again within `patience` seconds.
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
        """Take a slot for a session until :meth:`release`. Return False if its page has to wait first."""
        self._tidy()
        if name not in self._held and (name in self._queue or len(self._present()) >= self._free):
            return False
        self._held[name] = float("inf")
        return True

    def release(self, name: str, duration: float | None = None) -> None:
        """Return a slot. `duration` is how long a session that ended took, in seconds."""
        if duration is not None:
            self._durations.append(duration)
        self._held.pop(name, None)

    @property
    def _free(self) -> int:
        return max(0, self._count - len(self._held))

    def _present(self) -> list[str]:
        """Names of the pages that are not silent, in order."""
        now = time.monotonic()
        return [name for name, until in self._queue.items() if until > now]

    def _tidy(self) -> None:
        """Take back slots that no session took, and forget pages that are gone."""
        now = time.monotonic()
        self._held = {name: until for name, until in self._held.items() if until > now}
        self._queue = {name: until for name, until in self._queue.items() if until > now - FORGOTTEN_S}
