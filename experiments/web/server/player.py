"""Interfaces between the server of live trials and the code that schedules a participant's trials."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class LiveTrial:
    """A trial to be played in a browser.

    Attributes:
        run: Path of the run directory to be written.
        before: Fields of the `phase_ended` events of earlier phases.
        leave_at: Monotonic time from which the participant may end the trial, in seconds, or infinity.
        texts: HUD texts that override those of the language.
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


class Player(Protocol):
    """A participant who plays trials.

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
    """Receiver of session metrics. This implementation discards them."""

    def acknowledged(self, seconds: float) -> None:
        """Record how long inputs took from their arrival until they were on disk."""

    def worker_lost(self) -> None:
        """Record that the worker of a session has died."""
