"""The trajectory of a trial: poses, actions and the health of the physics at every control step."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.files import save_arrays
from mjsim.actions import Action, Move, Pick, Place
from mjsim.errors import ActionError
from mjsim.health.values import HealthSample
from mjsim.observation import ObjectStatus, Observation
from mjsim.rollout import Rollout

# Columns of `HealthSample.row`, and how many numbers each has.
HEALTH = {
    "penetration_m": 1,
    "trunk_penetration_m": 1,
    "weld_error_m": 2,
    "weld_error_rad": 2,
    "settle_s": 1,
}
STATUS_CODE = {ObjectStatus.LOOSE: 0, ObjectStatus.CARRIED: 1, ObjectStatus.DELIVERED: 2}

_FIRST_CAPACITY = 4096  # rows of a trajectory; doubled when they are full


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
