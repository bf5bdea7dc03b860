"""The record of one trial: an append-only event log and a trajectory."""

import contextlib
import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple, TextIO

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.files import save_arrays
from mjsim.actions import Action, Move, Pick, Place
from mjsim.errors import ActionError
from mjsim.files import write_text_atomically
from mjsim.health.values import HealthSample
from mjsim.observation import ObjectStatus, Observation
from mjsim.rollout import Rollout

# 6: the participant. 5: distances between places, ties, gaps of suggestions. 4: typed checkpoints. 3: untyped ones.
# 2: no health of the physics. 1: neither state hashes nor checkpoints.
LOG_FORMAT = 6
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
# Columns of `HealthSample.row`, and how many numbers each has.
HEALTH = {
    "penetration_m": 1,
    "trunk_penetration_m": 1,
    "weld_error_m": 2,
    "weld_error_rad": 2,
    "settle_s": 1,
}
PARTICIPANT = "participant"  # event with all values of the person
PHASE_BEGUN, PHASE_ENDED = "phase_begun", "phase_ended"  # events of what came before the task
TRAINING = "training"  # run directory inside that of the task
STATUS_CODE = {ObjectStatus.LOOSE: 0, ObjectStatus.CARRIED: 1, ObjectStatus.DELIVERED: 2}

_FIRST_CAPACITY = 4096  # rows of a trajectory; doubled when they are full

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


class Trajectory:
    """Poses, actions and the health of the physics of every control step.

    Arrays (T steps, n objects): `time` (T,) s; `position` (T, 2) m; `heading`, `pitch` (T,) rad; `hands` (T, 2)
    object index or -1; `object_position` (T, n, 3) m; `object_quaternion` (T, n, 4) wxyz; `object_status` (T, n)
    0 loose, 1 carried, 2 delivered; `action` (T, 6): kind (0 move, 1 pick, 2 place), object index or -1, then
    forward, left (m/s), turn, look (rad/s). `penetration_m`, `trunk_penetration_m`, `settle_s` (T,), `weld_error_m` and
    `weld_error_rad` (T, 2) are those of `HealthSample`, NaN where there is none. Row t is the state before action t. An
    object index of n + i means the i-th of `unknown_objects`: names in actions that are no object of the house.
    """

    def __init__(self, object_names: Sequence[str]) -> None:
        self._index = {name: i for i, name in enumerate(object_names)}
        self._unknown: list[str] = []
        self._length = 0
        self._columns = _Columns.empty(_FIRST_CAPACITY, len(self._index))
        self._hands: tuple[tuple[str | None, ...], list[int]] = ((), [])
        self._status: tuple[tuple[ObjectStatus, ...], list[int]] = ((), [])

    def append(self, observation: Observation, action: Action, health: HealthSample) -> None:
        """Add one control step."""
        row = self._add_rows(1)
        self._write_state(row, observation, health)
        self._columns.action[row] = self._encode(action)

    def extend(
        self, observation: Observation, health: HealthSample, rollout: Rollout, moves: NDArray[np.float64]
    ) -> None:
        """Add the control steps of a rollout, during which no hand picks up or releases anything.

        Args:
            observation: State before its first step.
            health: The physics before its first step.
            rollout: The states after its steps.
            moves: Forward, left (m/s), turn and look (rad/s) of every step, shape (n, 4).
        """
        if not len(rollout):
            return
        first, columns = self._add_rows(len(rollout)), self._columns
        self._write_state(first, observation, health)
        # A row of the rollout is the state after its action, one of the trajectory the state before it.
        rest = slice(first + 1, self._length)
        columns.time[rest], columns.position[rest] = rollout.states.times[:-1], rollout.states.positions[:-1]
        columns.heading[rest], columns.pitch[rest] = rollout.states.headings[:-1], rollout.states.pitches[:-1]
        columns.object_position[rest] = rollout.states.object_positions[:-1]
        columns.object_quaternion[rest] = rollout.states.object_quaternions[:-1]
        columns.health[rest] = rollout.states.health[:-1]
        columns.hands[rest], columns.object_status[rest] = columns.hands[first], columns.object_status[first]
        columns.action[first : self._length, :2] = 0.0, -1.0
        columns.action[first : self._length, 2:] = moves

    def __len__(self) -> int:
        return self._length

    def arrays(self) -> dict[str, NDArray[Any]]:
        """Everything so far, as arrays by name, shapes as above; views that further steps leave unchanged."""
        arrays = {name: column[: self._length] for name, column in self._columns._asdict().items()}
        health, first = arrays.pop("health"), 0
        for name, width in HEALTH.items():
            arrays[name] = health[:, first : first + width] if width > 1 else health[:, first]
            first += width
        return {**arrays, "unknown_objects": np.array(self._unknown, dtype=np.str_)}

    def save(self, path: Path) -> None:
        """Write a compressed NPZ, whole or not at all."""
        save_arrays(path, self.arrays())

    def _add_rows(self, count: int) -> int:
        """Make room for more rows; the first of them."""
        first = self._length
        self._length += count
        capacity = len(self._columns.time)
        if self._length > capacity:
            grown = _Columns.empty(max(self._length, 2 * capacity), len(self._index))
            for name in _Columns._fields:
                getattr(grown, name)[:first] = getattr(self._columns, name)[:first]
            self._columns = grown
        return first

    def _write_state(self, row: int, o: Observation, health: HealthSample) -> None:
        if o.hands != self._hands[0]:
            self._hands = o.hands, [-1 if name is None else self._index[name] for name in o.hands]
        if o.object_status != self._status[0]:
            self._status = o.object_status, [STATUS_CODE[s] for s in o.object_status]
        columns = self._columns
        columns.time[row], columns.position[row] = o.time, o.position
        columns.heading[row], columns.pitch[row] = o.heading, o.pitch
        columns.object_position[row], columns.object_quaternion[row] = (
            o.object_positions,
            o.object_quaternions,
        )
        columns.hands[row], columns.object_status[row] = self._hands[1], self._status[1]
        columns.health[row] = health.row

    def _encode(self, action: Action) -> tuple[float, ...]:
        if isinstance(action, Move):
            return 0.0, -1.0, action.forward, action.left, action.turn, action.look
        return 1.0 if isinstance(action, Pick) else 2.0, self._number(action.object), 0.0, 0.0, 0.0, 0.0

    def _number(self, name: str | None) -> int:
        if name is None:
            return -1
        if name in self._index:
            return self._index[name]
        if name not in self._unknown:
            self._unknown.append(name)
        return len(self._index) + self._unknown.index(name)


