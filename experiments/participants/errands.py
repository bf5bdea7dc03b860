"""Errands: go somewhere, face it, pick or place. What every simulated participant does between decisions."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from experiments.participants.base import Percept, Point
from experiments.participants.walking import follow, path_length, project, sidestep, turn_towards
from mjsim.actions import IDLE, Action, Move, Pick, Place
from planner.errors import PlannerError

STOP_DISTANCE = 0.72  # m from the target: near enough to reach, far enough not to kick it
CLOSER = 0.12  # m nearer after every refusal
NEAREST_STOP = 0.30  # m
ARRIVED = 0.06  # m from the end of the way
FACING = 0.25  # rad
OFF_THE_WAY = 0.4  # m from the remembered way before a new one is thought out
STUCK_AFTER = 2.0  # s without headway
BACK_OFF = 0.6  # s


@dataclass(frozen=True)
class Errand:
    """One visit: pick this object, or place it.

    Attributes:
        kind: `pick` or `place`.
        object: Instance name.
        goal: Where the object or the middle of the receptacle is, m, shape (2,).
        stand: Where the shortest way to it ends, m, shape (2,).
    """

    kind: str
    object: str
    goal: Point
    stand: Point

    @property
    def key(self) -> tuple[str, str]:
        """What tells errands apart."""
        return self.kind, self.object

    @property
    def action(self) -> Pick | Place:
        """What to ask of the world once there."""
        return Pick(self.object) if self.kind == "pick" else Place(self.object)


def pick_errand(house: KnownHouse, name: str, position: Point) -> Errand:
    """Fetch the object `name` that lies at `position`."""
    return Errand("pick", name, position, house.stand_for_object(position))


def place_errand(house: KnownHouse, name: str, receptacle: str) -> Errand:
    """Bring the carried object `name` to `receptacle`."""
    return Errand("place", name, house.bins[receptacle], house.approaches[receptacle])


class ErrandRunner:
    """Carries out one errand after the other; remembers refusals and lack of headway."""

    def __init__(self, house: KnownHouse) -> None:
        self._house = house
        self._errand: tuple[str, str] | None = None
        self._stop = STOP_DISTANCE
        self._path: NDArray[np.float64] | None = None
        self._least_left = np.inf
        self._least_left_time = 0.0
        self._back_off_until = -1.0

    def act(self, percept: Percept, errand: Errand, path: NDArray[np.float64] | None = None) -> Action:
        """One control step towards `errand`.

        Args:
            percept: What is perceived now.
            errand: What to do; a changed one starts afresh.
            path: Floor points to follow, m, shape (k, 2); None to walk the shortest way one knows.
        """
        if percept.busy:
            return IDLE
        if errand.key != self._errand:
            self._begin(percept.time, errand)
        if percept.answer is not None and not percept.answer.applied:
            self._stop = max(self._stop - CLOSER, NEAREST_STOP)
        if percept.time < self._back_off_until:
            return Move(forward=-0.4, left=0.3)
        way = path if path is not None else self.way_to(percept.position, errand.stand)
        arrived = float(np.linalg.norm(way[-1] - percept.position)) < ARRIVED
        if float(np.linalg.norm(errand.goal - percept.position)) > self._stop and not arrived:
            return self.walk(percept, way)
        turn, error = turn_towards(percept.heading, percept.position, errand.goal)
        if abs(error) > FACING:
            return Move(turn=turn)
        return errand.action

    def way_to(self, position: Point, goal: Point) -> NDArray[np.float64]:
        """The remembered way to `goal`, thought out anew when it leads elsewhere or one has left it."""
        known = self._path
        if known is None or not np.array_equal(known[-1], goal) or project(known, position)[1] > OFF_THE_WAY:
            self._path = known = np.vstack([self._house.path(position, goal), goal])
        return known

    def walk(self, percept: Percept, way: NDArray[np.float64]) -> Action:
        """One control step along `way`; steps back and tries another way after a while without headway."""
        arc, gap = project(way, percept.position)
        left = path_length(way) - arc + gap
        if left < self._least_left - 0.05 or left > self._least_left + 1.0:
            self._least_left, self._least_left_time = left, percept.time
        elif percept.time - self._least_left_time > STUCK_AFTER:
            self._path, self._back_off_until = None, percept.time + BACK_OFF
            self._least_left, self._least_left_time = np.inf, self._back_off_until
        things = [
            xy for name, xy in percept.nearby.items() if self._errand is None or name != self._errand[1]
        ]

        def around(target: Point, beyond: Point) -> Point:
            return sidestep(percept.position, target, beyond, things, self._house.navmesh.is_navigable)

        return follow(way, percept.position, percept.heading, around=around)

    def _begin(self, time: float, errand: Errand) -> None:
        self._errand, self._path, self._stop = errand.key, None, STOP_DISTANCE
        self._least_left, self._least_left_time = np.inf, time


def estimated_distance(house: KnownHouse, start: Point, goal: Point) -> float:
    """Walking distance in m as a person estimates it; very far when there is no way."""
    try:
        return house.distance(start, goal)
    except PlannerError:
        return 1e6
