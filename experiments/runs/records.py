"""The record of one trial: an append-only event log and a trajectory."""

import contextlib
import hashlib
import json
from collections import deque
from collections.abc import Mapping, Sequence
from concurrent.futures import Future
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, TextIO

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from mjsim.files import write_text_atomically

# 7: groups of a person's values. 6: the participant. 5: distances between places, ties, gaps of suggestions.
# 4: typed checkpoints. 3: untyped ones. 2: no health of the physics. 1: neither state hashes nor checkpoints.
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
        muted: Whether nothing is logged, because what happens was logged before.
    """

    def __init__(self, path: Path | None = None) -> None:
        self._file: TextIO | None = path.open("x", encoding="utf-8") if path else None
        self._events: list[dict[str, Any]] = []
        self._digest = LogDigest()
        self._waiting: deque[dict[str, Any] | _Promised] = deque()
        self._sizes, self._hashes = [0], [self._digest.hash]  # of the file after so many entries
        self._given_away = 0  # entries that `take_lines` gave
        self.muted = False

    def append(self, time: float, event: str, **fields: Any) -> None:
        """Log `event` at simulated `time` s, with JSON-ready fields; nothing while the log is muted."""
        if self.muted:
            return
        self._waiting.append({"t": round(time, 6), "event": event, **fields})
        self._settle(wait=False)

    def append_later(self, time: float, event: str, fields: "Future[Mapping[str, Any] | None]") -> None:
        """Log an event whose fields are being worked out; none if they are None. Later events wait for it.

        What raises in working them out is raised by whatever uses the log next.
        """
        if not self.muted:
            self._waiting.append(_Promised(time, event, fields))

    @property
    def events(self) -> list[dict[str, Any]]:
        """Everything logged so far, or since `take_lines`."""
        self._settle(wait=True)
        return self._events

    @property
    def size(self) -> int:
        """Length of the file so far, bytes."""
        self._settle(wait=True)
        return self._sizes[-1]

    @property
    def hash(self) -> int:
        """First 64 bits of the SHA-1 of the file so far."""
        self._settle(wait=True)
        return self._hashes[-1]

    @property
    def entries(self) -> int:
        """How many events were logged so far, those included whose fields are being worked out."""
        return self._given_away + len(self._sizes) - 1 + len(self._waiting)

    def at(self, entries: Sequence[int]) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        """What size and hash were after so many `entries`, none given away, each of shape (n,)."""
        self._settle(wait=True)
        kept = np.subtract(entries, self._given_away)
        return np.array(self._sizes, np.int64)[kept], np.array(self._hashes, np.uint64)[kept]

    def extend(self, lines: Sequence[str]) -> None:
        """Log again what `lines` gave of another log."""
        for line in lines:
            self._waiting.append(json.loads(line))
        self._settle(wait=False)

    def take_lines(self) -> list[str]:
        """The lines of the events since the last call, without their ends. Whoever takes them keeps them: they are not
        kept here any longer."""
        lines = [json.dumps(event) for event in self.events]
        self._given_away += len(self._sizes) - 1
        self._events, self._sizes, self._hashes = [], self._sizes[-1:], self._hashes[-1:]
        return lines

    def _settle(self, *, wait: bool) -> None:
        """Write what waits, up to the first event whose fields are not known unless it shall `wait` for them."""
        while self._waiting:
            entry = self._waiting[0]
            if not wait and isinstance(entry, _Promised) and not entry.fields.done():
                return
            self._waiting.popleft()
            self._append(entry.line() if isinstance(entry, _Promised) else entry)

    def _append(self, line: dict[str, Any] | None) -> None:
        text = "" if line is None else json.dumps(line) + "\n"
        self._digest.update(text.encode())
        self._sizes.append(self._sizes[-1] + len(text))  # JSON is written as ASCII
        self._hashes.append(self._digest.hash)
        if line is not None:
            self._events.append(line)
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


@dataclass(frozen=True, eq=False)
class _Promised:
    """An event whose fields are being worked out."""

    time: float
    event: str
    fields: "Future[Mapping[str, Any] | None]"

    def line(self) -> dict[str, Any] | None:
        """What is logged; waits for the fields."""
        fields = self.fields.result()
        return None if fields is None else {"t": round(self.time, 6), "event": self.event, **fields}


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
