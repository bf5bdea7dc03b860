"""All sessions under way, and which of them give their place to others."""

import asyncio
import time
from collections.abc import Callable, Mapping
from typing import Any

from experiments.web import protocol
from experiments.web.server.capacity import Capacity
from experiments.web.server.limit import SessionLimit
from experiments.web.server.played_session import PlayedSession
from experiments.web.server.player import Meter, Player
from experiments.web.server.pool import WorkerPool

WATCH_PERIOD = 5.0  # s between two looks for sessions whose person is gone
MAX_AWAY = 20.0  # s that a place is kept without a page while others wait


class Sessions:
    """All sessions under way; after `idle` seconds without a sign of the person, one gives its worker back.

    With a `capacity`, the limit follows what the machine holds.
    """

    def __init__(
        self,
        pool: WorkerPool,
        limit: SessionLimit,
        idle: float,
        meter: Meter | None = None,
        capacity: Capacity | None = None,
    ) -> None:
        self._pool, self._limit, self._idle = pool, limit, idle
        self._meter, self._capacity = meter, capacity
        self._sessions: dict[str, PlayedSession] = {}
        self._scenes: dict[str, str] = {}  # by house, of those that a worker has named

    def of(self, player: Player, *, as_inputs_come: bool = False) -> PlayedSession:
        """Return the session of a participant.

        With `as_inputs_come`, its clock runs as fast as inputs come, not in real time.
        """
        if player.key not in self._sessions:
            self._sessions[player.key] = PlayedSession(
                player,
                self._pool,
                self._limit,
                self._scenes,
                self._meter,
                as_inputs_come=as_inputs_come,
            )
        return self._sessions[player.key]

    @property
    def under_way(self) -> Mapping[str, PlayedSession]:
        """Sessions by the keys of their participants."""
        return self._sessions

    @property
    def limit(self) -> SessionLimit:
        """How many there may be, and who waits."""
        return self._limit

    def scene(self, settings: Mapping[str, Any]) -> str | None:
        """Folder of the files that the page of a trial will probably draw; None where that is not known."""
        return None if settings["draw"] == "server" else self._scenes.get(settings["house"])

    async def watch(self) -> None:
        """Release sessions whose person is gone, and learn how many the machine holds, for ever."""
        while True:
            await asyncio.sleep(WATCH_PERIOD)
            await self.release(self._is_idle)
            learnt = self._capacity and self._capacity.measure(self._sessions, self._limit.held)
            self._limit.resize(learnt or self._limit.count)

    async def release(self, which: Callable[[PlayedSession], bool] = lambda _: True) -> None:
        """Release the sessions that `which` chooses."""
        for session in [session for session in self._sessions.values() if which(session)]:
            if session.browser is not None:
                session.browser.send(protocol.Error("idle", "nothing was received for a long time"))
                session.browser.close(protocol.IDLE, "idle")
            await session.release()
            self._sessions.pop(session.player.key, None)

    def _is_idle(self, session: PlayedSession) -> bool:
        """Whether the person has been gone for long; for less long where others wait and the page is closed."""
        closed = session.browser is None and self._limit.waiting > 0
        return time.monotonic() - session.heard > (min(MAX_AWAY, self._idle) if closed else self._idle)
