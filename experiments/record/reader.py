"""Read the record of a session from a run directory or a journal."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError, ReplayError
from experiments.record import records
from experiments.record.columns import (
    RECORDING_LAYOUT,
    STATUSES,
    TRAJECTORY_COLUMNS,
    action_hashes,
    checkpoint_arrays,
    decode_action,
    row_type,
    trajectory_layout,
)
from experiments.record.events import check_event
from experiments.record.files import read_arrays
from experiments.record.journal import Header, JournalEntry
from experiments.record.records import Event, EventLog
from mjsim.support.files import read_bytes
from mjsim.values.actions import StepAction
from mjsim.values.episode import Episode
from mjsim.values.errors import EpisodeError, PersonError
from mjsim.values.observation import Observation
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.state import WorldState


@dataclass(frozen=True, eq=False)
class Record:
    """The record of a session, from which all other files of a run directory can be computed.

    Attributes:
        log: Content of `events.jsonl`.
        trajectory: Arrays of `trajectory.npz`, as in `columns.TRAJECTORY_COLUMNS`, and `unknown_objects`.
        recording: Arrays of `recording.npz`, as in `columns.RECORDING_LAYOUT`.
        participant: State of the participant after the last control step, if the record was read from a journal.
    """

    episode: Episode
    log: bytes
    trajectory: Mapping[str, NDArray[Any]]
    recording: Mapping[str, NDArray[Any]]
    participant: Any = None

    @cached_property
    def events(self) -> tuple[Event, ...]:
        return tuple(json.loads(line) for line in self.log.splitlines())

    @cached_property
    def steps_of_events(self) -> list[int]:
        """The control step at which each event was logged."""
        steps = np.searchsorted(self.recording["log_size"][:-1], self._offsets, side="right") - 1
        return [int(step) for step in np.maximum(0, steps)]

    def events_before(self, step: int) -> int:
        """Return the number of events logged before a control step."""
        return int(np.searchsorted(self._offsets, self.recording["log_size"][step]))

    def events_of(self, step: int) -> tuple[Event, ...]:
        """Return the events logged at a control step. Step 0 includes all earlier events."""
        return self.events[self.events_before(step) if step else 0 : self.events_before(step + 1)]

    @cached_property
    def _offsets(self) -> NDArray[np.int64]:
        return np.cumsum([0, *(len(line) for line in self.log.splitlines(keepends=True)[:-1])])

    @cached_property
    def start(self) -> Event:
        start: Event = json.loads(self.log.split(b"\n", 1)[0])
        return start

    @property
    def end(self) -> Event:
        return self.events[-1]

    @property
    def plans(self) -> list[Event]:
        return [event for event in self.events if event["event"] == "plan"]

    @cached_property
    def person(self) -> PersonParameters:
        """The parameters of the participant's body, including randomly drawn values."""
        try:
            logged = next(event for event in self.events if event["event"] == records.PARTICIPANT)
            return PersonParameters.from_dict(logged["person"])
        except (StopIteration, PersonError, KeyError, TypeError) as error:
            what = str(error) or "no event describes the participant"
            raise ReplayError(f"{records.EVENTS}: {what}; the first bad step is 0", 0) from error

    @property
    def steps(self) -> int:
        """The number of recorded control steps, plus one for the final state."""
        return len(self.recording["state_hash"])

    @property
    def reason(self) -> str | None:
        """The reason why the session ended, or None if it has not ended."""
        return str(self.end.get("reason")) if self.end["event"] == "end" else None

    @cached_property
    def names(self) -> tuple[str, ...]:
        return tuple(placed.name for placed in self.episode.objects)

    def action(self, step: int) -> StepAction:
        """Return the action in a control step. Raises `RecordError` if the recorded action is invalid."""
        unknown = map(str, self.trajectory["unknown_objects"])
        return decode_action(self.trajectory["action"][step], [*self.names, *unknown])

    def observation(self, step: int) -> Observation:
        """Return the observation before a control step.

        Eye height and velocity are not recorded and have nominal values. The assistant does not use them.
        """
        row = {name: column[step] for name, column in self.trajectory.items() if name in TRAJECTORY_COLUMNS}
        left, right = (None if i < 0 else self.names[i] for i in row["hands"])
        return Observation(
            time=float(row["time"]),
            position=row["position"],
            heading=float(row["heading"]),
            pitch=float(row["pitch"]),
            eye=np.array([*row["position"], self.person.eye_height]),
            velocity=np.zeros(2),
            object_names=self.names,
            object_positions=row["object_position"],
            object_quaternions=row["object_quaternion"],
            object_status=tuple(STATUSES[code] for code in row["object_status"]),
            hands=(left, right),
            busy=False,
        )

    @property
    def checkpoint_steps(self) -> list[int]:
        """The control steps at which a checkpoint was taken, in ascending order."""
        return [int(step) for step in self.recording["checkpoint_step"]]

    def checkpoint(self, step: int) -> WorldState:
        """Return the checkpoint that was taken before the given control step."""
        number = self.checkpoint_steps.index(step)
        physics, details = (self.recording[f"checkpoint_{part}"][number] for part in ("physics", "details"))
        return WorldState.from_json(physics, str(details))

    def checkpoint_before(self, time: float) -> int | None:
        """Return the control step of the last checkpoint at or before `time`, in seconds, or None without one."""
        times = self.trajectory["time"]
        return max((step for step in self.checkpoint_steps if times[step] <= time + 1e-9), default=None)


