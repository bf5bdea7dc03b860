"""All sessions under way, and the release of idle ones."""

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

WATCH_PERIOD = 5.0  # period of looking for abandoned sessions, in seconds
MAX_AWAY = 20.0  # how long a session without a page keeps its slot while others wait, in seconds


class Sessions:
    """All sessions under way. A session without activity for `idle` seconds releases its worker.

    With a `capacity`, the limit follows the machine's measured capacity.
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
        self._scenes: dict[str, str] = {}  # URL paths of scenes, by house, as reported by workers

    def of(self, player: Player, *, as_inputs_come: bool = False) -> PlayedSession:
        """Return the session of a participant.

        With `as_inputs_come`, its clock follows the inputs instead of real time.
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
        """The limit of concurrent sessions, with its queue."""
        return self._limit

    def scene(self, settings: Mapping[str, Any]) -> str | None:
        """Return the URL path of the scene that a trial's page will probably draw, or None if unknown."""
        return None if settings["draw"] == "server" else self._scenes.get(settings["house"])

    async def watch(self) -> None:
        """Until cancelled, release abandoned sessions and update the capacity estimate."""
        while True:
            await asyncio.sleep(WATCH_PERIOD)
            await self.release(self._is_idle)
            learnt = self._capacity and self._capacity.measure(self._sessions, self._limit.held)
            self._limit.resize(learnt or self._limit.count)

    async def release(self, which: Callable[[PlayedSession], bool] = lambda _: True) -> None:
        """Release the sessions selected by `which`."""
        for session in [session for session in self._sessions.values() if which(session)]:
            if session.browser is not None:
                session.browser.send(protocol.Error("idle", "nothing was received for a long time"))
                session.browser.close(protocol.IDLE, "idle")
            await session.release()
            self._sessions.pop(session.player.key, None)

    def _is_idle(self, session: PlayedSession) -> bool:
        """Return True if the person is away for too long.

        The limit is shorter if the page is closed and others wait.
        """
        closed = session.browser is None and self._limit.waiting > 0
        return time.monotonic() - session.heard > (min(MAX_AWAY, self._idle) if closed else self._idle)
