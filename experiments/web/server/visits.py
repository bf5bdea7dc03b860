"""Visits of people, kept on the disk: which link belongs to which folder, and the phase that is under way.

A link holds a token that cannot be guessed. Only its SHA-256 is kept, as the name of the visit's folder.
"""

import hashlib
import re
import secrets
import shutil
import threading
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.journal import sync_folder
from experiments.record.phases import TASK, TRAINING
from experiments.record.run_directory import VISIT
from experiments.trials.trial_config import MAX_SEED
from mjsim.support.files import write_text_atomically

JOURNALS = "journals"
TOKEN = re.compile(r"[A-Za-z0-9_-]{43}")
RESULT = "result"  # follows the last phase
PLAYED = (TRAINING, TASK)


class Ended(msgspec.Struct, frozen=True, omit_defaults=True):
    """A phase that is over, as the event `phase_ended` has it; `reason` tells why a training ended."""

    phase: str
    duration_s: float
    reason: str | None = None
    attempts: int | None = None


class _Stored(msgspec.Struct, frozen=True):
    """`visit.json`."""

    phase: str  # phase that is next or under way
    phases: list[str]  # all phases, in order
    trials: dict[str, dict[str, Any]]  # settings of the trials, by phase
    ended: list[Ended] = []  # phases that are over
    # when the phase was shown first, s of the monotonic clock; None if it was not
    shown: float | None = None
    version: int = 1  # of this format


class Visit:
    """The visit of one person; its folder is named after the hash of its token."""

    def __init__(self, folder: Path, stored: _Stored) -> None:
        self._folder, self._stored = folder, stored
        self._lock = threading.Lock()

    @property
    def name(self) -> str:
        """SHA-256 of the token, hexadecimal."""
        return self._folder.name

    @property
    def phase(self) -> str:
        """Phase that is next or under way; `result` after the last one."""
        return self._stored.phase

    def settings(self, phase: str) -> dict[str, Any]:
        """Settings of the trial of a phase."""
        return self._stored.trials[phase]

    def run(self, phase: str) -> Path:
        return self._folder / phase

    def journal(self, phase: str) -> Path:
        return self._folder / JOURNALS / phase

    def before(self, phase: str) -> list[dict[str, Any]]:
        """The phases before the task as `phase_ended` events; none for other phases."""
        return [msgspec.to_builtins(ended) for ended in self._stored.ended] if phase == TASK else []

    def show(self) -> None:
        """Note when the phase was shown for the first time."""
        with self._lock:
            if self._stored.shown is None:
                self._save(shown=time.monotonic())

    def wait(self, minimum: Mapping[str, float]) -> float:
        """How long until the phase under way may be ended, s, by the shortest durations of phases."""
        now = time.monotonic()
        return max(0.0, minimum.get(self.phase, 0.0) - (now - (self._stored.shown or now)))

    def finish(self, phase: str, duration: float | None = None, reason: str | None = None) -> None:
        """Move to the next phase; nothing happens if the visit is further already.

        The duration, s, is by default the time since the phase was shown; `reason` says why a training ended.
        """
        with self._lock:
            if phase != self.phase:
                return
            stored, now = self._stored, time.monotonic()
            if duration is None:
                duration = max(0.0, now - (stored.shown or now))
            after = stored.phases[stored.phases.index(phase) + 1 :]
            ended = [*stored.ended, Ended(phase, round(duration, 3), reason)]
            self._save(phase=after[0] if after else RESULT, ended=ended, shown=None)

    @property
    def floor_plan(self) -> Path:
        """Picture of the paths in the task."""
        return self.run(TASK) / records.TOPDOWN

    def metrics(self, phase: str) -> dict[str, Any]:
        """Content of `metrics.json` of a phase's run directory."""
        found: dict[str, Any] = msgspec.json.decode((self.run(phase) / records.METRICS).read_bytes())
        return found

    def _save(self, **changes: Any) -> None:
        self._stored = msgspec.structs.replace(self._stored, **changes)
        write_text_atomically(self._folder / VISIT, msgspec.json.encode(self._stored).decode())
        sync_folder(self._folder)


class Visits:
    """All visits in a folder, which is made if it is missing.

    Attributes:
        folder: The folder.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self._known: dict[str, Visit] = {}
        self._lock = threading.Lock()
        self._begun = sum(1 for _ in folder.glob(f"*/{VISIT}"))

    def number(self) -> int:
        """Numbers visits from 0, those of earlier servers included; each call is another visit."""
        with self._lock:
            number, self._begun = self._begun, self._begun + 1
        return number

    def create(
        self,
        token: str,
        phases: Sequence[str],
        trials: Mapping[str, dict[str, Any]],
        ended: Sequence[Ended] = (),
    ) -> Visit:
        """Start a visit with the phases to come, settings of their trials, and phases that are over.

        Where there is a visit with `token`, it stays as it is.
        """
        folder = self.folder / token_hash(token)
        if (known := self.named(folder.name)) is not None:
            return known
        folder.mkdir(0o700, exist_ok=True)
        visit = Visit(folder, _Stored(phases[0], list(phases), dict(trials), list(ended)))
        visit._save()
        sync_folder(self.folder)
        self._known[visit.name] = visit
        return visit

    def remove(self, name: str) -> None:
        """Delete a visit with all that was played in it."""
        with self._lock:
            self._known.pop(name, None)
        shutil.rmtree(self.folder / name, ignore_errors=True)
        sync_folder(self.folder)

    def find(self, token: str) -> Visit | None:
        """The visit that a token belongs to; a RecordError where its file is damaged."""
        return self.named(token_hash(token)) if TOKEN.fullmatch(token) else None

    def find_again(self, name: str) -> Visit | None:
        """The visit with a name as its folder has it now, which may have come from another machine."""
        with self._lock:
            self._known.pop(name, None)
        return self.named(name)

    def named(self, name: str) -> Visit | None:
        """The visit with a name; a RecordError where its file is damaged."""
        path = self.folder / name / VISIT
        with self._lock:
            if name not in self._known and path.is_file():
                try:
                    self._known[name] = Visit(
                        path.parent, msgspec.json.decode(path.read_bytes(), type=_Stored)
                    )
                except msgspec.DecodeError as error:
                    raise RecordError(f"{path} is damaged: {error}") from error
            return self._known.get(name)


def new_token() -> str:
    return secrets.token_urlsafe(32)


def following(seed: int, by: int = 1) -> int:
    """A seed so many after another one."""
    return (seed + by) % (MAX_SEED + 1)


def token_hash(token: str) -> str:
    """SHA-256 of a token, hexadecimal."""
    return hashlib.sha256(token.encode()).hexdigest()
