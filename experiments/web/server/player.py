"""The interface between the server of trials and the participant."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class LiveTrial:
    """A trial to be played.

    Attributes:
        run: Run directory that the trial will become.
        before: Phases before the trial, as fields of `phase_ended` events.
        leave_at: Time of the monotonic clock from which the participant may end the trial, in seconds. May be infinite.
        texts: Texts that replace those of the HUD in this language.
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
        key: Name of the participant's slot and session, the same for every connection.
    """

    key: str

    async def trial(self) -> LiveTrial | None:
        """Return the next or current trial. None if the current phase is not a trial."""
        ...

    async def over(self, trial: LiveTrial) -> None:
        """Record that the trial's run directory has been written, and advance to the next phase."""
        ...


class Meter:
    """Receives session metrics. This one discards them."""

    def acknowledged(self, seconds: float) -> None:
        """Record the time from the arrival of inputs until they were on disk."""

    def worker_lost(self) -> None:
        """Record that the worker of a session has died."""
