"""Visit folders, each of which stores the settings, journals and runs of one participant's trials.

The name of a folder is the SHA-256 of the token in the participant's link. The participant's progress is only
stored in the database.
"""

import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.journal import sync_folder
from experiments.record.phases import TASK, TRAINING
from experiments.record.run_directory import JOURNALS, VISIT
from mjsim.support.files import write_text_atomically

VISITS = "visits"  # name of the subfolder of a study that contains all visit folders


class Ended(msgspec.Struct, frozen=True, omit_defaults=True):
    """A record of a phase that has ended. The fields are those of a `phase_ended` event."""

    phase: str
    duration_s: float
    reason: str | None = None  # reason for the end of a training phase, otherwise None
    attempts: int | None = None


class Stored(msgspec.Struct, frozen=True):
    """The contents of the file `visit.json`, which is written once and never changed."""

    phase: str  # name of the phase in which the folder was created
    phases: list[str]  # names of all phases that have a trial, in order
    trials: dict[str, dict[str, Any]]  # settings of each trial, by phase name
    ended: list[Ended] = []  # phases that ended before the first trial began
    version: int = 1


@dataclass(frozen=True)
class VisitFolder:
    """The folder that stores one participant's visit."""

    path: Path
    stored: Stored

    def settings(self, phase: str) -> dict[str, Any]:
        return self.stored.trials[phase]

    def run(self, phase: str) -> Path:
        return self.path / phase

    def journal(self, phase: str) -> Path:
        return self.path / JOURNALS / phase

    def is_over(self, phase: str) -> bool:
        """Return True if the trial of a phase has ended and its run directory has been written."""
        return (self.run(phase) / records.METRICS).is_file()

    def metrics(self, phase: str) -> dict[str, Any]:
        found: dict[str, Any] = msgspec.json.decode((self.run(phase) / records.METRICS).read_bytes())
        return found

    def before(self, phase: str) -> list[dict[str, Any]]:
        """Return the fields of `phase_ended` events before the task, or an empty list for other phases."""
        if phase != TASK:
            return []
        ended = [one for one in self.stored.ended if one.phase != TRAINING]
        if self.is_over(TRAINING):
            metrics = self.metrics(TRAINING)
            duration = round(metrics.get("completion_time_s", 0.0), 3)
            ended.append(Ended(TRAINING, duration, metrics["ended"]))
        return [msgspec.to_builtins(one) for one in ended]

    @property
    def floor_plan(self) -> Path:
        return self.run(TASK) / records.TOPDOWN


class VisitFolders:
    """A collection of the visit folders of all participants."""

    def __init__(self, path: Path) -> None:
        path.mkdir(parents=True, exist_ok=True)
        self.path = path

    def create(
        self,
        name: str,
        phases: Sequence[str],
        trials: Mapping[str, dict[str, Any]],
        ended: Sequence[Ended] = (),
    ) -> VisitFolder:
        """Create a visit folder, or return the existing one.

        Args:
            name: Hash of the token in the participant's link.
        """
        if (known := self.find(name)) is not None:
            return known
        folder = self.path / name
        folder.mkdir(0o700, exist_ok=True)
        stored = Stored(phases[0], list(phases), dict(trials), list(ended))
        write_text_atomically(folder / VISIT, msgspec.json.encode(stored).decode())
        sync_folder(folder)
        sync_folder(self.path)
        return VisitFolder(folder, stored)

    def remove(self, name: str) -> None:
        """Delete a visit folder, including its journals and runs."""
        shutil.rmtree(self.path / name, ignore_errors=True)
        sync_folder(self.path)

    def find(self, name: str) -> VisitFolder | None:
        """Return the visit folder with this name, or None if there is no such folder.

        Raises:
            RecordError: The folder's `visit.json` is damaged.
        """
        path = self.path / name / VISIT
        try:
            return VisitFolder(path.parent, msgspec.json.decode(path.read_bytes(), type=Stored))
        except (FileNotFoundError, NotADirectoryError):
            return None
        except msgspec.DecodeError as error:
            raise RecordError(f"{path} is damaged: {error}") from error

    def names(self) -> list[str]:
        return sorted(path.parent.name for path in self.path.glob(f"*/{VISIT}"))
