"""Sensors for the objects and the progress of the task. Unused rows of per-object arrays are zero."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.environments.sensors.base import Sensor, SensorInput, unit_spec
from mjsim.values.observation import ObjectStatus

_STATUS = tuple(ObjectStatus)

Array = NDArray[np.float32]


def _padded(inputs: SensorInput, rows: NDArray[np.float32]) -> Array:
    padded = np.zeros((inputs.layout.slots, *rows.shape[1:]), np.float32)
    padded[: len(rows)] = rows
    return padded


def _one_hot(choices: Sequence[int], width: int) -> Array:
    return np.eye(width, dtype=np.float32)[list(choices)]


def _mask(inputs: SensorInput) -> Array:
    return _padded(inputs, np.ones(len(inputs.state.object_names), np.float32))


def _positions(inputs: SensorInput) -> Array:
    centres = inputs.state.object_positions
    local = np.column_stack([inputs.to_body(centres[:, :2]), centres[:, 2]])
    return _padded(inputs, inputs.layout.scaled(local))


def _rotations(inputs: SensorInput) -> Array:
    quaternions = inputs.state.object_quaternions
    # A quaternion and its negative describe the same rotation, so the one with w >= 0 is used.
    upper = np.where(quaternions[:, :1] < 0, -quaternions, quaternions)
    unit = upper / np.linalg.norm(upper, axis=1, keepdims=True)
    return _padded(inputs, np.clip(unit, -1.0, 1.0).astype(np.float32))


def _statuses(inputs: SensorInput) -> Array:
    statuses = [_STATUS.index(s) for s in inputs.state.object_status]
    return _padded(inputs, _one_hot(statuses, len(_STATUS)))


def _categories(inputs: SensorInput) -> Array:
    keys = inputs.layout.categories
    found = [keys.index(o.category) for o in inputs.world.scene.episode.objects]
    return _padded(inputs, _one_hot(found, len(keys)))


def goals(inputs: SensorInput) -> NDArray[np.float64]:
    """Return the floor position of the next pick or place of each object, in metres, shape (objects, 2).

    For a loose object, this is the object's own position. For any other object, it is the receptacle's
    position.
    """
    state, scene = inputs.state, inputs.world.scene
    bins = np.array([scene.receptacles[scene.episode.targets[n]].center[:2] for n in state.object_names])
    loose = np.array([s is ObjectStatus.LOOSE for s in state.object_status])
    return np.where(loose[:, None], state.object_positions[:, :2], bins)


def _goals(inputs: SensorInput) -> Array:
    undelivered = [s is not ObjectStatus.DELIVERED for s in inputs.state.object_status]
    local = inputs.to_body(goals(inputs)) * np.array(undelivered)[:, None]
    return _padded(inputs, inputs.layout.scaled(local))


def _remaining(inputs: SensorInput) -> Array:
    statuses = inputs.state.object_status
    return np.array([sum(s is not ObjectStatus.DELIVERED for s in statuses) / len(statuses)], np.float32)


def _time_left(inputs: SensorInput) -> Array:
    left = 1.0 - inputs.state.time / inputs.layout.time_limit
    return np.array([max(0.0, left)], np.float32)


OBJECT_MASK = Sensor("object_mask", lambda layout: unit_spec(layout.slots, low=0.0), _mask)
OBJECT_POSITIONS = Sensor("object_positions", lambda layout: unit_spec(layout.slots, 3), _positions)
OBJECT_ROTATIONS = Sensor("object_rotations", lambda layout: unit_spec(layout.slots, 4), _rotations)
OBJECT_STATUS = Sensor(
    "object_status", lambda layout: unit_spec(layout.slots, len(_STATUS), low=0.0), _statuses
)
OBJECT_CATEGORIES = Sensor(
    "object_categories",
    lambda layout: unit_spec(layout.slots, len(layout.categories), low=0.0),
    _categories,
)
GOALS = Sensor("goals", lambda layout: unit_spec(layout.slots, 2), _goals)
REMAINING = Sensor("remaining", lambda _: unit_spec(1, low=0.0), _remaining)
TIME_LEFT = Sensor("time_left", lambda _: unit_spec(1, low=0.0), _time_left)
