"""The memory of a person: places of bins and objects."""

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np

from experiments.participants.base import Point
from experiments.participants.behaviour import chance, varies


@dataclass(frozen=True)
class Memory:
    """How much a person remembers.

    After one tour through a building most landmarks are recalled (a share of about 0.8 is a starting value). Memory of
    where an object was seen fades; times are exponential, and their mean is a starting value.
    """

    # probability of knowing where a bin is after the familiarisation. The HUD names its room.
    knows_bins: float = chance(0.8)
    # mean time for which the place of an object is remembered, s
    retention: float = varies({"lognormal": [300.0, 0.5]}, 1.0, 1e6, "s")


class Recollection:
    """The places that a person remembers at present.

    Args:
        memory: How well.
        receptacles: Keys of all bins.
        rng: Source of chance.

    Attributes:
        objects: Believed places of objects, m, shape (2,).
        bins: Bins whose place is known.
    """

    def __init__(self, memory: Memory, receptacles: Collection[str], rng: np.random.Generator) -> None:
        self._memory, self._rng = memory, rng
        self._until: dict[str, float] = {}
        self.objects: dict[str, Point] = {}
        self.bins = {key for key in sorted(receptacles) if rng.random() < memory.knows_bins}

    def learn(self, found: Mapping[str, Point], time: float) -> list[str]:
        """Remember where objects were seen at `time`, s; names of those that were not remembered before."""
        new = [name for name in found if name not in self.objects]
        self.objects.update(found)
        for name in found:
            self._until[name] = time + self._memory.retention * float(self._rng.exponential())
        return new

    def forget(self, time: float, but: str | None = None) -> None:
        """Forget objects that were seen too long ago, except `but`."""
        for name in [n for n, until in self._until.items() if until < time and n != but]:
            self.drop(name)

    def drop(self, name: str) -> None:
        self.objects.pop(name, None)
        self._until.pop(name, None)
