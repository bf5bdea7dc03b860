"""How a person's walk differs from the shortest: lapses of attention, and going straight for a flagpole."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.participants.base import Point
from experiments.participants.behaviour import chance, varies

WORTH_WALKING = 0.5  # m; nobody goes out of the way for less
BEFORE_WALL = 0.1  # m


@dataclass(frozen=True)
class Walking:
    """Where a walk goes astray. The shapes of the distributions are starting values.

    Attributes:
        lapses: Probability, at each walk to something, of going elsewhere first without noticing.
        astray: How far that leads at most, m.
        pull: Probability, at each walk to a flagpole behind a wall, of first walking straight towards it up to the
            wall; also how much straight lines count in estimating how far away flagpoles are.
    """

    lapses: float = chance({"beta": [0.5, 3.0]})
    astray: float = varies(3.0, 0.0, 50.0, "m")
    pull: float = chance({"beta": [2.0, 3.0]})


class Wandering:
    """Finds the places at which a walk passes by before it reaches its goal.

    Args:
        walking: How a person walks.
        house: Where it walks.
        rng: Source of chance.
    """

    def __init__(self, walking: Walking, house: House, rng: np.random.Generator) -> None:
        self._walking, self._house, self._rng = walking, house, rng

    def stops(self, start: Point, goal: Point, *, pole: bool) -> list[Point]:
        """Places to pass on the way, m, shape (2,) each; usually none.

        Args:
            start: Where the person is, m, shape (2,).
            goal: Where it wants to go, m, shape (2,).
            pole: Whether a flagpole stands there that shows through walls.
        """
        lapse, pulled, angle, far = self._rng.random(4).tolist()
        start, stops = self._house.navmesh.snap(start), []
        if lapse < self._walking.lapses:
            step = (
                far * self._walking.astray * np.array([np.cos(2 * np.pi * angle), np.sin(2 * np.pi * angle)])
            )
            stops.append(self._up_to_wall(start, start + step))
        if pole and pulled < self._walking.pull:
            before = self._up_to_wall(start, goal)
            if np.linalg.norm(goal - before) > WORTH_WALKING:
                stops.append(before)
        return [stop for stop in stops if np.linalg.norm(stop - start) > WORTH_WALKING]

    def _up_to_wall(self, start: Point, goal: Point) -> Point:
        """The farthest point of a straight line that can be walked up to, m, shape (2,)."""
        free = free_length(self._house.navmesh.outline, start, goal)
        length = float(np.linalg.norm(goal - start))
        if length == 0.0 or free >= length:
            return goal
        return np.asarray(start + (goal - start) * max(0.0, free - BEFORE_WALL) / length)


def free_length(walls: NDArray[np.float64], start: Point, goal: Point) -> float:
    """How far one can walk straight from one point (2,) to another, m, before a wall; all of it if none is in between.

    Args:
        walls: Ends x, y, x, y of the walls, m, shape (e, 4).
        start: m, shape (2,).
        goal: m, shape (2,).
    """
    way, along, offset = goal - start, walls[:, 2:] - walls[:, :2], walls[:, :2] - start
    cross = way[0] * along[:, 1] - way[1] * along[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        share = (offset[:, 0] * along[:, 1] - offset[:, 1] * along[:, 0]) / cross
        on_wall = (offset[:, 0] * way[1] - offset[:, 1] * way[0]) / cross
    hits = share[(cross != 0) & (share > 1e-9) & (share <= 1.0) & (on_wall >= 0.0) & (on_wall <= 1.0)]
    return float(hits.min(initial=1.0)) * float(np.linalg.norm(way))
