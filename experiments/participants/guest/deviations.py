"""Model how the guest deviates from suggested steps and from the shortest path."""

from dataclasses import dataclass

import numpy as np

from experiments.house import House
from experiments.participants.base import Point, estimated_distances
from experiments.participants.distribution import chance, varies

MIN_DETOUR = 0.5  # minimum length of a detour, in metres


@dataclass(frozen=True)
class Compliance:
    """Parameters that determine how the guest complies with suggested steps.

    In the published data, the variance of deviations is largest in the condition `optimal` at every
    difficulty (PAPER section 8). This suggests that there are groups of participants who always, sometimes or
    rarely follow suggestions. The weights of the groups are starting values. A participant who always follows
    suggestions does not give up a step or pick up other objects, but may quit following.
    """

    # probability of following a suggested step
    follows: float = chance({"mixture": [[0.62, 1.0], [0.20, {"beta": [2, 2]}], [0.18, {"beta": [1, 9]}]]})
    abandons: float = chance({"beta": [1.0, 19.0]})  # probability of giving up a suggested step on the way
    # probability of picking up an object that is noticed near the path while a hand is free
    picks_up: float = chance({"uniform": [0.15, 0.30]})
    beside: float = varies(2.0, 0.0, 20.0, "m")  # maximum distance of objects picked up on the way, in metres
    # probability, at each suggestion, of ignoring this and all later suggestions
    quits: float = chance({"beta": [1.0, 99.0]})


class Adherence:
    """A model of whether a participant follows suggestions."""

    def __init__(self, compliance: Compliance, rng: np.random.Generator) -> None:
        self.compliance, self._rng, self._has_quit = compliance, rng, False

    def follows(self) -> bool:
        """Decide whether to follow a suggested step."""
        quits, chance = self._rng.random(2).tolist()
        self._has_quit |= quits < self.compliance.quits
        return chance < self.compliance.follows and not self._has_quit

    def gives_up_after(self, duration: float) -> float | None:
        """Return the time in seconds after which a suggested step is given up, or None if it is completed."""
        chance, share = self._rng.random(2).tolist()
        gives_up = chance < self.compliance.abandons and not self._always_follows
        return share * duration if gives_up else None

    def picks_up(self, distance: float) -> bool:
        """Decide whether to pick up an object that was noticed at the given distance in metres."""
        tempted = float(self._rng.random()) < self.compliance.picks_up
        return tempted and distance <= self.compliance.beside and not self._always_follows

    @property
    def _always_follows(self) -> bool:
        return self.compliance.follows >= 1.0


@dataclass(frozen=True)
class Walking:
    """Parameters of deviations from the shortest path. The shapes of their distributions were not fitted."""

    # probability that a walk without a shown path starts with a detour by mistake
    lapse_rate: float = chance({"beta": [0.5, 3.0]})
    lapse_distance: float = varies(5.0, 0.0, 50.0, "m")  # maximum length of a detour by mistake, in metres
    # Probability of first going to the point of the room that is nearest to a flagpole in another room. It is
    # also the weight of the straight-line distance when the distance to a flagpole is estimated.
    pull: float = chance({"beta": [2.0, 3.0]})


class Detours:
    """A model of the intermediate stops that the guest makes on a walk."""

    def __init__(self, walking: Walking, house: House, rng: np.random.Generator) -> None:
        self._walking, self._house, self._rng = walking, house, rng

    def stops(self, start: Point, goal: Point, *, pole: bool) -> list[Point]:
        """Return the intermediate stops of a walk, usually none.

        `pole` is True if a flagpole at the goal is visible through walls.
        """
        lapse, pulled = self._rng.random(2).tolist()
        start, stops = self._house.navmesh.snap(start), []
        if lapse < self._walking.lapse_rate:
            stops += self._lapse(start)
        if pole and pulled < self._walking.pull:
            stops += self._towards(start, goal)
        return stops

    def _lapse(self, start: Point) -> list[Point]:
        places = np.concatenate(list(self._house.viewpoints.values()))
        walks = np.array(estimated_distances(self._house, start, list(places)))
        near = places[(walks > MIN_DETOUR) & (walks <= self._walking.lapse_distance)]
        return [near[self._rng.integers(len(near))]] if len(near) else []

    def _towards(self, start: Point, goal: Point) -> list[Point]:
        room = self._house.rooms.room_at(start)
        if room == self._house.rooms.room_at(goal):
            return []
        places = self._house.viewpoints.get(room, start[None])
        gaps = np.linalg.norm(places - goal, axis=1)
        nearer = gaps.min() < np.linalg.norm(start - goal) - MIN_DETOUR
        return [places[gaps.argmin()]] if nearer else []
