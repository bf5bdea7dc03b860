"""The number of sessions that a machine can run, estimated from the CPU time of those under way."""

import os
import time
from collections import deque
from collections.abc import Collection, Mapping
from contextlib import suppress
from pathlib import Path

from experiments.web.server.played_session import PlayedSession

SHARE = 0.7  # usable share of the cores; the rest is a reserve for peaks
MOST = 1 / 3  # cores of a session whose frames are drawn on the server, assumed for new sessions
SERVER = 0.7  # load of the server's own core above which no session is admitted
WINDOWS = 6  # measurements per session, of which the largest counts
QUOTA = Path(
    "/sys/fs/cgroup/cpu.max"
)  # quota of a container: time per period, and the period, in microseconds


class Capacity:
    """Estimates how many sessions fit on the machine.

    Args:
        cores: Number of cores for sessions and server.
    """

    def __init__(self, cores: float) -> None:
        self._cores = cores
        self._seen: dict[
            str, tuple[float, float]
        ] = {}  # time and CPU time of the last measurement of running sessions
        self._shares: dict[str, deque[float]] = {}
        self._own = time.monotonic(), time.process_time()

    def measure(self, sessions: Mapping[str, PlayedSession], held: Collection[str]) -> int:
        """Return the number of sessions that fit, at least one. Call this every few seconds.

        Args:
            sessions: Sessions under way, by name.
            held: Names of the sessions with a slot.
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
    """Return the number of usable cores, by the process's affinity and its container's quota."""
    cores = float(len(os.sched_getaffinity(0)))
    with suppress(OSError, ValueError):
        quota, period = QUOTA.read_text().split()
        cores = min(cores, float(quota) / float(period))  # a ValueError for "max", which is no limit
    return cores
