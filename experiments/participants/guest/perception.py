"""Model how the guest perceives and remembers objects and bins."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.participants.base import Percept, Point
from experiments.participants.distribution import chance, varies


@dataclass(frozen=True)
class Perception:
    """Parameters that determine which objects the guest notices.

    Conspicuity predicts search time (Toet et al., Optical Engineering 37, 1998). The probability of noticing is assumed
    to be a logistic function of distance. The field of view and the sight range are parameters of the body
    (docs/participants.md). Occlusion is computed from the geometry of the scene.
    """

    # distance in metres at which half of all fully visible objects are noticed
    half_distance: float = varies({"uniform": [6.0, 8.0]}, 0.1, 100.0, "m")
    # scale of the logistic function, in metres
    distance_spread: float = varies(1.0, 0.01, 20.0, "m")
    looks_around: float = chance(0.8)  # probability of turning around at a viewpoint
    # Distance in metres within which visible floor counts as searched. Objects that are overlooked there can
    # only be found in the next round.
    covers: float = varies({"uniform": [2.0, 6.0]}, 0.0, 100.0, "m")

    def probability(self, distance: float, share: float) -> float:
        """Return the probability that an object at the given distance in metres is noticed.

        `share` is the visible fraction of the object, 0 to 1. A quarter of an object looks as large as a
        whole object at twice the distance.
        """
        if share <= 0:
            return 0.0
        beyond = (distance / math.sqrt(share) - self.half_distance) / self.distance_spread
        return 1.0 / (1.0 + math.exp(min(beyond, 700.0)))


class Noticing:
    """A model of noticing objects. Overlooked objects may be noticed later at a shorter distance."""

    def __init__(self, perception: Perception, rng: np.random.Generator) -> None:
        self._perception, self._rng = perception, rng
        self._thresholds: dict[str, float] = {}

    def look_afresh(self) -> None:
        """Give overlooked objects another chance to be noticed from the same distance."""
        self._thresholds.clear()

    def notice(self, percept: Percept) -> dict[str, Point]:
        """Return the floor positions of noticed objects, in metres. Nearby objects are always noticed."""
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


@dataclass(frozen=True)
class Memory:
    """Parameters that determine what the guest remembers.

    After one tour through a building, most landmarks are remembered. The location of an object is forgotten after an
    exponentially distributed time. Both parameters are starting values.
    """

    # probability of knowing the location of a bin after the familiarization
    knows_bins: float = chance(0.8)
    # mean time in seconds after which the location of an object is forgotten
    retention: float = varies({"lognormal": [300.0, 0.5]}, 1.0, 1e6, "s")


class Recollection:
    """The locations that a participant remembers.

    Attributes:
        objects: Positions of objects in metres, shape (2,).
        bins: Keys of the bins whose location is known.
    """

    def __init__(self, memory: Memory, receptacles: Collection[str], rng: np.random.Generator) -> None:
        self._memory, self._rng = memory, rng
        self._until: dict[str, float] = {}
        self.objects: dict[str, Point] = {}
        self.bins = {key for key in sorted(receptacles) if rng.random() < memory.knows_bins}

    def learn(self, found: Mapping[str, Point], time: float) -> None:
        """Store the positions of objects seen at `time`, in seconds."""
        self.objects.update(found)
        for name in found:
            self._until[name] = time + self._memory.retention * float(self._rng.exponential())

    def forget(self, time: float, but: str | None = None) -> None:
        """Forget the objects whose retention time has passed, except the object `but`."""
        for name in [n for n, until in self._until.items() if until < time and n != but]:
            self.drop(name)

    def drop(self, name: str) -> None:
        self.objects.pop(name, None)
        self._until.pop(name, None)
