"""A custom sensor through which an agent observes the breadcrumbs of the HUD, as a person does."""

import numpy as np
from numpy.typing import NDArray

from experiments import House
from experiments.participants import Point
from mjsim import ObjectStatus, path_length, point_along
from mjsim.environments import Sensor, SensorInput, unit_spec

LOOK_AHEAD = 1.0  # distance of the observed point along the path, in metres


def breadcrumb_sensor(house: House) -> Sensor:
    """Return a sensor that observes the shortest path to the next visit.

    It observes the point 1 m along the path (forward, left, m) and the path length. The next visit is at the
    nearest receptacle of a carried object, otherwise at the nearest loose object. Without a next visit, all
    values are 0.

    Args:
        house: House of the episodes.
    """

    def read(inputs: SensorInput) -> NDArray[np.float32]:
        paths = [
            house.geodesics.shortest_path(inputs.state.position, goal).points
            for goal in _goals(house, inputs)
        ]
        if not paths:
            return np.zeros(3, np.float32)
        path = min(paths, key=path_length)
        forward, left = inputs.to_body(np.array([point_along(path, LOOK_AHEAD)]))[0] / LOOK_AHEAD
        length = path_length(path) / inputs.layout.scale
        return np.array([forward, left, length], np.float32).clip(-1.0, 1.0)

    return Sensor("breadcrumbs", lambda _: unit_spec(3), read)


def _goals(house: House, inputs: SensorInput) -> list[Point]:
    state, targets = inputs.state, inputs.world.scene.episode.targets
    if state.carried:
        return [house.approaches[targets[name]] for name in state.carried]
    positions = dict(zip(state.object_names, state.object_positions, strict=True))
    return [house.navmesh.snap(positions[n][:2]) for n in state.names_with(ObjectStatus.LOOSE)]
