"""Visits of people, kept on the disk: which link belongs to which folder, and how far the visit has got.

A link holds a token that cannot be guessed. Only its SHA-256 is kept, as the name of the visit's folder.
"""

import hashlib
import re
import secrets
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


class _Stored(msgspec.Struct, frozen=True):
    """`visit.json`.

    Attributes:
        phase: Phase that is next or under way.
        phases: All of them, in order.
        trials: Settings of its trials by phase.
        version: Of this format.
    """

    phase: str
    phases: list[str]
    trials: dict[str, dict[str, Any]]
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

    def finish(self, phase: str) -> None:
        """Go on to the phase after this one; nothing happens if the visit is further already.

        Raises:
            OSError: The folder cannot be written.
        """
        if phase == self.phase:
            after = self._stored.phases[self._stored.phases.index(phase) + 1 :]
            self._stored = msgspec.structs.replace(self._stored, phase=after[0] if after else RESULT)
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

    def create(self, phases: Sequence[str], trials: Mapping[str, dict[str, Any]]) -> str:
        """Begin a visit; its token.

        Args:
            phases: Its phases, in order.
            trials: Settings of its trials by phase.

        Raises:
            OSError: The folder cannot be written.
        """
        token = secrets.token_urlsafe(32)
        folder = self._folder / token_hash(token)
        folder.mkdir()
        visit = Visit(folder, _Stored(phases[0], list(phases), dict(trials)))
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
