"""Errands: go somewhere, face it, pick or place. What every simulated participant does between decisions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from experiments.participants.base import Outlook, Percept, Point
from experiments.participants.walking import follow, project
from experiments.participants.walking_rollout import (
    TURN,
    WALK,
    headway,
    rollout_visit,
    visit_step,
)
from mjsim.actions import IDLE, Action, Move, Pick, Place
from planner.errors import PlannerError

STOP_DISTANCE = 0.72  # m from the target: near enough to reach, far enough not to kick it
CLOSER = 0.12  # m nearer after every refusal
NEAREST_STOP = 0.30  # m
OFF_THE_WAY = 0.4  # m from the remembered way before a new one is thought out
BACK_OFF = 0.6  # s
FAR = 1e6  # m

Visit = tuple[str, str]  # `pick` or `place`, and the object

NO_MOVES = np.zeros((0, 4))


@dataclass(frozen=True)
class VisitTask:
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
    def key(self) -> Visit:
        """What tells errands apart."""
        return self.kind, self.object

    @property
    def action(self) -> Pick | Place:
        """What to ask of the world once there."""
        return Pick(self.object) if self.kind == "pick" else Place(self.object)


def visit_task(house: KnownHouse, percept: Percept, visit: Visit, seen: Mapping[str, Point]) -> VisitTask:
    """What a visit takes: to fetch an object from where it was seen, or to bring one to its receptacle."""
    kind, name = visit
    if kind == "pick":
        return VisitTask("pick", name, seen[name], house.stand_for_object(seen[name]))
    receptacle = percept.targets[name]
    return VisitTask("place", name, house.bins[receptacle], house.approaches[receptacle])


def nearest_visit(
    house: KnownHouse, percept: Percept, visits: Sequence[Visit], seen: Mapping[str, Point]
) -> Visit:
    """The visit of one or more with the shortest way to it; `seen` says where objects were seen, m, (2,)."""
    stands = [visit_task(house, percept, visit, seen).stand for visit in visits]
    return min(zip(estimated_distances(house, percept.position, stands), visits, strict=True))[1]


class VisitExecutor:
    """Carries out one errand after the other; remembers refusals and lack of headway."""

    def __init__(self, house: KnownHouse) -> None:
        self._house = house
        self._errand: Visit | None = None
        self._known: VisitTask | None = None
        self._stop = STOP_DISTANCE
        self._path: NDArray[np.float64] | None = None
        self._back_off_until = -1.0
        self._memory = np.array([np.inf, 0.0])  # of the walk, see `strides`
        self._memories = self._memory[None]

    def errand(self, percept: Percept, visit: Visit, seen: Mapping[str, Point]) -> VisitTask:
        """What a visit takes, as `visit_task`; thought out anew only when the object has moved."""
        known, (kind, name) = self._known, visit
        same = known is not None and known.key == visit
        if known is None or not same or (kind == "pick" and not np.array_equal(known.goal, seen[name])):
            self._known = known = visit_task(self._house, percept, visit, seen)
        return known

    def act(self, percept: Percept, errand: VisitTask, path: NDArray[np.float64] | None = None) -> Action:
        """One control step towards `errand`.

        Args:
            percept: What is perceived now.
            errand: What to do; a changed one starts afresh.
            path: Floor points to follow, m, shape (k, 2); None to walk the shortest way one knows.
        """
        if percept.busy:
            return IDLE
        self._take_up(percept, errand)
        if percept.answer is not None and not percept.answer.applied:
            self._stop = max(self._stop - CLOSER, NEAREST_STOP)
        if percept.time < self._back_off_until:
            return Move(forward=-0.4, left=0.3)
        way = path if path is not None else self.way_to(percept.position, errand.stand)
        x, y = percept.position
        todo, turn = visit_step(way, x, y, percept.heading, _pair(errand.goal), self._stop)
        if todo == WALK:
            return self.walk(percept, way)
        return Move(turn=turn) if todo == TURN else errand.action

    def foresee(
        self, percept: Percept, outlook: Outlook, errand: VisitTask, path: NDArray[np.float64] | None = None
    ) -> NDArray[np.float64]:
        """Moves that `act` would make one after the other, shape (n, 4); none where it would do something else.

        Args:
            percept: What is perceived now; it holds no answer.
            outlook: What the walk depends on.
            errand: What to do.
            path: Floor points that are shown, m, shape (k, 2), of which what lies behind vanishes; None to walk
                the shortest way one knows.
        """
        self._take_up(percept, errand)
        if percept.time < self._back_off_until:
            return NO_MOVES
        if path is not None:
            return self._foresee(percept, outlook, path, errand.goal, self._stop, shown=True)
        way = self.way_to(percept.position, errand.stand)
        return self._foresee(percept, outlook, way, errand.goal, self._stop)

    def foresee_walk(
        self, percept: Percept, outlook: Outlook, goal: Point, stop: float
    ) -> NDArray[np.float64]:
        """Moves that `walk` would make on the way to `goal`, up to `stop` m from it, shape (n, 4)."""
        return self._foresee(percept, outlook, self.way_to(percept.position, goal), goal, stop, face=False)

    def went(self, steps: int) -> None:
        """So many of the moves foreseen were made."""
        self._memory = self._memories[steps].copy()

    def way_to(self, position: Point, goal: Point) -> NDArray[np.float64]:
        """The remembered way to `goal`, thought out anew when it leads elsewhere or one has left it."""
        known = self._path
        if known is None or known[-1, 0] != goal[0] or known[-1, 1] != goal[1] or _off(known, position):
            self._path = known = np.vstack([self._house.path(position, goal), goal])
        return known

    def walk(self, percept: Percept, way: NDArray[np.float64]) -> Action:
        """One control step along `way`; steps back and tries another way after a while without headway."""
        x, y = percept.position
        if not headway(way, x, y, percept.time, self._memory):
            self._path, self._back_off_until = None, percept.time + BACK_OFF
            self._memory[:] = np.inf, self._back_off_until
        things = percept.things
        return Move(
            *follow(
                way,
                x,
                y,
                percept.heading,
                things.positions,
                things.minded,
                self._after(percept),
                self._house.outline,
            )
        )

    def _foresee(
        self,
        percept: Percept,
        outlook: Outlook,
        way: NDArray[np.float64],
        goal: Point,
        stop: float,
        *,
        shown: bool = False,
        face: bool = True,
    ) -> NDArray[np.float64]:
        things = percept.things
        moves = np.empty((outlook.limit, 4))
        self._memories = np.empty((outlook.limit + 1, 2))
        self._memories[0] = self._memory
        count = rollout_visit(
            outlook.locomotion.body.copy(),
            outlook.locomotion.gait,
            outlook.locomotion.floor,
            way,
            shown,
            outlook.stray if shown else OFF_THE_WAY,
            _pair(goal),
            stop,
            face,
            percept.time,
            things.positions,
            things.minded,
            self._after(percept),
            self._house.outline,
            moves,
            self._memories,
        )
        return moves[:count]

    def _take_up(self, percept: Percept, errand: VisitTask) -> None:
        """Begin `errand`, if it is not the one that is under way."""
        if errand.key == self._errand:
            return
        self._errand, self._path, self._stop = errand.key, None, STOP_DISTANCE
        self._memory[:] = np.inf, percept.time

    def _after(self, percept: Percept) -> int:
        """Number of the object that the present or last errand is about."""
        return -1 if self._errand is None else percept.things.index(self._errand[1])


def _pair(point: Point) -> tuple[float, float]:
    return float(point[0]), float(point[1])


def _off(way: NDArray[np.float64], position: Point) -> bool:
    return project(way, position[0], position[1])[1] > OFF_THE_WAY


def estimated_distance(house: KnownHouse, start: Point, goal: Point) -> float:
    """Walking distance in m as a person estimates it; very far when there is no way."""
    try:
        return house.distance(start, goal)
    except PlannerError:
        return FAR


def estimated_distances(house: KnownHouse, start: Point, goals: Sequence[Point]) -> list[float]:
    """Walking distances in m from one point to several, as `estimated_distance`."""
    try:
        return [float(gap) for gap in house.geodesics.distances_from(start, np.array(goals))]
    except PlannerError:  # one of them cannot be reached
        return [estimated_distance(house, start, goal) for goal in goals]
