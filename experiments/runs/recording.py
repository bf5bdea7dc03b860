"""What a replay is checked against: state hashes of every control step, log hashes, and checkpoints to start from."""

import dataclasses
import hashlib
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.files import TEXT, Layout, read_arrays, save_arrays
from experiments.runs.records import EventLog
from mjsim.observation import Observation
from mjsim.world import World
from mjsim.world_state import (
    CHECKPOINT_PERIOD,
    WorldState,
    checkpoint_hash,
    engine_versions,
    model_fingerprint,
)

_LAYOUTS: dict[str, Layout] = {
    "state_hash": ("u8", (None,)),
    "action_hash": ("u8", (None,)),
    "log_size": ("i8", (None,)),
    "log_hash": ("u8", (None,)),
    "checkpoint_step": ("i8", (None,)),
    "checkpoint_physics": ("f8", (None, None)),
    "checkpoint_details": (TEXT, (None,)),
    "checkpoint_hash": ("u8", (None,)),
}
NO_CHECKPOINT_AHEAD = 1000  # control steps to the next checkpoint, where there is none


class Recording:
    """Accompanies a session: hashes each control step, and takes the world through checkpoints.

    A live run passes a checkpoint at the first control step at which the world is not busy, `CHECKPOINT_PERIOD` or
    more after the last one. A replay passes them where the run did.

    Args:
        world: The physics.
        log: The session's log.
        checkpoints: Steps at which to pass a checkpoint, or None to decide as a live run does.
        first: Control steps that have passed already.
    """

    def __init__(
        self, world: World, log: EventLog, *, checkpoints: Collection[int] | None = None, first: int = 0
    ) -> None:
        self._world, self.log = world, log
        self._steps_given = None if checkpoints is None else frozenset(checkpoints)
        self._period = max(1, round(CHECKPOINT_PERIOD / world.control_timestep))
        self._first, self._last = first, first
        self._state_hash: list[int] = []
        self._log_entries: list[int] = []
        self.checkpoints: dict[int, WorldState] = {}

    @property
    def step(self) -> int:
        """Number of the next control step."""
        return self._first + len(self._state_hash)

    def pass_checkpoint(self, observation: Observation) -> Observation:
        """Take the world's state and restore the world to it, if a checkpoint is due; the observation after that."""
        if not self._due(observation.busy):
            return observation
        state = self._world.state()
        self._last = self.step
        self.checkpoints[self.step] = state
        return self._world.restore(state)

    @property
    def last_hash(self) -> int:
        """Hash of the state recorded last."""
        return self._state_hash[-1]

    def append(self) -> None:
        """Record the state before the next action."""
        self._log_entries.append(self.log.entries)
        self._state_hash.append(self._world.state_hash())

    def forget(self) -> None:
        """Keep the last state alone: somebody else has those before."""
        self._first += len(self._state_hash[:-1])
        self._state_hash, self._log_entries = self._state_hash[-1:], self._log_entries[-1:]

    def extend(self, state_hashes: NDArray[np.uint64]) -> None:
        """Record the states before actions during which nothing was logged, shape (n,)."""
        self._state_hash += state_hashes.tolist()
        self._log_entries += [self.log.entries] * len(state_hashes)

    @property
    def steps_to_checkpoint(self) -> int:
        """Control steps that can be taken at once before the next checkpoint is due, 1 or more."""
        if self._steps_given is None:
            return max(1, self._last + self._period - self.step)
        return min(
            (step - self.step for step in self._steps_given if step > self.step), default=NO_CHECKPOINT_AHEAD
        )

    def recorded(self, actions: NDArray[np.float64]) -> "Recorded":
        """Everything so far.

        Args:
            actions: The trajectory's, shape (T, 6).
        """
        count = len(actions)  # an interruption can fall between recording a step and its action
        kept = {step: state for step, state in self.checkpoints.items() if step < count}
        states = [state.physics for state in kept.values()]
        log_size, log_hash = self.log.at([*self._log_entries[:count], self.log.entries])
        return Recorded(
            state_hash=np.array(self._state_hash[:count], np.uint64),
            action_hash=action_hashes(actions),
            log_size=log_size,
            log_hash=log_hash,
            checkpoint_step=np.array(list(kept), np.int64),
            checkpoint_physics=np.array(states) if states else np.zeros((0, 0)),
            checkpoint_details=np.array([state.details_json() for state in kept.values()], np.str_),
            checkpoint_hash=np.array([state.hash for state in kept.values()], np.uint64),
        )

    def state_hashes(self) -> NDArray[np.uint64]:
        """Hashes of the states since `first`, in order, shape (steps,)."""
        return np.array(self._state_hash, np.uint64)

    def _due(self, busy: bool) -> bool:
        if self._steps_given is not None:
            return self.step in self._steps_given
        return not busy and self.step - self._last >= self._period


@dataclass(frozen=True, eq=False)
class Recorded:
    """A recording, read back.

    Attributes:
        state_hash: Hash of the state before each action, shape (T,).
        action_hash: Hash of each action, shape (T,).
        log_size: Length of the event log before each action and at the end, bytes, shape (T + 1,).
        log_hash: Hash of that much of the log, shape (T + 1,).
        checkpoint_step: Control steps that have a checkpoint, ascending, shape (K,).
        checkpoint_physics: Their states, shape (K, n).
        checkpoint_details: `WorldState.details_json` of each, shape (K,).
        checkpoint_hash: Hash of each checkpoint, shape (K,).
    """

    state_hash: NDArray[np.uint64]
    action_hash: NDArray[np.uint64]
    log_size: NDArray[np.int64]
    log_hash: NDArray[np.uint64]
    checkpoint_step: NDArray[np.int64]
    checkpoint_physics: NDArray[np.float64]
    checkpoint_details: NDArray[np.str_]
    checkpoint_hash: NDArray[np.uint64]

    @classmethod
    def load(cls, path: Path) -> "Recorded":
        """Read a recording.

        Raises:
            RecordError: It is missing, damaged or incomplete; the message names the file.
        """
        arrays = read_arrays(path, _LAYOUTS)
        return cls(**{name: arrays[name] for name in _LAYOUTS})

    def save(self, path: Path) -> None:
        """Write a compressed NPZ, whole or not at all."""
        save_arrays(path, {name: getattr(self, name) for name in _LAYOUTS})

    def checkpoint(self, number: int) -> WorldState:
        """The `number`-th checkpoint.

        Raises:
            StateError: It is not the state of a world of this version.
        """
        return WorldState.from_json(self.checkpoint_physics[number], str(self.checkpoint_details[number]))

    def checkpoint_is_intact(self, number: int) -> bool:
        """Whether the `number`-th checkpoint is the one that was recorded."""
        state = self.checkpoint_physics[number], str(self.checkpoint_details[number])
        return checkpoint_hash(*state) == int(self.checkpoint_hash[number])


def action_hashes(actions: NDArray[np.float64]) -> NDArray[np.uint64]:
    """`hash64` of each row of actions (T, 6), shape (T,)."""
    rows, size = actions.tobytes(), actions.itemsize * 6
    sha1 = hashlib.sha1
    digests = [
        sha1(rows[i : i + size], usedforsecurity=False).digest()[:8] for i in range(0, len(rows), size)
    ]
    return np.frombuffer(b"".join(digests), "<u8").astype(np.uint64)


def provenance(world: World) -> dict[str, Any]:
    """Versions, compiled model and rules, on which a run depends as it does on its configuration; JSON-ready."""
    return {
        "versions": engine_versions(),
        "model": model_fingerprint(world.scene.counterpart(visuals=False).model),
        "world": dataclasses.asdict(world.options),
    }
