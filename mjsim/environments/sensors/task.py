"""The objects and what is left to do with them; one row per slot, zeros in slots without an object."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.environments.sensors.base import Moment, Sensor, unit_spec
from mjsim.observation import ObjectStatus

_STATUS = tuple(ObjectStatus)

Array = NDArray[np.float32]


def _in_slots(moment: Moment, rows: NDArray[np.float32]) -> Array:
    padded = np.zeros((moment.layout.slots, *rows.shape[1:]), np.float32)
    padded[: len(rows)] = rows
    return padded


def _one_hot(choices: Sequence[int], width: int) -> Array:
    return np.eye(width, dtype=np.float32)[list(choices)]


def _mask(moment: Moment) -> Array:
    return _in_slots(moment, np.ones(len(moment.observation.object_names), np.float32))


def _positions(moment: Moment) -> Array:
    centres = moment.observation.object_positions
    local = np.column_stack([moment.to_body(centres[:, :2]), centres[:, 2]])
    return _in_slots(moment, moment.layout.scaled(local))


def _rotations(moment: Moment) -> Array:
    quaternions = moment.observation.object_quaternions
    # A quaternion and its negative are the same rotation; agents should see one of them only.
    upper = np.where(quaternions[:, :1] < 0, -quaternions, quaternions)
    unit = upper / np.linalg.norm(upper, axis=1, keepdims=True)
    return _in_slots(moment, np.clip(unit, -1.0, 1.0).astype(np.float32))


def _statuses(moment: Moment) -> Array:
    statuses = [_STATUS.index(s) for s in moment.observation.object_status]
    return _in_slots(moment, _one_hot(statuses, len(_STATUS)))


def _categories(moment: Moment) -> Array:
    keys = moment.layout.categories
    found = [keys.index(o.category) for o in moment.world.scene.episode.objects]
    return _in_slots(moment, _one_hot(found, len(keys)))


def goals(moment: Moment) -> NDArray[np.float64]:
    """Where each object has to be dealt with next: itself while loose, else its receptacle; m, shape (n, 2)."""
    seen, scene = moment.observation, moment.world.scene
    bins = np.array([scene.receptacles[scene.episode.targets[n]].center[:2] for n in seen.object_names])
    loose = np.array([s is ObjectStatus.LOOSE for s in seen.object_status])
    return np.where(loose[:, None], seen.object_positions[:, :2], bins)


def _goals(moment: Moment) -> Array:
    undelivered = [s is not ObjectStatus.DELIVERED for s in moment.observation.object_status]
    local = moment.to_body(goals(moment)) * np.array(undelivered)[:, None]
    return _in_slots(moment, moment.layout.scaled(local))


def _remaining(moment: Moment) -> Array:
    statuses = moment.observation.object_status
    return np.array([sum(s is not ObjectStatus.DELIVERED for s in statuses) / len(statuses)], np.float32)


def _time_left(moment: Moment) -> Array:
    left = 1.0 - moment.observation.time / moment.layout.time_limit
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
