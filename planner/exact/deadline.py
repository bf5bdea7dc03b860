"""When to stop."""

import threading
import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Deadline:
    """A point in time, `time.perf_counter()` (None is never), or somebody else's wish."""

    at: float | None
    stop: threading.Event | None = None

    def over(self) -> bool:
        """Whether it has passed."""
        wished = self.stop is not None and self.stop.is_set()
        return wished or (self.at is not None and time.perf_counter() >= self.at)


NEVER = Deadline(None)
