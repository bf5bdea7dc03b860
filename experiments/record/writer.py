"""Record a running session, and write the run directory of a finished session."""

import dataclasses
import json
import shutil
import tempfile
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.record import records
from experiments.record.columns import HEALTH, STATUSES, row_type, state_columns
from experiments.record.files import save_arrays, write_checksums, write_json
from experiments.record.journal import Checkpoint, Journal, JournalEntry
from experiments.record.metrics import measure
from experiments.record.reader import Record, assemble
from experiments.record.records import EventLog
from experiments.record.run_directory import free_name
from mjsim.support.files import replacing
from mjsim.values.actions import Move, Pick, StepAction
from mjsim.values.episode import Episode
from mjsim.values.observation import ObjectStatus, Observation, Steps
from mjsim.world.health.monitor import HealthSample
from mjsim.world.state import CHECKPOINT_PERIOD, WorldState, engine_versions, model_fingerprint
from mjsim.world.world import World

FIRST_CAPACITY = 4096  # initial number of allocated rows, which is doubled when all are used
MAX_SMALL_OBJECTS = 24  # maximum number of objects in sessions whose arrays are compressed as far as possible
NOTHING_FILMED = "none: nothing was filmed"  # value of `renderer` in a run without a film


class RecordWriter:
    """A writer for the record of a running session.

    A checkpoint is taken at the first control step at which the world is not busy and `CHECKPOINT_PERIOD` has
    passed since the previous checkpoint. A replay takes checkpoints at the same steps as the original run.

    Args:
        episode: The disorganized house.
        log: The event log.
        journal: Receives new data at each `commit`, or None to keep all data in memory.
        checkpoints: Control steps at which to take checkpoints, or None for the rule above.

    Attributes:
        step: Number of the next control step.
        time: Simulated time of the previous control step in seconds.
        checkpoints: New checkpoints, by control step.
    """

    def __init__(
        self,
        episode: Episode,
        log: EventLog,
        journal: Journal | None = None,
        *,
        checkpoints: Collection[int] | None = None,
    ) -> None:
        self.log, self.step, self.time = log, 0, 0.0
        self.checkpoints: dict[int, WorldState] = {}
        self._episode, self._journal = episode, journal
        self._steps_given = None if checkpoints is None else frozenset(checkpoints)
        self._numbers = {placed.name: i for i, placed in enumerate(episode.objects)}
        self._unknown: list[str] = []
        self._rows: NDArray[Any] = np.empty(FIRST_CAPACITY, row_type(len(self._numbers)))
        self._columns = {name: self._rows[name] for name in self._rows.dtype.names or ()}
        self._length = self._committed = self._last_checkpoint = 0
        self._status: tuple[tuple[ObjectStatus, ...], list[int]] = ((), [])

    def restore(self, record: Record, step: int) -> None:
        """Continue a record at a control step. The log keeps earlier events, but earlier rows are dropped."""
        self.log.restore(record.events[: record.events_before(step)])
        self.step, self._length, self._committed = step, 0, self.log.entries
        self._last_checkpoint = max((k for k in record.checkpoint_steps if k <= step), default=0)
        self._unknown = [str(name) for name in record.trajectory["unknown_objects"]]
        self.checkpoints.clear()

    def append(self, before: Observation, health: HealthSample, state_hash: int, steps: Steps) -> None:
        """Add control steps in which no hand picks up or releases an object.

        Args:
            before: State before the first step.
            health: Physics errors before the first step.
            state_hash: Hash of the state before the first step.
            steps: The steps.
        """
        first, end = self._length, self._length + len(steps)
        if end > len(self._rows):
            self._rows = np.concatenate((self._rows, np.empty(max(end, len(self._rows)), self._rows.dtype)))
            self._columns = {name: self._rows[name] for name in self._columns}
        columns, rest = self._columns, slice(first + 1, end)
        self._write_state(first, before, health)
        columns["state_hash"][first] = state_hash
        columns["logged"][first:end] = self.log.entries
        if isinstance(steps.actions, np.ndarray):
            columns["action"][first:end, :2] = 0.0, -1.0
            columns["action"][first:end, 2:] = steps.actions
        else:
            columns["action"][first] = self._encode(steps.actions)
        if steps.passed is not None:
            for name, values in state_columns(steps.passed):
                columns[name][rest] = values
            for name in ("hands", "object_status"):
                columns[name][rest] = columns[name][first]
        self.time = float(columns["time"][end - 1])
        # These are set last, so that an interruption leaves only complete rows.
        self._length, self.step = end, self.step + len(steps)

    @property
    def last_state_hash(self) -> int:
        """The hash of the state before the most recent control step."""
        return int(self._columns["state_hash"][self._length - 1])

    def pass_checkpoint(self, world: World, now: Observation) -> Observation:
        """Take a checkpoint if one is due, and restore the world from it. Return the current observation."""
        if not self._due(world, now.busy):
            return now
        state = self.checkpoints[self.step] = world.state()
        self._last_checkpoint = self.step
        return world.restore(state)

    def steps_to_checkpoint(self, world: World) -> int:
        """Return a lower bound, at least 1, on the number of control steps until a checkpoint is due."""
        return max(1, self._last_checkpoint + _period(world) - self.step)

    def commit(self, participant: Any = None) -> None:
        """Append all new data and the state of the participant to the journal."""
        if self._journal is None:
            return
        states = [
            Checkpoint(step, state.physics.tobytes(), state.details_json())
            for step, state in self.checkpoints.items()
        ]
        events = self.log.events[self._committed :]
        rows = self._rows[: self._length].tobytes()
        self._journal.append(
            JournalEntry(rows, list(map(json.dumps, events)), self._unknown, states, participant)
        )
        self._committed += len(events)
        self._length = 0
        self.checkpoints.clear()

    def record(self) -> Record:
        """Return the record so far, without the data that are already in the journal."""
        return assemble(self._episode, self._rows[: self._length], self.log, self._unknown, self.checkpoints)

    def _due(self, world: World, busy: bool) -> bool:
        if self._steps_given is not None:
            return self.step in self._steps_given
        return not busy and self.step - self._last_checkpoint >= _period(world)

    def _write_state(self, row: int, o: Observation, health: HealthSample) -> None:
        if o.object_status != self._status[0]:
            self._status = o.object_status, [STATUSES.index(status) for status in o.object_status]
        columns = self._columns
        columns["time"][row], columns["position"][row] = o.time, o.position
        columns["heading"][row], columns["pitch"][row] = o.heading, o.pitch
        columns["object_position"][row] = o.object_positions
        columns["object_quaternion"][row] = o.object_quaternions
        columns["object_status"][row] = self._status[1]
        columns["hands"][row] = [-1 if name is None else self._numbers[name] for name in o.hands]
        for name in HEALTH:
            columns[name][row] = getattr(health, name)

    def _encode(self, action: StepAction) -> tuple[float, ...]:
        if isinstance(action, Move):
            return 0.0, -1.0, action.forward, action.left, action.turn, action.look
        return 1.0 if isinstance(action, Pick) else 2.0, self._number(action.object), 0.0, 0.0, 0.0, 0.0

    def _number(self, name: str | None) -> int:
        if name is None or name in self._numbers:
            return -1 if name is None else self._numbers[name]
        if name not in self._unknown:
            self._unknown.append(name)
        return len(self._numbers) + self._unknown.index(name)


