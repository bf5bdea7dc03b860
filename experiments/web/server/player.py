"""Interfaces between the server for live trials and the code that schedules a participant's trials."""

from dataclasses import dataclass
from typing import Protocol

from experiments.web.protocol import Open


@dataclass(frozen=True)
class LiveTrial:
    """A trial that a participant completes in a browser.

    Attributes:
        leave_at: Monotonic time in seconds from which the participant may end the trial. It may be infinite.
        opening: Message that opens the trial in a worker.
    """

    phase: str
    leave_at: float
    opening: Open


class Player(Protocol):
    """The interface of a participant who completes trials.

    Attributes:
        key: Name of the participant's slot and session, which is the same in all connections.
    """

    key: str

    async def trial(self) -> LiveTrial | None:
        """Return the next or current trial, or None if the current phase is not a trial."""
        ...

    async def over(self) -> None:
        """Record that the current trial's run directory is complete, and advance to the next phase."""
        ...


class Meter:
    """A receiver of session metrics. This base class discards them."""

    def acknowledged(self, seconds: float) -> None:
        """Record how many seconds passed between the arrival of inputs and their storage on disk."""

    def worker_lost(self) -> None:
        """Record that the worker of a session has died."""
