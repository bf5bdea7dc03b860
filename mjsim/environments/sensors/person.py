"""The person's own state: where, how fast, and what is in the hands."""

import math

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.layout import Layout
from mjsim.environments.sensors.base import Moment, Sensor, rotated, unit_spec

Array = NDArray[np.float32]


def _gps(moment: Moment) -> Array:
    start = moment.start
    offset = moment.observation.position - np.array([start.x, start.y])
    return moment.layout.scaled(rotated(offset, -start.heading))


def _direction(angle: float) -> list[float]:
    return [math.cos(angle), math.sin(angle)]


def _compass(moment: Moment) -> Array:
    return np.array(_direction(moment.observation.heading - moment.start.heading), np.float32)


def _pose(moment: Moment) -> Array:
    bounds = np.array(moment.layout.floor.bounds)
    middle, half = (bounds[:2] + bounds[2:]) / 2, (bounds[2:] - bounds[:2]) / 2
    place = np.clip((moment.observation.position - middle) / half, -1.0, 1.0)
    return np.array([*place, *_direction(moment.observation.heading)], np.float32)


def _motion(moment: Moment) -> Array:
    seen = moment.observation
    velocity = rotated(seen.velocity, -seen.heading) / moment.layout.max_speed
    values = np.array([*velocity, seen.pitch / (math.pi / 2), float(seen.busy)], np.float32)
    return np.clip(values, -1.0, 1.0)


def _inventory_spec(layout: Layout) -> specs.Array:
    return unit_spec(2, layout.slots, low=0.0)


def _inventory(moment: Moment) -> Array:
    held = np.zeros((2, moment.layout.slots), np.float32)
    for hand, name in enumerate(moment.observation.hands):
        if name is not None:
            held[hand, moment.observation.object_names.index(name)] = 1.0
    return held


GPS = Sensor("gps", lambda _: unit_spec(2), _gps)
COMPASS = Sensor("compass", lambda _: unit_spec(2), _compass)
POSE = Sensor("pose", lambda _: unit_spec(4), _pose)
MOTION = Sensor("motion", lambda _: unit_spec(4), _motion)
INVENTORY = Sensor("inventory", _inventory_spec, _inventory)
