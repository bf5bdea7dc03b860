"""Turns "walk along this path" into moves: one per control step, or many at once where nobody watches every step.

Both give the same moves to the last bit, because they run the same kernels.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from experiments.house import ARRIVED_WITHIN
from experiments.participants.base import TIME_TOLERANCE, Decision, Moves, Wait, WalkAlong
from experiments.session.path_following import Obstacles, Pace, follow, turn_towards
from mjsim.actions import IDLE, Action, Move, Pick, Place
from mjsim.fidelity.body_state import HEADING, X, Y
from mjsim.fidelity.kinematics import LocomotionState
from mjsim.fidelity.kinematics import walk as walk_body
from mjsim.kernels import kernel
from mjsim.motion_parameters import WalkingParameters
from mjsim.observation import ObjectStatus, Observation
from mjsim.person_parameters import PersonParameters
from planner.polyline import distance, path_length, project, rest_of

BACK_OFF = Move(forward=-0.4, left=0.3)
BACK_OFF_TIME = 0.6  # s

WALKING, TURNING, ARRIVED, BLOCKED = range(4)  # phases of a walk
SHORTEST_LEFT, SINCE = range(2)  # progress of a walk: shortest distance left so far, m, and when that was, s

Floats = NDArray[np.float64]


class Walk(NamedTuple):
    """`WalkAlong` for kernels."""

    path: Floats
    goal: tuple[float, float]
    stop_distance: float
    face_goal: bool
    shown: bool
    tolerance: float
    pace: Pace


class Step(NamedTuple):
    """One control step: phase of the walk, velocities forward and left (m/s), yaw rate (rad/s)."""

    phase: int
    forward: float
    left: float
    turn: float


@kernel
def makes_progress(path: Floats, x: float, y: float, time: float, progress: Floats, pace: Pace) -> bool:
    """Whether a walk along `path` has got on in the last seconds of patience; updates `progress`, shape (2,)."""
    arc, gap = project(path, x, y)
    left = path_length(path) - arc + gap
    if left < progress[SHORTEST_LEFT] - pace.walking.least_progress or left > progress[SHORTEST_LEFT] + 1.0:
        progress[SHORTEST_LEFT], progress[SINCE] = left, time
        return True
    return bool(time - progress[SINCE] <= pace.patience + TIME_TOLERANCE)


@kernel
def next_step(
    walk: Walk, x: float, y: float, heading: float, time: float, obstacles: Obstacles, progress: Floats
) -> Step:
    """The next control step of a walk; updates `progress`.

    Args:
        walk: The walk.
        x: Where the person is, m.
        y: Where the person is, m.
        heading: Where the person faces, rad.
        time: Simulated time, s.
        obstacles: What to keep clear of.
        progress: Shortest distance left so far, m, and when that was, s; shape (2,).
    """
    path = rest_of(walk.path, x, y) if walk.shown else walk.path
    at_the_end = distance(x, y, path[-1, 0], path[-1, 1]) < ARRIVED_WITHIN
    if distance(x, y, walk.goal[0], walk.goal[1]) > walk.stop_distance and not at_the_end:
        phase = WALKING if makes_progress(path, x, y, time, progress, walk.pace) else BLOCKED
        forward, left, turn = follow(path, x, y, heading, obstacles, walk.pace)
        return Step(phase, forward, left, turn)
    turn, error = turn_towards(heading, x, y, walk.goal[0], walk.goal[1], walk.pace)
    if walk.face_goal and abs(error) > walk.pace.walking.facing_tolerance:
        return Step(TURNING, 0.0, 0.0, turn)
    return Step(ARRIVED, 0.0, 0.0, 0.0)


@kernel
def roll_out(
    walk: Walk, state: LocomotionState, time: float, obstacles: Obstacles, moves: Floats, progress: Floats
) -> int:
    """Moves of a walk until it ends, is blocked, or leaves its path; returns how many.

    Args:
        walk: The walk.
        state: The body, how it walks and what it walks into; the body is moved.
        time: Simulated time, s.
        obstacles: What to keep clear of.
        moves: Takes forward, left (m/s), turn and look (rad/s) of every step, shape (limit, 4).
        progress: Takes the progress after every step, shape (limit + 1, 2); row 0 holds the present one.
    """
    body, gait, floor = state
    for k in range(len(moves)):
        x, y, heading = body[X], body[Y], body[HEADING]
        if project(walk.path, x, y)[1] > walk.tolerance:
            return k
        progress[k + 1] = progress[k]
        step = next_step(walk, x, y, heading, time + k * gait.dt, obstacles, progress[k + 1])
        if step.phase == ARRIVED or step.phase == BLOCKED:
            return k
        moves[k, 0], moves[k, 1], moves[k, 2], moves[k, 3] = step.forward, step.left, step.turn, 0.0
        walk_body(body, step.forward, step.left, step.turn, 0.0, gait, floor)
    return len(moves)


class LocomotionController:
    """Walks for a participant: follows paths, sidesteps objects at the feet, and backs off when blocked.

    Args:
        walls: Outline of the navigable floor, ends x, y, x, y of its edges, m, shape (e, 4).
        person: Who walks.

    Attributes:
        blocked: Whether the walk makes no progress; until the first step after backing off.
    """

    def __init__(self, walls: Floats, person: PersonParameters) -> None:
        self._walls, self._pace = walls, Pace.of(person)
        self._plain_pace = (*self._pace[:-1], tuple(self._pace.walking))
        self._visit: Pick | Place | None = None
        self._progress = np.array([np.inf, 0.0])
        self._predicted = self._progress[None]
        self._back_off_until = -math.inf
        self._status: tuple[ObjectStatus, ...] | None = None
        self._is_loose = self._is_obstacle = np.zeros(0, np.bool_)
        self.blocked = False

    def step(self, walk: WalkAlong, seen: Observation) -> Action:
        """The next control step of a walk, or what it ends with."""
        self._take_up(walk, seen)
        if self._is_backing_off(walk, seen.time):
            return BACK_OFF
        phase, forward, left, turn = _next_step(
            _values(walk),
            self._plain_pace,
            seen.position,
            seen.heading,
            seen.time,
            tuple(self._obstacles(seen)),
            self._progress,
        )
        self.blocked = phase == BLOCKED
        if self.blocked:
            self._back_off_until = seen.time + BACK_OFF_TIME
            self._progress[:] = np.inf, self._back_off_until
        if phase == ARRIVED:
            return walk.then or IDLE
        return Move(forward, left, turn)

    def action(self, decision: Decision, seen: Observation) -> Action:
        """What a decision means for the next control step."""
        if isinstance(decision, WalkAlong):
            return self.step(decision, seen)
        if isinstance(decision, Moves):
            return Move(*decision.rows[0].tolist())
        return IDLE if isinstance(decision, Wait) else decision

    def keeps_on(self, walk: WalkAlong, asked: Observation, now: Observation) -> bool:
        """Whether one who walks along a shown path has nothing to answer to but what there was in the state `asked`."""
        if self.blocked or now.busy or (walk.until is not None and now.time >= walk.until - TIME_TOLERANCE):
            return False
        return now.object_status == asked.object_status and _is_as_before(
            walk.path,
            walk.tolerance,
            now.position,
            now.object_positions,
            asked.object_positions,
            self._flags(now)[0],
        )

    def moves(
        self, decision: Decision, seen: Observation, state: LocomotionState | None, limit: int
    ) -> Floats:
        """Moves that follow from a decision, at most `limit`, shape (n, 4); none where physics moves the person.

        The other arguments are those of `roll_out`.
        """
        if limit >= 1 and state is not None:
            if isinstance(decision, WalkAlong):
                return self.roll_out(decision, seen, state, limit)
            if isinstance(decision, Moves):
                return decision.rows[:limit]
        return np.zeros((0, 4))

    def roll_out(self, walk: WalkAlong, seen: Observation, state: LocomotionState, limit: int) -> Floats:
        """Moves that `step` would choose one after the other, as long as nothing else happens.

        Args:
            walk: The walk.
            seen: State now.
            state: What the walk depends on.
            limit: How many at most, 1 or more.

        Returns:
            Forward, left (m/s), turn and look (rad/s) of every step, shape (n, 4); n is 0 where the next one needs
            `step`. `commit` says how many were made.
        """
        self._take_up(walk, seen)
        if self._is_backing_off(walk, seen.time):
            return np.zeros((0, 4))
        if walk.until is not None:
            steps = math.ceil((walk.until - TIME_TOLERANCE - seen.time) / state.gait.dt)
            limit = max(1, min(limit, steps))
        moves, self._predicted = np.empty((limit, 4)), np.empty((limit + 1, 2))
        self._predicted[0] = self._progress
        start = state._replace(body=state.body.copy())
        count = roll_out(
            Walk(*_values(walk), self._pace), start, seen.time, self._obstacles(seen), moves, self._predicted
        )
        return moves[:count]

    def commit(self, steps: int) -> None:
        """So many of the moves rolled out last were made."""
        self._progress = self._predicted[steps].copy()
        self.blocked = False

    def _take_up(self, walk: WalkAlong, seen: Observation) -> None:
        """A walk to another visit begins anew; walks that lead to no visit count as part of the one before."""
        if walk.then is None or walk.then == self._visit:
            return
        self._visit, self._status = walk.then, None
        self._progress[:] = np.inf, seen.time

    def _is_backing_off(self, walk: WalkAlong, time: float) -> bool:
        """Only on the way to a visit: a participant that is blocked on another walk takes another path at once."""
        return walk.then is not None and time < self._back_off_until

    def _obstacles(self, seen: Observation) -> Obstacles:
        """What lies on the floor, but for the object that the present or last visit is about."""
        return Obstacles(np.ascontiguousarray(seen.object_positions), self._flags(seen)[1], self._walls)

    def _flags(self, seen: Observation) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Which objects are loose, and which of these are obstacles, shape (n,)."""
        if seen.object_status != self._status:
            self._status = seen.object_status
            target = None if self._visit is None else self._visit.object
            self._is_loose = np.array([s is ObjectStatus.LOOSE for s in seen.object_status], np.bool_)
            others = np.array([name != target for name in seen.object_names], np.bool_)
            self._is_obstacle = self._is_loose & others
        return self._is_loose, self._is_obstacle


