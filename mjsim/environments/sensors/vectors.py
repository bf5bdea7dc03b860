"""Sensors for the person, the house and the task, whose arrays one kernel computes together."""

from mjsim.environments.sensors.base import Sensor, unit_spec
from mjsim.environments.sensors.vector_kernels import vector_shapes

_SIGNED = {"gps", "compass", "pose", "motion", "receptacles", "object_positions", "object_rotations", "goals"}


def _sensor(name: str) -> Sensor:
    low = -1.0 if name in _SIGNED else 0.0
    return Sensor(
        name,
        lambda layout: unit_spec(*layout.vectors[name].shape, low=low),
        lambda inputs: inputs.vectors[name],
    )


VECTORS = tuple(_sensor(name) for name in vector_shapes(slots=0, categories=0, receptacles=0))
