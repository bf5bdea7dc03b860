"""Writes the record of a session while it runs: control steps, events and checkpoints, appended only."""

import dataclasses
import json
from collections.abc import Collection
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.record.columns import HEALTH, STATUSES, row_type, state_columns
from experiments.record.journal import Checkpoint, Entry, Journal
from experiments.record.reader import Record, assemble
from experiments.record.records import EventLog
from mjsim.values.actions import Move, Pick, StepAction
from mjsim.values.episode import Episode
from mjsim.values.observation import ObjectStatus, Observation, Steps
from mjsim.world.health.monitor import HealthSample
from mjsim.world.state import CHECKPOINT_PERIOD, WorldState, engine_versions, model_fingerprint
from mjsim.world.world import World

FIRST_CAPACITY = 4096  # rows; doubled when they are full


class RecordWriter:
    """The record of a session that is running.

    A session passes a checkpoint at the first control step at which the world is not busy, `CHECKPOINT_PERIOD` or more
    after the last one. A replay passes them where the run did.

    Args:
        episode: The disorganized house.
        log: The event log.
        journal: Takes with each `commit` what is new; None to keep everything in memory.
        checkpoints: Control steps at which to pass a checkpoint, or None for the rule above.

    Attributes:
        log: The event log.
        step: Number of the next control step.
        time: Simulated time of the control step before it, s; 0 at the start.
        checkpoints: States that were passed, by control step.
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
        """Continue before a control step of a record: with its log up to there, and without its rows."""
        self.log.restore(record.events[: record.events_before(step)])
        self.step, self._length, self._committed = step, 0, self.log.entries
        self._last_checkpoint = max((k for k in record.checkpoint_steps if k <= step), default=0)
        self._unknown = [str(name) for name in record.trajectory["unknown_objects"]]
        self.checkpoints.clear()

    def append(self, before: Observation, health: HealthSample, state_hash: int, steps: Steps) -> None:
        """Add control steps, during which no hand picks up or releases anything.

        Args:
            before: State before the first of them.
            health: The physics before the first of them.
            state_hash: Hash of the state before the first of them.
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
        self._length, self.step = end, self.step + len(steps)  # last: an interruption leaves whole rows

    @property
    def last_state_hash(self) -> int:
        """Hash of the state before the control step that was added last."""
        return int(self._columns["state_hash"][self._length - 1])

    def pass_checkpoint(self, world: World, now: Observation) -> Observation:
        """Take the world's state and restore the world to it, if a checkpoint is due; the observation after that."""
        if not self._due(world, now.busy):
            return now
        state = self.checkpoints[self.step] = world.state()
        self._last_checkpoint = self.step
        return world.restore(state)

    def steps_to_checkpoint(self, world: World) -> int:
        """Control steps that can be taken at once before the next checkpoint is due by the rule, 1 or more."""
        return max(1, self._last_checkpoint + _period(world) - self.step)

    def commit(self, participant: Any = None) -> None:
        """Append to the journal all that is new, and the state of the participant.

        Raises:
            OSError: It cannot be written.
        """
        if self._journal is None:
            return
        states = [
            Checkpoint(step, state.physics.tobytes(), state.details_json())
            for step, state in self.checkpoints.items()
        ]
        events = self.log.events[self._committed :]
        rows = self._rows[: self._length]
        rows["logged"] = self.log.event_counts[rows["logged"]]  # places left empty are not in the journal
        self._journal.append(
            Entry(rows.tobytes(), list(map(json.dumps, events)), self._unknown, states, participant)
        )
        self._committed += len(events)
        self._length = 0
        self.checkpoints.clear()

    def record(self) -> Record:
        """The record so far, without what the journal holds."""
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
    """Versions, compiled model and rules, on which a run depends as it does on its configuration; JSON-ready."""
    return {
        "versions": engine_versions(),
        "model": model_fingerprint(world.scene.counterpart(visuals=False).model),
        "world": dataclasses.asdict(world.options),
    }