class _Columns(NamedTuple):
    """The columns of a trajectory, in the order in which they are stored."""

    time: NDArray[np.float64]
    position: NDArray[np.float64]
    heading: NDArray[np.float64]
    pitch: NDArray[np.float64]
    hands: NDArray[np.int16]
    object_position: NDArray[np.float64]
    object_quaternion: NDArray[np.float64]
    object_status: NDArray[np.int8]
    action: NDArray[np.float64]
    health: NDArray[np.float64]

    @classmethod
    def empty(cls, rows: int, objects: int) -> "_Columns":
        return cls(
            time=np.empty(rows),
            position=np.empty((rows, 2)),
            heading=np.empty(rows),
            pitch=np.empty(rows),
            hands=np.empty((rows, 2), np.int16),
            object_position=np.empty((rows, objects, 3)),
            object_quaternion=np.empty((rows, objects, 4)),
            object_status=np.empty((rows, objects), np.int8),
            action=np.empty((rows, 6)),
            health=np.empty((rows, sum(HEALTH.values()))),
        )


def decode_action(row: NDArray[np.float64], names: Sequence[str]) -> Action:
    """The action of a row (6,) of a trajectory.

    Args:
        row: kind, object index, forward, left, turn, look.
        names: Names of the objects, then the `unknown_objects`.

    Raises:
        RecordError: The row describes no action.
    """
    kind, number = float(row[0]), float(row[1])
    if kind == 0.0:
        try:
            return Move(*(float(v) for v in row[2:]))
        except ActionError as error:
            raise RecordError(f"an action is unusable: {error}") from error
    if kind not in (1.0, 2.0) or not number.is_integer() or not -1 <= number < len(names):
        raise RecordError(f"{row.tolist()} describes no action of an episode with {len(names)} object names")
    name = None if number < 0 else names[int(number)]
    return Pick(name) if kind == 1.0 else Place(name)


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
