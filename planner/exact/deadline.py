"""When to stop."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Deadline:
    """A point in time, `time.perf_counter()`; None is never."""

    at: float | None

    def over(self) -> bool:
        """Whether it has passed."""
        return self.at is not None and time.perf_counter() >= self.at
