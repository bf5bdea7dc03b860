"""Visits of people, kept on the disk: which link belongs to which folder, and how far the visit has got.

A link holds a token that cannot be guessed. Only its SHA-256 is kept, as the name of the visit's folder.
"""

import hashlib
import re
import secrets
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.runs import records
from experiments.runs.phases import TASK, TRAINING
from experiments.web.journal import sync_folder
from mjsim.files import write_text_atomically

VISIT = "visit.json"
JOURNALS = "journals"
TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")
RESULT = "result"  # what follows the last phase
PLAYED = (TRAINING, TASK)


class Ended(msgspec.Struct, frozen=True, omit_defaults=True):
    """A phase that is over, as the event `phase_ended` has it.

    Attributes:
        phase: Its name.
        duration_s: How long it took, s.
        reason: Why a training ended.
    """

    phase: str
    duration_s: float
    reason: str | None = None


class _Stored(msgspec.Struct, frozen=True):
    """`visit.json`.

    Attributes:
        phase: Phase that is next or under way.
        phases: All of them, in order.
        trials: Settings of its trials by phase.
        ended: Phases that are over.
        shown: When the phase was shown first, s since 1970; None where it was not, or has a clock of its own.
        version: Of this format.
    """

    phase: str
    phases: list[str]
    trials: dict[str, dict[str, Any]]
    ended: list[Ended] = []
    shown: float | None = None
    version: int = 1


class Visit:
    """The visit of one person.

    Args:
        folder: Its folder, named after the hash of its token.
        stored: What is known of it.

    Attributes:
        folder: As above.
    """

    def __init__(self, folder: Path, stored: _Stored) -> None:
        self.folder = folder
        self._stored = stored

    @property
    def name(self) -> str:
        """SHA-256 of the token, hexadecimal."""
        return self.folder.name

    @property
    def phase(self) -> str:
        """Phase that is next or under way; `result` after the last one."""
        return self._stored.phase

    def settings(self, phase: str) -> dict[str, Any]:
        """Settings of the trial of a phase."""
        return self._stored.trials[phase]

    def run(self, phase: str) -> Path:
        """Run directory of a phase."""
        return self.folder / phase

    def journal(self, phase: str) -> Path:
        """Folder of a phase's journal."""
        return self.folder / JOURNALS / phase

    def before(self, phase: str) -> list[dict[str, Any]]:
        """What `phase_ended` events say of the phases before the task; other phases stand by themselves."""
        return [msgspec.to_builtins(ended) for ended in self._stored.ended] if phase == TASK else []

    def show(self) -> None:
        """The phase is shown; its time runs from the first time on.

        Raises:
            OSError: The folder cannot be written.
        """
        if self._stored.shown is None:
            self._stored = msgspec.structs.replace(self._stored, shown=time.time())
            self.save()

    def finish(self, phase: str, duration: float | None = None, reason: str | None = None) -> None:
        """Go on to the phase after this one; nothing happens if the visit is further already.

        Args:
            phase: The one that is over.
            duration: How long it took, s; None for as long as it was shown.
            reason: Why a training ended.

        Raises:
            OSError: The folder cannot be written.
        """
        if phase != self.phase:
            return
        stored, now = self._stored, time.time()
        if duration is None:
            duration = max(0.0, now - (stored.shown or now))
        after = stored.phases[stored.phases.index(phase) + 1 :]
        self._stored = msgspec.structs.replace(
            stored,
            phase=after[0] if after else RESULT,
            ended=[*stored.ended, Ended(phase, round(duration, 3), reason)],
            shown=None,
        )
        self.save()

    def save(self) -> None:
        """Write how far it has got.

        Raises:
            OSError: The folder cannot be written.
        """
        write_text_atomically(self.folder / VISIT, msgspec.json.encode(self._stored).decode())
        sync_folder(self.folder)

    def metrics(self, phase: str) -> dict[str, Any]:
        """What `metrics.json` of a phase's run directory holds.

        Raises:
            OSError: It cannot be read.
        """
        found: dict[str, Any] = msgspec.json.decode((self.run(phase) / records.METRICS).read_bytes())
        return found


class Visits:
    """All visits in a folder.

    Args:
        folder: Is made if it is not there.

    Raises:
        OSError: The folder cannot be made.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._folder = folder
        self._known: dict[str, Visit] = {}

    def create(
        self, phases: Sequence[str], trials: Mapping[str, dict[str, Any]], ended: Sequence[Ended] = ()
    ) -> str:
        """Begin a visit; its token.

        Args:
            phases: Its phases that are still to come, in order.
            trials: Settings of its trials by phase.
            ended: Phases that are over already.

        Raises:
            OSError: The folder cannot be written.
        """
        token = secrets.token_urlsafe(32)
        folder = self._folder / token_hash(token)
        folder.mkdir()
        visit = Visit(folder, _Stored(phases[0], list(phases), dict(trials), list(ended)))
        visit.save()
        sync_folder(self._folder)
        self._known[visit.name] = visit
        return token

    def find(self, token: str) -> Visit | None:
        """The visit that a token belongs to.

        Raises:
            RecordError: Its file is damaged.
        """
        if not TOKEN.fullmatch(token):
            return None
        name = token_hash(token)
        if name not in self._known:
            path = self._folder / name / VISIT
            if not path.is_file():
                return None
            try:
                self._known[name] = Visit(path.parent, msgspec.json.decode(path.read_bytes(), type=_Stored))
            except msgspec.DecodeError as error:
                raise RecordError(f"{path} is damaged: {error}") from error
        return self._known[name]


def token_hash(token: str) -> str:
    """SHA-256 of a token, hexadecimal."""
    return hashlib.sha256(token.encode()).hexdigest()
