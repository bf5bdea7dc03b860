"""The objects in view that a person notices: fewer the farther away they are, and the more of them is hidden."""

import math
from dataclasses import dataclass

import numpy as np

from experiments.participants.base import Percept, Point
from experiments.participants.behaviour import chance, varies


@dataclass(frozen=True)
class Perception:
    """How well a person notices objects.

    Conspicuity predicts search time (Toet et al., Optical Engineering 37, 1998). A probability
    that is logistic in the distance, and its half distance, are assumptions. Field of view
    and sight range are those of the body (docs/participants.md). Occlusion follows from the geometry of the scene.
    """

    # distance at which half of the objects in full view are noticed, m
    half_distance: float = varies({"uniform": [6.0, 8.0]}, 0.1, 100.0, "m")
    # scale of the logistic curve, m; nearly all are noticed three of these nearer
    distance_spread: float = varies(1.0, 0.01, 20.0, "m")
    looks_around: float = chance(0.8)  # probability of looking all around at the goal of a search
    # distance within which floor in view counts as searched, m; overlooked objects there are searched for
    # again, more closely, once all rooms have been searched
    covers: float = varies({"uniform": [2.0, 6.0]}, 0.0, 100.0, "m")

    def probability(self, distance: float, share: float) -> float:
        """Probability that an object at a distance, m, is noticed on entering a scene.

        `share` of it is visible, 0 to 1; a quarter has the visual angle of twice the distance.
        """
        if share <= 0:
            return 0.0
        beyond = (distance / math.sqrt(share) - self.half_distance) / self.distance_spread
        return 1.0 / (1.0 + math.exp(min(beyond, 700.0)))


class Noticing:
    """Notices objects. Overlooked ones stay so until the person is nearer or looks afresh."""

    def __init__(self, perception: Perception, rng: np.random.Generator) -> None:
        self._perception, self._rng = perception, rng
        self._thresholds: dict[str, float] = {}

    def look_afresh(self) -> None:
        """Let overlooked objects be noticed from the same place, as when a room is entered again."""
        self._thresholds.clear()

    def notice(self, percept: Percept) -> dict[str, Point]:
        """Objects that are noticed now -> floor position, m, shape (2,); those at the feet always."""
        shares = percept.visible_shares
        found = dict(percept.nearby)
        for name, place in percept.look().items():
            if name not in found and self._is_noticed(name, math.dist(place, percept.position), shares[name]):
                found[name] = place
        return found

    def _is_noticed(self, name: str, distance: float, share: float) -> bool:
        threshold = self._thresholds.get(name)
        if threshold is None:
            threshold = self._thresholds[name] = float(self._rng.random())
        return threshold < self._perception.probability(distance, share)
