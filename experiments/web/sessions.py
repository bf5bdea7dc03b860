"""All sessions under way, and which of them give their place to others."""

import asyncio
import time
from collections.abc import Callable, Sequence

from experiments.web import protocol
from experiments.web.played_session import PlayedSession
from experiments.web.pool import Places, Pool
from experiments.web.visits import Visit

WATCH_PERIOD = 5.0  # s between two looks for sessions whose person is gone
AWAY = 20.0  # s that a place is kept without a page while others wait


class Sessions:
    """All sessions under way, by the name of their visit.

    Args:
        pool: Gives workers.
        places: Limits how many are open at a time.
        idle: After so many seconds without a sign of the person, a session gives its worker back.
    """

    def __init__(self, pool: Pool, places: Places, idle: float) -> None:
        self._pool, self._places, self._idle = pool, places, idle
        self._sessions: dict[str, PlayedSession] = {}

    def of(self, visit: Visit) -> PlayedSession:
        """The session of a visit."""
        if visit.name not in self._sessions:
            self._sessions[visit.name] = PlayedSession(visit, self._pool, self._places)
        return self._sessions[visit.name]

    async def watch(self) -> None:
        """Release sessions whose person is gone, for ever."""
        while True:
            await asyncio.sleep(WATCH_PERIOD)
            await self.release(self._idles)

    async def release(self, which: Callable[[PlayedSession], bool] = lambda _: True) -> None:
        """Release those sessions, and forget those without a browser."""
        for session in self._select(which):
            if session.browser is not None:
                session.browser.send(protocol.Error("idle", "nothing was heard of you for long"))
                session.browser.close(protocol.IDLE, "idle")
            await session.release()
            self._sessions.pop(session.visit.name, None)

    def _idles(self, session: PlayedSession) -> bool:
        """Whether nothing was heard of a person for long; not so long where others wait and the page is closed."""
        closed = session.browser is None and self._places.waiting > 0
        return time.monotonic() - session.heard > (min(AWAY, self._idle) if closed else self._idle)

    def _select(self, which: Callable[[PlayedSession], bool]) -> Sequence[PlayedSession]:
        return [session for session in self._sessions.values() if which(session)]
