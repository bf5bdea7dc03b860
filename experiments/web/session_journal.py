"""What a session's journal holds, and the record of the session that follows from it."""

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.replaying.run_record import RunRecord
from experiments.runs.recording import Recorded, action_hashes
from experiments.runs.records import EventLog
from experiments.runs.trajectory import Trajectory
from experiments.web.controls import Controls
from mjsim.episode import Episode
from mjsim.model.scene import Scene


class Opened(msgspec.Struct, frozen=True, tag="opened"):
    """First record: what is played.

    Attributes:
        config: Settings of the trial.
        episode: The episode, as JSON.
    """

    config: dict[str, Any]
    episode: str


class Checkpoint(msgspec.Struct, frozen=True):
    """A state to go on from: that of the physics (float64), and the rest as JSON."""

    physics: bytes
    details: str
    hash: int


class Step(msgspec.Struct, frozen=True, tag="step"):
    """A control step: the state before it, what the person did, and what was logged up to then.

    Attributes:
        row: Columns of the trajectory.
        state_hash: Of the state before the step.
        log: Lines that were logged since the step before.
        controls: The person's controls after the step.
        input: Number of the last input that counted.
        checkpoint: The state before the step, where the world went through a checkpoint.
    """

    row: dict[str, bytes]
    state_hash: int
    log: list[str]
    controls: Controls
    input: int
    checkpoint: Checkpoint | None = None


class Closed(msgspec.Struct, frozen=True, tag="closed"):
    """Last record: what was logged after the last step; the session is over."""

    log: list[str]


Entry = Opened | Step | Closed
_DECODER: msgspec.msgpack.Decoder[Any] = msgspec.msgpack.Decoder(Opened | Step | Closed)
encode = msgspec.msgpack.Encoder().encode


def decode(journal: Sequence[bytes]) -> tuple[Opened, list[Step], Closed | None]:
    """The entries of a journal.

    Raises:
        RecordError: It does not begin as one of this version does.
    """
    try:
        entries = [_DECODER.decode(entry) for entry in journal]
    except msgspec.DecodeError as error:
        raise RecordError(f"the journal is of another version: {error}") from error
    if not entries or not isinstance(entries[0], Opened):
        raise RecordError("the journal is empty")
    steps = [entry for entry in entries if isinstance(entry, Step)]
    return entries[0], steps, entries[-1] if isinstance(entries[-1], Closed) else None


def arrays_of(episode: Episode, steps: Sequence[Step]) -> dict[str, NDArray[Any]]:
    """The trajectory of a journal, arrays as in `Trajectory`."""
    names = [placed.name for placed in episode.objects]
    arrays = {}
    for name, empty in Trajectory(names).arrays().items():
        content = b"".join(step.row[name] for step in steps) if name != "unknown_objects" else b""
        arrays[name] = np.frombuffer(content, empty.dtype).reshape(-1, *empty.shape[1:])
    return {**arrays, "unknown_objects": np.zeros(0, np.str_)}


def recorded_of(steps: Sequence[Step], arrays: Mapping[str, NDArray[Any]], tail: Sequence[str]) -> Recorded:
    """Hashes and checkpoints of a journal; `tail` holds the lines logged after its last step."""
    log, sizes, hashes = EventLog(), [], []
    for lines in (*(step.log for step in steps), tail):
        log.extend(lines)
        sizes.append(log.size)
        hashes.append(log.hash)
    kept = [(i, step.checkpoint) for i, step in enumerate(steps) if step.checkpoint is not None]
    physics = [np.frombuffer(checkpoint.physics) for _, checkpoint in kept]
    return Recorded(
        state_hash=np.array([step.state_hash for step in steps], np.uint64),
        action_hash=action_hashes(arrays["action"]),
        log_size=np.array(sizes, np.int64),
        log_hash=np.array(hashes, np.uint64),
        checkpoint_step=np.array([i for i, _ in kept], np.int64),
        checkpoint_physics=np.array(physics) if physics else np.zeros((0, 0)),
        checkpoint_details=np.array([checkpoint.details for _, checkpoint in kept], np.str_),
        checkpoint_hash=np.array([checkpoint.hash for _, checkpoint in kept], np.uint64),
    )


def lines_of(steps: Sequence[Step], tail: Sequence[str] = ()) -> list[str]:
    """All lines that were logged."""
    return [line for step in steps for line in step.log] + list(tail)


def record_of(scene: Scene, steps: Sequence[Step], arrays: Mapping[str, NDArray[Any]]) -> RunRecord:
    """The record of a session that goes on, as a replay reads it from a run directory."""
    # What stands in the entry of a step was logged after the step before.
    events = [(max(0, i - 1), json.loads(line)) for i, step in enumerate(steps) for line in step.log]
    return RunRecord(
        directory=Path(),
        start=events[0][1],
        events=tuple(events),
        person=scene.person,
        episode=scene.episode,
        arrays=arrays,
        recorded=recorded_of(steps, arrays, ()),
        mismatch=None,
    )
