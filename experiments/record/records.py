"""The record of one trial: an append-only event log and a trajectory."""

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from mjsim.support.files import read_text

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
    """The events of a session, in the order in which they happened."""

    def __init__(self) -> None:
        self._lines: list[dict[str, Any]] = []

    def append(self, time: float, event: str, **fields: Any) -> None:
        """Log `event` at simulated `time` s, with JSON-ready fields; `RecordError` as `fill`."""
        self.fill(self.reserve(), time, event, **fields)

    def fill(self, line: dict[str, Any], time: float, event: str, **fields: Any) -> None:
        """Fill in a reserved place.

        Raises:
            RecordError: A value could not be read back, such as NaN.
        """
        entry = {"t": round(time, 6), "event": event, **fields}
        try:
            json.dumps(entry, allow_nan=False)
        except (TypeError, ValueError, RecursionError) as error:
            raise RecordError(f"{event!r} at {time:.2f} s cannot be logged: {error}") from error
        line.update(entry)

    def reserve(self) -> dict[str, Any]:
        """The place of an event that is filled in later, `t` and `event` included; left empty, it is no event."""
        self._lines.append({})
        return self._lines[-1]

    @property
    def events(self) -> list[dict[str, Any]]:
        return [line for line in self._lines if line]

    @property
    def content(self) -> bytes:
        """These events as lines of JSON, in ASCII."""
        return b"".join(map(_encoded, self._lines))

    @property
    def entries(self) -> int:
        """How many places are taken, reserved ones included."""
        return len(self._lines)

    @property
    def event_counts(self) -> NDArray[np.int64]:
        """How many events there are among the first k entries, for each k, shape (entries + 1,)."""
        return np.cumsum([0, *map(bool, self._lines)])

    def at(self, entries: list[int]) -> tuple[NDArray[np.int64], NDArray[np.uint64]]:
        """Length of the content after these numbers of `entries`, bytes, and first 64 bits of its SHA-1, both (n,)."""
        texts = [b"", *map(_encoded, self._lines)]
        digest, hashes = hashlib.sha1(usedforsecurity=False), list[bytes]()
        for text in texts:
            digest.update(text)
            hashes.append(digest.digest()[:8])
        sizes = np.cumsum([len(text) for text in texts])
        return sizes[entries], np.frombuffer(b"".join(hashes), "<u8").astype(np.uint64)[entries]

    def restore(self, events: Sequence[Event]) -> None:
        """Hold these events instead of those logged so far."""
        self._lines = [dict(event) for event in events]


def _encoded(line: Event) -> bytes:
    return (json.dumps(line) + "\n").encode() if line else b""


def read_events(path: Path) -> list[Event]:
    """Read an event log.

    Raises:
        RecordError: The file is missing, or a line is not JSON; the message names file and line.
    """
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
