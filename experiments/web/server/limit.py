"""The limit of sessions at a time, and the queue for a place."""

import asyncio
import time
from collections import deque
from collections.abc import Callable, Collection
from dataclasses import dataclass
from statistics import fmean

ADMITTED = 60.0  # s that a place is kept for a page that was let in, until its session asks for it
FORGOTTEN = 3600.0  # s of silence after which a page has lost its place in the queue
OnPosition = Callable[[int], None]


@dataclass
class _Waiting:
    """Somebody in the queue: a session, with the future of its turn, or a page, heard of until then."""

    until: float = 0.0
    turn: asyncio.Future[None] | None = None
    on_position: OnPosition | None = None

    def is_there(self, now: float) -> bool:
        return self.turn is not None or self.until > now


class SessionLimit:
    """Limits how many sessions are open at a time; who comes first gets the next place. Sessions have names.

    A session waits for its place (:meth:`acquire`), or a page asks for it again and again (:meth:`ask`). While a page
    is silent, others go before it; once it asks again it is where it was in the queue.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._held: dict[str, float] = {}  # until when
        self._queue: dict[str, _Waiting] = {}
        self._durations: deque[float] = deque(maxlen=100)

    @property
    def count(self) -> int:
        return self._count

    @property
    def held(self) -> Collection[str]:
        return self._held.keys()

    @property
    def waiting(self) -> int:
        return len(self._there())

    def position(self, name: str) -> int | None:
        """Position in the queue, 1 for the next one; None for a session that does not wait."""
        there = self._there()
        return there.index(name) + 1 if name in there else None

    def expected_wait(self, position: int, usual: float) -> float:
        """How long it takes until it is the turn of a position, s.

        `usual` is how long a session takes, as long as none has ended.
        """
        return position * (fmean(self._durations) if self._durations else usual) / self._count

    def resize(self, count: int) -> None:
        """Change how many places there are; nobody loses one."""
        self._count = count
        self._tidy()

    def ask(self, name: str, patience: float) -> int | None:
        """Ask for a place for a page: its position in the queue, or None if it has a place.

        The page asks again within `patience`, s.
        """
        self._tidy()
        now = time.monotonic()
        if name not in self._held:
            waiting = self._queue.setdefault(name, _Waiting())
            waiting.until = now + patience
            position = self._there().index(name) + 1
            if position > self._free:
                return position - self._free
            del self._queue[name]
            self._held[name] = 0.0
        self._held[name] = max(self._held[name], now + ADMITTED)
        return None

    async def acquire(self, name: str, on_position: OnPosition) -> None:
        """Wait for a place; `on_position` is called whenever the position in the queue changes."""
        self._tidy()
        if name in self._held or (name not in self._queue and len(self._there()) < self._free):
            self._held[name] = float("inf")
            return
        turn = asyncio.get_running_loop().create_future()
        waiting = self._queue.setdefault(name, _Waiting())
        waiting.turn, waiting.on_position = turn, on_position
        self._give()
        if not turn.done():
            on_position(self._there().index(name) + 1)
        try:
            await turn
        except asyncio.CancelledError:
            if self._queue.pop(name, None) is not None:
                self._give()
            elif not turn.cancelled():
                self.release(name)
            raise

    def release(self, name: str, duration: float | None = None) -> None:
        """Give a place back; a session that ended says how long it took, s."""
        if duration is not None:
            self._durations.append(duration)
        self._held.pop(name, None)
        self._give()

    @property
    def _free(self) -> int:
        return max(0, self._count - len(self._held))

    def _there(self) -> list[str]:
        now = time.monotonic()
        return [name for name, waiting in self._queue.items() if waiting.is_there(now)]

    def _tidy(self) -> None:
        """Take places back that nobody came for, and forget who is gone."""
        now = time.monotonic()
        self._held = {name: until for name, until in self._held.items() if until > now}
        gone = now - FORGOTTEN
        self._queue = {name: one for name, one in self._queue.items() if one.is_there(gone)}
        self._give()

    def _give(self) -> None:
        """Give free places to sessions whose turn it is, and tell the others; a page gets its place when it asks."""
        there = self._there()
        for name in there[: self._free]:
            turn = self._queue[name].turn
            if turn is not None and not turn.done():
                del self._queue[name]
                self._held[name] = float("inf")
                turn.set_result(None)
        for position, name in enumerate(self._there(), start=1):
            on_position = self._queue[name].on_position
            if on_position is not None:
                on_position(position)
