"""Sensors, each of which computes one named array of an observation."""

from collections.abc import Sequence

from mjsim.environments.sensors import house, vision
from mjsim.environments.sensors.base import IMAGES, Sensor, SensorInput, unit_spec
from mjsim.environments.sensors.vectors import VECTORS
from mjsim.values.errors import EnvironmentConfigError

__all__ = ["BUNDLES", "IMAGES", "SENSORS", "Sensor", "SensorInput", "resolve_sensors", "unit_spec"]

_OTHERS = (house.MAP, vision.IN_VIEW, vision.RGB, vision.DEPTH, vision.SEGMENTATION, vision.VISIBLE_PIXELS)

SENSORS = {sensor.name: sensor for sensor in (*VECTORS, *_OTHERS)}
BUNDLES = {"state": VECTORS}
_CHOICES = {**BUNDLES, **{name: (sensor,) for name, sensor in SENSORS.items()}}


def resolve_sensors(observations: Sequence[str | Sensor]) -> tuple[Sensor, ...]:
    """Return the sensors with the given names, in order and without duplicates. Bundles are expanded.

    Raises:
        EnvironmentConfigError: A name is unknown, the list is empty, or different sensors have the same name.
    """
    if isinstance(observations, str):
        observations = (observations,)
    chosen: dict[str, Sensor] = {}
    for choice in observations:
        if not isinstance(choice, Sensor) and choice not in _CHOICES:
            raise EnvironmentConfigError(f"no sensor {choice!r}; choose from {[*_CHOICES]}, or pass a Sensor")
        for sensor in (choice,) if isinstance(choice, Sensor) else _CHOICES[choice]:
            if chosen.setdefault(sensor.name, sensor) is not sensor:
                raise EnvironmentConfigError(f"two different sensors are named {sensor.name!r}; rename one")
    if not chosen:
        raise EnvironmentConfigError(f"observations is empty; choose from {[*_CHOICES]}")
    return tuple(chosen.values())