def _values(walk: WalkAlong) -> tuple[Floats, tuple[float, float], float, bool, bool, float]:
    """`Walk` but for its pace."""
    goal, faces = (float(walk.goal[0]), float(walk.goal[1])), walk.then is not None
    return walk.path, goal, walk.stop_distance, faces, walk.shown, walk.tolerance


@kernel
def _next_step(
    walk: Any, pace: Any, position: Floats, heading: float, time: float, obstacles: Any, progress: Floats
) -> tuple[int, float, float, float]:
    """`next_step` with plain tuples: numba takes them from Python in half the time of named ones."""
    path, goal, stop_distance, face_goal, shown, tolerance = walk
    speed, braking, turning_speed, clearance, patience, walking = pace
    own = Pace(speed, braking, turning_speed, clearance, patience, WalkingParameters(*walking))
    step = next_step(
        Walk(path, goal, stop_distance, face_goal, shown, tolerance, own),
        position[0],
        position[1],
        heading,
        time,
        Obstacles(*obstacles),
        progress,
    )
    return step.phase, step.forward, step.left, step.turn


@kernel
def _is_as_before(
    path: Floats, tolerance: float, position: Floats, objects: Floats, before: Floats, loose: NDArray[np.bool_]
) -> bool:  # fmt: skip
    """Whether somebody at `position` (2,) is on the path, within `tolerance`, and no loose object (n,) has moved.

    `objects` and `before` (n, 3) are where the objects are and where they were; all in m.
    """
    for k in range(len(loose)):
        if loose[k]:
            for axis in range(3):
                if objects[k, axis] != before[k, axis]:
                    return False
    return bool(project(path, position[0], position[1])[1] <= tolerance)
