"""The record of one trial: an append-only event log and a trajectory."""

import contextlib
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

from experiments.errors import RecordError
from mjsim.files import write_text_atomically

# 6: the participant. 5: distances between places, ties, gaps of suggestions. 4: typed checkpoints. 3: untyped ones.
# 2: no health of the physics. 1: neither state hashes nor checkpoints.
LOG_FORMAT = 7
FILES = EPISODE, EVENTS, TRAJECTORY, RECORDING, METRICS, PLAN, TOPDOWN, VIDEO = (
    "episode.json",
    "events.jsonl",
    "trajectory.npz",
    "recording.npz",
    "metrics.json",
    "plan.json",
    "topdown.png",
    "video.mp4",
)
PARTICIPANT = "participant"  # event with all values of the person
PHASE_BEGUN, PHASE_ENDED = "phase_begun", "phase_ended"  # events of what came before the task
TRAINING = "training"  # run directory inside that of the task


Event = Mapping[str, Any]


class EventLog:
    """Append-only JSON lines, flushed line by line so that a crash loses nothing that was logged.

    Where the file cannot be written any more (a full disk), logging goes on in memory; `save` writes it elsewhere.

    Args:
        path: File to create, or None to keep the events in memory only.

    Attributes:
        events: Everything logged so far.
        size: Length of the file so far, bytes.
        hash: First 64 bits of the SHA-1 of the file so far.
        muted: Whether nothing is logged, because what happens was logged before.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._file: TextIO | None = path.open("x", encoding="utf-8") if path else None
        self.events: list[dict[str, Any]] = []
        self.size = 0
        self._digest = LogDigest()
        self.hash = self._digest.hash
        self.muted = False

    def append(self, time: float, event: str, **fields: Any) -> None:
        """Log `event` at simulated `time` s, with JSON-ready fields; nothing while the log is muted."""
        if self.muted:
            return
        self._append({"t": round(time, 6), "event": event, **fields})

    def extend(self, lines: Sequence[str]) -> None:
        """Log again what `lines` gave of another log."""
        for line in lines:
            self._append(json.loads(line))

    def lines(self, first: int = 0) -> list[str]:
        """The lines of the events from the `first` on, without their ends."""
        return [json.dumps(event) for event in self.events[first:]]

    def _append(self, line: dict[str, Any]) -> None:
        self.events.append(line)
        text = json.dumps(line) + "\n"
        self.size += len(text)  # JSON is written as ASCII
        self._digest.update(text.encode())
        self.hash = self._digest.hash
        if self._file:
            try:
                self._file.write(text)
                self._file.flush()
            except OSError:
                self._close()

    def save(self, path: Path) -> None:
        """Write everything so far to `path`, whole or not at all, unless that is there already."""
        if not path.is_file() or path.stat().st_size != self.size:
            write_text_atomically(path, "".join(json.dumps(line) + "\n" for line in self.events))

    def _close(self) -> None:
        if self._file:
            with contextlib.suppress(OSError):  # what could not be written is in memory
                self._file.close()
            self._file = None

    def __enter__(self) -> "EventLog":
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()


class LogDigest:
    """A running hash of an event log."""

    def __init__(self) -> None:
        self._sha = hashlib.sha1(usedforsecurity=False)

    def update(self, content: bytes) -> None:
        """Take in what the log is longer by."""
        self._sha.update(content)

    @property
    def hash(self) -> int:
        """First 64 bits of the SHA-1 of everything so far."""
        return int.from_bytes(self._sha.digest()[:8], "little")


def read_events(path: Path) -> list[Event]:
    """Read an event log.

    Raises:
        RecordError: The file is missing, or a line is not JSON; the message names file and line.
    """
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except OSError as error:
        raise RecordError(f"cannot read {path}: {error.strerror}") from error
    except UnicodeDecodeError as error:
        raise RecordError(f"{path} is not UTF-8: {error}") from error
    events: list[Event] = []
    for number, line in enumerate(lines, start=1):
        try:
            events.append(json.loads(line))
        except (json.JSONDecodeError, RecursionError) as error:
            raise RecordError(f"{path}, line {number} is not JSON: {error}") from error
    return events
