"""A sensor of one's own: where the breadcrumbs lead, for an agent that wears the glasses as a person does."""

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Point
from mjsim.environments.sensors import Sensor, SensorInput, unit_spec
from mjsim.observation import ObjectStatus
from planner.polyline import path_length, point_along

AHEAD = 1.0  # m along the way; about as far as a walker looks


def breadcrumb_sensor(house: House) -> Sensor:
    """Where the shortest way to the next visit leads: a point 1 m along it (forward, left, m), and the way's length.

    The next visit is the nearest bin of something carried, else the nearest object that lies about. All values are 0
    when nothing is left to do.

    Args:
        house: House of the episodes.
    """

    def read(inputs: SensorInput) -> NDArray[np.float32]:
        here = inputs.state.position
        ways = [house.geodesics.shortest_path(here, goal).points for goal in _goals(house, inputs)]
        if not ways:
            return np.zeros(3, np.float32)
        way = min(ways, key=path_length)
        forward, left = inputs.to_body(np.array([point_along(way, AHEAD)]))[0] / AHEAD
        length = path_length(way) / inputs.layout.scale
        return np.array([forward, left, length], np.float32).clip(-1.0, 1.0)

    return Sensor("breadcrumbs", lambda _: unit_spec(3), read)


def _goals(house: House, inputs: SensorInput) -> list[Point]:
    seen, targets = inputs.state, inputs.world.scene.episode.targets
    if seen.carried:
        return [house.approaches[targets[name]] for name in seen.carried]
    places = dict(zip(seen.object_names, seen.object_positions, strict=True))
    return [house.navmesh.snap(places[n][:2]) for n in seen.names_with(ObjectStatus.LOOSE)]
