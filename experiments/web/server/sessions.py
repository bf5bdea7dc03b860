"""Manage live sessions: release idle sessions, and estimate how many sessions the machine can run."""

import asyncio
import os
import time
from collections import deque
from collections.abc import Callable, Collection, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

from experiments.web import protocol
from experiments.web.server.limit import SessionLimit
from experiments.web.server.played_session import PlayedSession
from experiments.web.server.player import Meter, Player
from experiments.web.server.pool import WorkerPool

WATCH_PERIOD = 5.0  # interval between searches for abandoned sessions, in seconds
MAX_AWAY = 20.0  # how long a session without a page keeps its slot while other pages wait, in seconds
SHARE = 0.7  # fraction of the cores that sessions may use; the rest is reserved for load peaks
MOST = 1 / 3  # assumed load of a new session whose frames are drawn on the server, in cores
SERVER = 0.7  # CPU load of the server process above which no session is admitted
WINDOWS = 6  # number of recent load measurements per session, of which the largest is used
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # file with the CPU quota and its period, in microseconds


class Capacity:
    """An estimator of how many sessions can run on the machine."""

    def __init__(self, cores: float) -> None:
        self._cores = cores
        self._seen: dict[str, tuple[float, float]] = {}  # time and CPU time of the last measurement
        self._shares: dict[str, deque[float]] = {}
        self._own = time.monotonic(), time.process_time()

    def measure(self, sessions: Mapping[str, PlayedSession], held: Collection[str]) -> int:
        """Return the number of sessions that can run, at least one. Call this every few seconds.

        Args:
            held: Names of the sessions that occupy a slot.
        """
        now = time.monotonic()
        before, self._own = self._own, (now, time.process_time())
        server = (self._own[1] - before[1]) / max(now - before[0], 1.0)
        for name in held:
            self._measure(name, now, sessions[name].processor_time if name in sessions else None)
        for name in self._shares.keys() - set(held):
            del self._shares[name]
            self._seen.pop(name, None)
        taken = server + sum(max(self._shares[name], default=MOST) for name in held)
        room = 0.0 if server > SERVER else SHARE * self._cores - taken
        return max(1, len(held) + max(0, int(room / MOST)))

    def _measure(self, name: str, now: float, processor_time: float | None) -> None:
        shares = self._shares.setdefault(name, deque(maxlen=WINDOWS))
        before = self._seen.pop(name, None)
        if processor_time is None:
            return
        self._seen[name] = now, processor_time
        if before is not None and now > before[0] and processor_time >= before[1]:
            shares.append((processor_time - before[1]) / (now - before[0]))


class Sessions:
    """The live sessions of a server. A session that is inactive for `idle` seconds releases its worker.

    If `capacity` is given, the limit of concurrent sessions follows its estimates.
    """

    def __init__(
        self,
        pool: WorkerPool,
        limit: SessionLimit,
        idle: float,
        meter: Meter | None = None,
        capacity: Capacity | None = None,
    ) -> None:
        self._pool, self.limit, self._idle = pool, limit, idle
        self._meter, self._capacity = meter, capacity
        self.under_way: dict[str, PlayedSession] = {}  # sessions by participant key
        self._scenes: dict[str, str] = {}  # URL path of each house's scene, as reported by workers

    def of(self, player: Player, *, as_inputs_come: bool = False) -> PlayedSession:
        """Return a participant's session. Create the session if it does not exist.

        If `as_inputs_come` is true, the clock of a new session advances with the inputs, not in real time.
        """
        if player.key not in self.under_way:
            self.under_way[player.key] = PlayedSession(
                player,
                self._pool,
                self.limit,
                self._scenes,
                self._meter,
                as_inputs_come=as_inputs_come,
            )
        return self.under_way[player.key]

    def scene(self, settings: Mapping[str, Any]) -> str | None:
        """Return the URL path of the scene that a trial's page will probably draw, or None if unknown."""
        return None if settings["draw"] == "server" else self._scenes.get(settings["house"])

    async def watch(self) -> None:
        """Until cancelled, release abandoned sessions and update the capacity estimate periodically."""
        while True:
            await asyncio.sleep(WATCH_PERIOD)
            await self.release(self._is_idle)
            learnt = self._capacity and self._capacity.measure(self.under_way, self.limit.held)
            self.limit.count = learnt or self.limit.count

    async def release(self, which: Callable[[PlayedSession], bool] = lambda _: True) -> None:
        for session in [session for session in self.under_way.values() if which(session)]:
            if session.browser is not None:
                session.browser.send(protocol.Error("idle", "nothing was received for a long time"))
                session.browser.close(protocol.IDLE, "idle")
            await session.release()
            self.under_way.pop(session.player.key, None)

    def _is_idle(self, session: PlayedSession) -> bool:
        """Return True if the participant has been inactive for too long.

        The limit is shorter if the page is closed and other pages wait.
        """
        closed = session.browser is None and self.limit.waiting > 0
        return time.monotonic() - session.heard > (min(MAX_AWAY, self._idle) if closed else self._idle)


def usable_cores() -> float:
    """Return the number of CPU cores that the process may use, given its affinity and container quota."""
    cores = float(len(os.sched_getaffinity(0)))
    with suppress(OSError, ValueError):
        quota, period = QUOTA.read_text().split()
        cores = min(cores, float(quota) / float(period))  # raises ValueError for "max", which means no limit
    return cores
