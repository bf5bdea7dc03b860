"""The participant of a session, as the server of trials sees them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol


@dataclass(frozen=True)
class LiveTrial:
    """A trial that a participant plays.

    Attributes:
        phase: Name of the phase, `training` or `task`.
        journal: Folder of the journal.
        run: Run directory that the trial will become.
        config: Settings of the trial.
        before: Phases before the trial, as fields of `phase_ended` events.
        leave_at: When the participant may end the trial by hand, in seconds of the monotonic clock; infinite for never.
        floor_plan: True if the run gets a picture of its paths.
        language: Language of the HUD.
        texts: Words that replace those of the HUD in this language.
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
        """Return the trial that is next or under way. None if the next phase is not a trial."""
        ...

    async def over(self, trial: LiveTrial) -> None:
        """Record that the run directory of a trial has been written, and move on to the next phase."""
        ...


class Meter:
    """Forgets what it is told; see subclasses."""

    def acknowledged(self, seconds: float) -> None:
        """The inputs of a message are safe, so long after they came."""

    def worker_lost(self) -> None:
        """The worker of a session has died."""
