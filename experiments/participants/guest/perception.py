"""What a person notices of what is in view: less the farther away it is, and the more of it is hidden."""

import math
from dataclasses import dataclass

import numpy as np

from experiments.participants.base import Percept, Point
from experiments.participants.behaviour import chance, varies


@dataclass(frozen=True)
class Perception:
    """How well a person notices things.

    How conspicuous a thing is predicts how soon it is found (Toet et al., Optical Engineering 37, 1998). That the
    probability is logistic in the distance, and where half of the objects are found, are assumptions. Field of view
    and sight range are those of the body (docs/people.md), and what stands in between is the scene's own geometry.

    Attributes:
        half_distance: Distance at which half of the objects in full view are noticed, m.
        distance_spread: Scale of the logistic curve, m; nearly all are noticed three of these nearer.
        looks_around: Probability of looking all around where a search leads to.
        covers: How far from the person floor in view counts as looked at, m; what is overlooked there is looked for
            again, more closely, once all rooms have been searched.
    """

    half_distance: float = varies({"uniform": [6.0, 8.0]}, 0.1, 100.0, "m")
    distance_spread: float = varies(1.0, 0.01, 20.0, "m")
    looks_around: float = chance(0.8)
    covers: float = varies({"uniform": [2.0, 6.0]}, 0.0, 100.0, "m")

    def probability(self, distance: float, share: float) -> float:
        """How probably an object is noticed on entering a scene.

        Args:
            distance: From the person, m.
            share: How much of it is visible, 0 to 1; as visual angles go, a quarter is like twice the distance.
        """
        if share <= 0:
            return 0.0
        beyond = (distance / math.sqrt(share) - self.half_distance) / self.distance_spread
        return 1.0 / (1.0 + math.exp(min(beyond, 700.0)))


class Noticing:
    """Notices objects. What was overlooked is overlooked until the person is nearer or looks afresh.

    Args:
        perception: How well.
        rng: Source of chance.
    """

    def __init__(self, perception: Perception, rng: np.random.Generator) -> None:
        self._perception, self._rng = perception, rng
        self._thresholds: dict[str, float] = {}

    def look_afresh(self) -> None:
        """What was overlooked may be noticed from the same place now, as when somebody enters a room again."""
        self._thresholds.clear()

    def notice(self, percept: Percept) -> dict[str, Point]:
        """Objects that are noticed now -> floor position, m, shape (2,); those at the feet always are."""
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
