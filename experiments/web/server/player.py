"""Interfaces between the server for live trials and the code that schedules a participant's trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class LiveTrial:
    """A trial that a participant completes in a browser.

    Attributes:
        run: Path of the run directory to be written.
        before: Fields of the `phase_ended` events of earlier phases.
        leave_at: Monotonic time in seconds from which the participant may end the trial. It may be infinite.
        texts: HUD texts that override those of the language.
        explains_markers: True if the instructions show a picture of the condition's markers.
    """

    phase: str
    journal: Path
    run: Path
    config: Mapping[str, Any]
    before: Sequence[Mapping[str, Any]]
    leave_at: float
    floor_plan: bool = False
    language: str = "en"
    texts: Mapping[str, str] = field(default_factory=dict)
    explains_markers: bool = False


class Player(Protocol):
    """The interface of a participant who completes trials.

    Attributes:
        key: Name of the participant's slot and session, which is the same in all connections.
    """

    key: str

    async def trial(self) -> LiveTrial | None:
        """Return the next or current trial, or None if the current phase is not a trial."""
        ...

    async def over(self, trial: LiveTrial) -> None:
        """Record that the trial's run directory is complete, and advance to the next phase."""
        ...


class Meter:
    """A receiver of session metrics. This base class discards them."""

    def acknowledged(self, seconds: float) -> None:
        """Record how many seconds passed between the arrival of inputs and their storage on disk."""

    def worker_lost(self) -> None:
        """Record that the worker of a session has died."""