def same_record(one: Record, other: Record) -> bool:
    """Return True if two records are identical bit for bit, apart from the state of the participant."""

    def content(record: Record) -> list[Any]:
        arrays = [*record.trajectory.items(), *record.recording.items()]
        return [(name, array.dtype, array.shape, array.tobytes()) for name, array in sorted(arrays)]

    same = one.episode.to_json() == other.episode.to_json() and one.log == other.log
    return same and content(one) == content(other)


def assemble(
    episode: Episode,
    rows: NDArray[Any],
    log: EventLog,
    unknown: Sequence[str],
    checkpoints: Mapping[int, WorldState],
    participant: Any = None,
) -> Record:
    """Build a record from its parts. `rows` is an array of type `columns.row_type`."""
    trajectory = {name: np.ascontiguousarray(rows[name]) for name in TRAJECTORY_COLUMNS}
    log_size, log_hash = log.at([*rows["logged"], log.entries])
    recording = {
        "state_hash": np.ascontiguousarray(rows["state_hash"]),
        "action_hash": action_hashes(trajectory["action"]),
        "log_size": log_size,
        "log_hash": log_hash,
        # If a session was interrupted, it can have a checkpoint at a control step that was not recorded.
        **checkpoint_arrays({step: state for step, state in checkpoints.items() if step < len(rows)}),
    }
    names = {"unknown_objects": np.array(unknown, np.str_)}
    return Record(episode, log.content, {**trajectory, **names}, recording, participant)


def read_journal(entries: Sequence[Header | JournalEntry]) -> Record:
    """Build a record from the entries of a journal. The session may be unfinished."""
    if not entries or not isinstance(entries[0], Header):
        raise RecordError("the journal is empty")
    episode, log = Episode.from_json(entries[0].episode), EventLog()
    added = [entry for entry in entries if isinstance(entry, JournalEntry)]
    log.restore([json.loads(line) for entry in added for line in entry.events])
    rows = np.frombuffer(b"".join(entry.rows for entry in added), row_type(len(episode.objects)))
    checkpoints = {
        state.step: WorldState.from_json(np.frombuffer(state.physics), state.details)
        for entry in added
        for state in entry.checkpoints
    }
    unknown, participant = (added[-1].unknown, added[-1].participant) if added else ([], None)
    return assemble(episode, rows, log, unknown, checkpoints, participant)


def read_run(directory: Path) -> Record:
    """Read the record in a run directory without verifying it.

    Raises:
        RecordError: The folder is not a run directory.
        ReplayError: A file cannot be read, or the log has the format of another version.
    """
    log = read_log(directory)
    try:
        check_event(log.split(b"\n", 1)[0])
        episode = Episode.load(directory / records.EPISODE)
        trajectory = read_arrays(directory / records.TRAJECTORY, trajectory_layout(len(episode.objects)))
        recording = read_arrays(directory / records.RECORDING, RECORDING_LAYOUT)
    except (RecordError, EpisodeError, OSError, UnicodeDecodeError) as error:
        raise ReplayError(f"{directory}: {error}; the first bad step is 0", 0) from error
    return Record(episode, log, trajectory, recording)


def read_log(directory: Path) -> bytes:
    """Read the event log of a run directory.

    Raises:
        RecordError: The folder is not a run directory.
        ReplayError: The log does not begin with a start event, or has the format of another version.
    """
    if not (directory / records.EVENTS).is_file():
        raise RecordError(f"{directory} is not a run directory: it has no {records.EVENTS}")
    log = read_bytes(directory / records.EVENTS)
    try:
        start = json.loads(log.split(b"\n", 1)[0])
    except (ValueError, RecursionError):
        start = None
    if not isinstance(start, dict) or start.get("event") != "start":
        raise ReplayError(f"{records.EVENTS} does not begin with a start event; the first bad step is 0", 0)
    if (found := start.get("format")) != records.LOG_FORMAT:
        versions = start.get("versions")
        version = versions.get("mjsim", "unknown") if isinstance(versions, dict) else "unknown"
        raise ReplayError(
            f"{directory} has log format {found!r} of mjsim {version}; this version replays format "
            f"{records.LOG_FORMAT} only: replay it with the version that wrote it, or run the trial again"
        )
    return log
