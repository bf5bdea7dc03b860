"""Sensors for the pose and velocity of the person, and for the objects in their hands."""

import math

import numpy as np
from dm_env import specs
from numpy.typing import NDArray

from mjsim.environments.sensors.base import ObservationLayout, Sensor, SensorInput, rotated, unit_spec

Array = NDArray[np.float32]


def _gps(inputs: SensorInput) -> Array:
    start = inputs.start
    offset = inputs.state.position - np.array([start.x, start.y])
    return inputs.layout.scaled(rotated(offset, -start.heading))


def _direction(angle: float) -> list[float]:
    return [math.cos(angle), math.sin(angle)]


def _compass(inputs: SensorInput) -> Array:
    return np.array(_direction(inputs.state.heading - inputs.start.heading), np.float32)


def _pose(inputs: SensorInput) -> Array:
    bounds = np.array(inputs.layout.floor.bounds)
    middle, half = (bounds[:2] + bounds[2:]) / 2, (bounds[2:] - bounds[:2]) / 2
    position = np.clip((inputs.state.position - middle) / half, -1.0, 1.0)
    return np.array([*position, *_direction(inputs.state.heading)], np.float32)


def _motion(inputs: SensorInput) -> Array:
    state = inputs.state
    velocity = rotated(state.velocity, -state.heading) / inputs.layout.max_speed
    values = np.array([*velocity, state.pitch / (math.pi / 2), float(state.busy)], np.float32)
    return np.clip(values, -1.0, 1.0)


def _inventory_spec(layout: ObservationLayout) -> specs.Array:
    return unit_spec(2, layout.slots, low=0.0)


def _inventory(inputs: SensorInput) -> Array:
    held = np.zeros((2, inputs.layout.slots), np.float32)
    for hand, name in enumerate(inputs.state.hands):
        if name is not None:
            held[hand, inputs.state.object_names.index(name)] = 1.0
    return held


GPS = Sensor("gps", lambda _: unit_spec(2), _gps)
COMPASS = Sensor("compass", lambda _: unit_spec(2), _compass)
POSE = Sensor("pose", lambda _: unit_spec(4), _pose)
MOTION = Sensor("motion", lambda _: unit_spec(4), _motion)
INVENTORY = Sensor("inventory", _inventory_spec, _inventory)
