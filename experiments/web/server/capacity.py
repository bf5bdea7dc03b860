"""How many sessions a machine holds, learnt from what those under way take of its cores."""

import os
import time
from collections import deque
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path

from experiments.web.server.played_session import PlayedSession

SHARE = 0.7  # of the cores that may be taken; the rest is for moments in which much happens at once
MOST = (
    1 / 3
)  # of a core that a session takes whose frames are drawn here; one that is not measured yet counts as that
SERVER = 0.7  # of the one core that the server can take, above which nobody is let in
WINDOWS = 6  # measurements of a session, of which the largest counts
QUOTA = Path("/sys/fs/cgroup/cpu.max")  # of a container: time in a period, and the period, in microseconds


class Capacity:
    """Learns how many sessions the cores hold.

    Args:
        cores: That sessions and server may use.
    """

    def __init__(self, cores: float) -> None:
        self._cores = cores
        self._seen: dict[str, tuple[float, float]] = {}  # when, and processor time then, of running sessions
        self._shares: dict[str, deque[float]] = {}
        self._own = time.monotonic(), time.process_time()

    def measure(self, sessions: Mapping[str, PlayedSession], held: Collection[str]) -> int:
        """How many sessions there may be, at least one; call it every few seconds.

        Args:
            sessions: Those under way, by name.
            held: Names of those that have a place.
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


def usable_cores() -> float:
    """How many cores this process may use, by its affinity and the quota of its container."""
    cores = float(len(os.sched_getaffinity(0)))
    with suppress(OSError, ValueError):
        quota, period = QUOTA.read_text().split()
        cores = min(cores, float(quota) / float(period))  # a ValueError for "max", which is no limit
    return cores
