"""Lower bound on walking at maximum reach."""

import itertools

import numpy as np

from experiments.house import House
from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.values.episode import Episode


def reach_bound(tour: float, house: House, episode: Episode) -> float:
    """Lower bound of the walk, m, in any order of visits.

    A tour between the places of the visits is `tour` long at least. A person that picks and places from a distance can
    save that distance on the way to a place and again on the way from it, except after the last visit. Objects are
    assumed to stay in place, and arms to reach over free floor, not over furniture.

    Args:
        tour: A lower bound of all tours between the places, m.
        house: The house of a person with some reach.
        episode: The disorganized house.
    """
    reach = house.person.reach
    places = [
        reach + _extent(house.receptacles[key])
        for key in (episode.targets[placed.name] for placed in episode.objects)
    ]
    saved = 2 * (len(places) * reach + sum(places)) - min(places, default=0.0)
    return max(0.0, tour - saved)


def _extent(receptacle: ReceptacleGeometry) -> float:
    """Distance from where a person is sent to use a receptacle to the farthest point of its volume, m, on the floor."""
    corners = np.array(list(itertools.product((-1.0, 1.0), repeat=3))) * receptacle.half_size
    floor = (corners @ receptacle.rotation.T + receptacle.center)[:, :2]
    return float(np.linalg.norm(floor - receptacle.approach, axis=1).max())