def _period(world: World) -> int:
    return max(1, round(CHECKPOINT_PERIOD / world.control_timestep))


def provenance(world: World) -> dict[str, Any]:
    """Return the software versions, model fingerprint and world options on which a run depends, as JSON."""
    return {
        "versions": engine_versions(),
        "model": model_fingerprint(world.scene.counterpart(visuals=False).model),
        "world": dataclasses.asdict(world.options),
    }


def save_record(
    folder: Path,
    out: Path,
    record: Record,
    wall: float,
    *,
    frames_sha256: str | None = None,
    renderer: str = NOTHING_FILMED,
) -> dict[str, Any]:
    """Write the record of a session and its metrics to a temporary folder. Return the metrics.

    Args:
        folder: Temporary folder, which becomes the run directory.
        out: Path of the run directory.
        record: The record.
        wall: Wall time of the trial in seconds.
        frames_sha256: Hash of the filmed frames, or None.
        renderer: Name of the renderer of these frames.

    Raises:
        RecordError: The folder cannot be written. The message names the path where the record was saved instead.
        OSError: The folder cannot be written, but the session's journal still contains the record.
    """
    metrics = {
        **measure(record.events, record.trajectory),
        "frames_sha256": frames_sha256,
        "renderer": renderer,
        "wall_s": round(wall, 3),
    }
    try:
        _write(folder, record, metrics)
    except OSError as error:
        if record.participant is not None:  # the record is still in the journal
            raise
        shutil.rmtree(folder, ignore_errors=True)
        metrics["frames_sha256"] = None
        kept = _save_elsewhere(out, record, metrics)
        raise RecordError(f"cannot write {out} ({error.strerror}); the run is kept in {kept}") from error
    return metrics


def _write(folder: Path, record: Record, metrics: dict[str, Any]) -> None:
    record.episode.save(folder / records.EPISODE)
    with replacing(folder / records.EVENTS) as path:
        path.write_bytes(record.log)
    # Use the slower compression for sessions of human participants, which are longer than trials of a batch.
    # With many objects, it would delay the end of a session by 3 s. Their files are three times as large.
    small = record.participant is not None and len(record.episode.objects) <= MAX_SMALL_OBJECTS
    save_arrays(folder / records.TRAJECTORY, record.trajectory, small=small)
    save_arrays(folder / records.RECORDING, record.recording, small=small)
    write_json(folder / records.PLAN, record.plans)
    write_json(folder / records.METRICS, metrics)  # marks the run directory as complete
    write_checksums(folder, records.FILES)


def _save_elsewhere(out: Path, record: Record, metrics: dict[str, Any]) -> Path:
    kept = free_name(Path(tempfile.gettempdir()) / f"mjsim-{out.name}")
    kept.mkdir()
    try:
        _write(kept, record, metrics)
    except OSError:
        shutil.rmtree(kept, ignore_errors=True)
        raise
    return kept
