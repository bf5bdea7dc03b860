"""The event log of a session, and the names of the files in a run directory."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from mjsim.support.files import read_text

# Version 2 added state hashes; 3 physics errors; 4 typed checkpoints; 5 distances between visits, ties and
# suggestion gaps; 6 the participant; 7 groups of person parameters.
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
PARTICIPANT = "participant"  # event with the parameters of the participant's body
PHASE_BEGUN, PHASE_ENDED = "phase_begun", "phase_ended"  # events that mark the phases before the task
TRAINING = "training"  # name of the training's run directory within the task's


Event = Mapping[str, Any]


class EventLog:
    """The events of a session, in the order in which they occurred."""

    def __init__(self) -> None:
        self._lines: list[dict[str, Any]] = []

    def append(self, time: float, event: str, **fields: Any) -> None:
        """Log an event at a simulated time in seconds. Raises `RecordError` if a field is not valid JSON."""
        entry = {"t": round(time, 6), "event": event, **fields}
        try:
            json.dumps(entry, allow_nan=False)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordError(f"{event!r} at {time:.2f} s cannot be logged: {error}") from error
        self._lines.append(entry)

    @property
    def events(self) -> list[dict[str, Any]]:
        return list(self._lines)

    @property
    def content(self) -> bytes:
        """The log as JSON lines in ASCII."""
        return b"".join(map(_encoded, self._lines))

    @property
    def entries(self) -> int:
        """The number of lines."""
        return len(self._lines)

    def at(self, entries: list[int]) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        """Return the size in bytes and the hash of the first k lines of the log, for each k in `entries`.

        Both arrays have shape (n,). The hash consists of the first 64 bits of SHA-1.
        """
        texts = [b"", *map(_encoded, self._lines)]
        digest, hashes = hashlib.sha1(usedforsecurity=False), list[bytes]()
        for text in texts:
            digest.update(text)
            hashes.append(digest.digest()[:8])
        sizes = np.cumsum([len(text) for text in texts])
        return sizes[entries], np.frombuffer(b"".join(hashes), "<u8").astype(np.uint64)[entries]

    def restore(self, events: Sequence[Event]) -> None:
        self._lines = [dict(event) for event in events]


def _encoded(line: Event) -> bytes:
    return (json.dumps(line) + "\n").encode()


def read_events(path: Path) -> list[Event]:
    """Read an event log. Raises `RecordError` if the file is missing or a line is not valid JSON."""
    try:
        lines = read_text(path).splitlines()
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
