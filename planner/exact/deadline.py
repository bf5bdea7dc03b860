"""When to stop."""

import threading
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Deadline:
    """A point in time, of `time.perf_counter()` (None is never), or an event that another thread sets."""

    at: float | None
    stop: threading.Event | None = None

    def over(self) -> bool:
        """Whether the time has passed or the event is set."""
        stopped = self.stop is not None and self.stop.is_set()
        return stopped or (self.at is not None and time.perf_counter() >= self.at)


NEVER = Deadline(None)
