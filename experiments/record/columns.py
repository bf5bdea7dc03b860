"""Names, types and shapes of the arrays in `trajectory.npz` and `recording.npz`."""

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.errors import RecordError
from experiments.record.files import TEXT, Layout
from mjsim.values.actions import Move, Pick, Place, StepAction
from mjsim.values.errors import ActionError
from mjsim.values.observation import ObjectStatus, StepStates
from mjsim.world.state import WorldState

OBJECTS = -1  # placeholder for the number of objects in the shapes below

# Data type and shape of each column. Row t contains the state before action t.
TRAJECTORY_COLUMNS: dict[str, tuple[str, tuple[int, ...]]] = {
    "time": ("f8", ()),  # simulated time in seconds
    "position": ("f8", (2,)),  # position of the person in metres
    "heading": ("f8", ()),  # heading of the person in radians
    "pitch": ("f8", ()),  # elevation of the gaze in radians
    "hands": ("i2", (2,)),  # index of the object in each hand, or -1
    "object_position": ("f8", (OBJECTS, 3)),  # positions of the objects in metres
    "object_quaternion": ("f8", (OBJECTS, 4)),  # quaternions in the order w, x, y, z
    "object_status": ("i1", (OBJECTS,)),  # status of each object as an index into STATUSES
    # Type of the action (0 move, 1 pick, 2 place), index of the object or -1, forward and leftward speeds
    # (m/s), and turning and looking speeds (rad/s). If there are n objects, index n + i refers to entry i of
    # `unknown_objects`, a list of the names in actions that do not match any object.
    "action": ("f8", (6,)),
    # The fields of `HealthSample`, with NaN for quantities that were not measured
    "penetration_m": ("f8", ()),
    "trunk_penetration_m": ("f8", ()),
    "weld_error_m": ("f8", (2,)),
    "weld_error_rad": ("f8", (2,)),
    "settle_s": ("f8", ()),
}
# Columns that are needed only while a record is being written
_WRITTEN = {"state_hash": ("u8", ()), "logged": ("i8", ())}
HEALTH = ("penetration_m", "trunk_penetration_m", "weld_error_m", "weld_error_rad", "settle_s")
STATUSES = (ObjectStatus.LOOSE, ObjectStatus.CARRIED, ObjectStatus.DELIVERED)

# The arrays of `recording.npz`. `state_hash` and `action_hash` have one row per control step. `log_size` and
# `log_hash` describe the log before each control step and have an additional row for the complete log.
RECORDING_LAYOUT: dict[str, Layout] = {
    "state_hash": ("u8", (None,)),
    "action_hash": ("u8", (None,)),
    "log_size": ("i8", (None,)),
    "log_hash": ("u8", (None,)),
    "checkpoint_step": ("i8", (None,)),
    "checkpoint_physics": ("f8", (None, None)),
    "checkpoint_details": (TEXT, (None,)),
    "checkpoint_hash": ("u8", (None,)),
}


def trajectory_layout(objects: int) -> dict[str, Layout]:
    """Return the data type and the shape of each array in `trajectory.npz`."""
    rows: dict[str, Layout] = {
        name: (kind, (None, *row_shape(row, objects))) for name, (kind, row) in TRAJECTORY_COLUMNS.items()
    }
    return {**rows, "unknown_objects": (TEXT, (None,))}


def row_shape(shape: tuple[int, ...], objects: int) -> tuple[int, ...]:
    return tuple(objects if size == OBJECTS else size for size in shape)


def row_type(objects: int) -> np.dtype[Any]:
    columns = {**TRAJECTORY_COLUMNS, **_WRITTEN}
    return np.dtype([(name, kind, row_shape(row, objects)) for name, (kind, row) in columns.items()])


def state_columns(states: StepStates) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield the name and the values, shape (n, ...), of each trajectory column that describes states."""
    columns = states._asdict()
    health = columns.pop("health")
    yield from columns.items()
    first = 0
    for name in HEALTH:
        shape = TRAJECTORY_COLUMNS[name][1]
        width = math.prod(shape)
        yield name, health[:, first : first + width].reshape(-1, *shape)
        first += width


def action_hashes(actions: NDArray[np.float64]) -> NDArray[np.uint64]:
    """Return a 64-bit hash of each row of `actions`, which has shape (T, 6)."""
    content, size, sha1 = actions.tobytes(), actions.itemsize * 6, hashlib.sha1
    rows = (content[i : i + size] for i in range(0, len(content), size))
    digests = [sha1(row, usedforsecurity=False).digest()[:8] for row in rows]
    return np.frombuffer(b"".join(digests), "<u8").astype(np.uint64)


def checkpoint_arrays(checkpoints: Mapping[int, WorldState]) -> dict[str, NDArray[Any]]:
    """Convert checkpoints, a map from control steps to states, to the arrays stored in `recording.npz`."""
    states = list(checkpoints.values())
    return {
        "checkpoint_step": np.array(list(checkpoints), np.int64),
        "checkpoint_physics": np.array([s.physics for s in states]) if states else np.zeros((0, 0)),
        "checkpoint_details": np.array([s.details_json() for s in states], np.str_),
        "checkpoint_hash": np.array([s.hash for s in states], np.uint64),
    }


def decode_action(row: NDArray[Any], names: Sequence[str]) -> StepAction:
    """Decode an action from a row of the `action` column.

    Args:
        row: The row, shape (6,).
        names: Names of the objects, followed by the `unknown_objects`.

    Raises:
        RecordError: The row is not a valid action.
    """
    kind, number = float(row[0]), float(row[1])
    if kind == 0.0:
        try:
            return Move(*(float(v) for v in row[2:]))
        except ActionError as error:
            raise RecordError(f"an action is not usable: {error}") from error
    if kind not in (1.0, 2.0) or not number.is_integer() or not -1 <= number < len(names):
        raise RecordError(f"{row.tolist()} is not an action in an episode with {len(names)} object names")
    name = None if number < 0 else names[int(number)]
    return Pick(name) if kind == 1.0 else Place(name)
