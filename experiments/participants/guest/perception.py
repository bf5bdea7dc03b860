"""The guest's perception and memory of objects and bins."""

import math
from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.participants.base import Percept, Point
from experiments.participants.distribution import chance, varies


@dataclass(frozen=True)
class Perception:
    """Parameters of noticing objects.

    Conspicuity predicts search time (Toet et al., Optical Engineering 37, 1998). That the probability is a logistic
    function of distance, and its half distance, are assumptions. Field of view and sight range are those of the body
    (docs/participants.md), and occlusion is computed from the geometry of the scene.
    """

    # distance at which half of the objects in full view are noticed, m
    half_distance: float = varies({"uniform": [6.0, 8.0]}, 0.1, 100.0, "m")
    # scale of the logistic curve, m; three scales below `half_distance`, almost all objects are noticed
    distance_spread: float = varies(1.0, 0.01, 20.0, "m")
    looks_around: float = chance(0.8)  # probability of looking all around at a searched place
    # distance within which visible floor counts as searched, m; objects overlooked there are found only in
    # the next round, when all rooms are searched more closely
    covers: float = varies({"uniform": [2.0, 6.0]}, 0.0, 100.0, "m")

    def probability(self, distance: float, share: float) -> float:
        """Return the probability that an object at a distance, m, is noticed on entering a scene.

        `share` of the object is visible, 0 to 1. A quarter of it has the visual angle of the whole at twice the
        distance.
        """
        if share <= 0:
            return 0.0
        beyond = (distance / math.sqrt(share) - self.half_distance) / self.distance_spread
        return 1.0 / (1.0 + math.exp(min(beyond, 700.0)))


class Noticing:
    """Notices objects. An overlooked object stays overlooked until the person is nearer or calls `look_afresh`."""

    def __init__(self, perception: Perception, rng: np.random.Generator) -> None:
        self._perception, self._rng = perception, rng
        self._thresholds: dict[str, float] = {}

    def look_afresh(self) -> None:
        """Give overlooked objects another chance to be noticed from the same place, as on entering a room again."""
        self._thresholds.clear()

    def notice(self, percept: Percept) -> dict[str, Point]:
        """Return the floor positions of noticed objects, m, shape (2,). Objects at the feet are always noticed."""
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
    """Parameters of memory.

    After one tour through a building most landmarks are recalled (a share of about 0.8 is a starting value). Memory of
    where an object was seen fades after an exponentially distributed time, whose mean is a starting value.
    """

    # probability of knowing where a bin is after the familiarization; the HUD names its room
    knows_bins: float = chance(0.8)
    # mean time for which the place of an object is remembered, s
    retention: float = varies({"lognormal": [300.0, 0.5]}, 1.0, 1e6, "s")


class Recollection:
    """The places that a person remembers at present.

    Attributes:
        objects: Remembered places of objects, m, shape (2,).
        bins: Keys of the bins whose place is known.
    """

    def __init__(self, memory: Memory, receptacles: Collection[str], rng: np.random.Generator) -> None:
        self._memory, self._rng = memory, rng
        self._until: dict[str, float] = {}
        self.objects: dict[str, Point] = {}
        self.bins = {key for key in sorted(receptacles) if rng.random() < memory.knows_bins}

    def learn(self, found: Mapping[str, Point], time: float) -> list[str]:
        """Remember where objects were seen at `time`, s. Return the names of those not remembered before."""
        new = [name for name in found if name not in self.objects]
        self.objects.update(found)
        for name in found:
            self._until[name] = time + self._memory.retention * float(self._rng.exponential())
        return new

    def forget(self, time: float, but: str | None = None) -> None:
        """Forget objects that were last seen too long ago. The object `but` is kept."""
        for name in [n for n, until in self._until.items() if until < time and n != but]:
            self.drop(name)

    def drop(self, name: str) -> None:
        self.objects.pop(name, None)
        self._until.pop(name, None)
