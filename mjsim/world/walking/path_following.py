"""Kernels of walking along a polyline, one control step at a time.

Every tier of fidelity runs the same kernels, one by one or many in a call, so the numbers are the same to the last bit.
"""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel
from mjsim.values.actions import TIME_TOLERANCE
from mjsim.values.motion_parameters import WalkingParameters
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.polyline import (
    AT_THE_END,
    Path,
    distance,
    path_length,
    point_along,
    project,
    rest_of,
)

ARRIVED_WITHIN = 0.06  # m from the end of its path, a walk is over

WALKING, TURNING, ARRIVED, BLOCKED, CHANGED = range(5)  # phases of a walk
SHORTEST_LEFT, SINCE = range(2)  # progress of a walk: shortest distance left so far, m, and when that was, s

Floats = NDArray[np.float64]


class Pace(NamedTuple):
    """How fast a person walks and turns, and how wide it is."""

    speed: float  # usual walk, m/s
    braking: float  # deceleration planned for, m/s^2
    turning_speed: float  # fastest turn, rad/s
    clearance: float  # distance kept from the middle of objects on the floor, m
    patience: float  # time without progress until the person is blocked, s
    walking: WalkingParameters  # how it follows a path

    @classmethod
    def of(cls, person: PersonParameters) -> "Pace":
        """That of a person."""
        walking = person.walking
        braking = walking.braking_share * person.walking_acceleration
        clearance = person.body_radius + walking.object_clearance
        return cls(person.walking_speed, braking, person.turning_speed, clearance, person.patience, walking)


class Obstacles(NamedTuple):
    """The objects and walls that a walker keeps clear of."""

    positions: Floats  # object positions, m, shape (n, 2 or more)
    is_loose: NDArray[np.bool_]  # whether the object lies on the floor, shape (n,)
    target: int  # the object that the walk is about, which is no obstacle; -1 for none
    walls: Floats  # outline of the navigable floor, ends x, y, x, y of its edges, m, shape (e, 4)


class Walk(NamedTuple):
    """`FollowPath` for kernels: its attributes, whether to face the goal at the end, the pace, and the obstacles."""

    path: Floats
    goal: tuple[float, float]
    stop_distance: float
    face_goal: bool
    shown: bool
    tolerance: float
    pace: Pace
    obstacles: Obstacles


@kernel
def wrap_angle(angle: float) -> float:
    """Wrap to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@kernel
def turn_towards(
    heading: float, x: float, y: float, to_x: float, to_y: float, pace: Pace
) -> tuple[float, float]:
    """Yaw rate, rad/s, that turns `heading` towards a point, and the angle still to turn (rad)."""
    error = wrap_angle(math.atan2(to_y - y, to_x - x) - heading)
    fastest = pace.turning_speed
    return min(max(pace.walking.turn_gain * error, -fastest), fastest), error


@kernel
def is_free(x: float, y: float, walls: Floats) -> bool:
    """Whether a person can stand at (x, y), given the outline of the navigable floor, m, shape (e, 4), if any."""
    inside = len(walls) == 0
    for k in range(len(walls)):
        if (walls[k, 1] > y) != (walls[k, 3] > y):
            at = (y - walls[k, 1]) * (walls[k, 2] - walls[k, 0]) / (walls[k, 3] - walls[k, 1])
            if x < walls[k, 0] + at:
                inside = not inside
    return inside


@kernel
def sidestep(
    x: float,
    y: float,
    target: tuple[float, float],
    beyond: tuple[float, float],
    obstacles: Obstacles,
    pace: Pace,
) -> tuple[float, float]:
    """Where to walk instead of straight to `target` so that objects on the floor stay beside the feet, m.

    Passes the nearest object ahead on its free side; on the other side if that is blocked and no detour is needed;
    else straight over it. The person is at x, y, m. `beyond`, farther along the path, m, decides what is in the way
    and on which side, and keeps the person on that side, because it lies behind the object.
    """
    clearance, walking = pace.clearance, pace.walking
    reach = distance(x, y, beyond[0], beyond[1])
    if reach < AT_THE_END:
        return target
    ahead_x, ahead_y = (beyond[0] - x) / reach, (beyond[1] - y) / reach
    nearest_along, nearest_across = np.inf, np.inf
    for k in range(len(obstacles.positions)):
        if not obstacles.is_loose[k] or k == obstacles.target:
            continue
        dx, dy = obstacles.positions[k, 0] - x, obstacles.positions[k, 1] - y
        along, across = dx * ahead_x + dy * ahead_y, dy * ahead_x - dx * ahead_y
        in_the_way = 0.0 < along < walking.sidestep_range and abs(across) < clearance
        nearer = along < nearest_along or (along == nearest_along and across < nearest_across)
        if in_the_way and nearer:
            nearest_along, nearest_across = along, across
    if nearest_along == np.inf:
        return target
    gap = distance(x, y, target[0], target[1])
    side = -1.0 if nearest_across >= 0.0 else 1.0
    for sign in (side, -side):
        out = nearest_across + sign * clearance
        if sign != side and nearest_along < walking.sidestep_room * abs(out):
            break
        step_x = nearest_along * ahead_x - out * ahead_y
        step_y = nearest_along * ahead_y + out * ahead_x
        share = gap / math.sqrt(step_x * step_x + step_y * step_y)
        aside_x, aside_y = x + share * step_x, y + share * step_y
        if is_free(x + step_x, y + step_y, obstacles.walls) and is_free(aside_x, aside_y, obstacles.walls):
            return aside_x, aside_y
    return target


@kernel
def follow(
    path: Path, x: float, y: float, heading: float, obstacles: Obstacles, pace: Pace
) -> tuple[float, float, float]:
    """One control step along `path`, stopping at its end: velocities forward and left (m/s), and yaw rate (rad/s).

    The body turns towards the look-ahead point and walks straight at it, so that it leaves the path neither at
    corners nor while it turns; the pace drops with the angle still to turn and with the distance left. The path has
    shape (k, 2), k >= 1, m; the person is at x, y, m, and faces `heading`, rad.
    """
    arc, gap = project(path, x, y)
    left = max(path_length(path) - arc, 0.0) + gap
    beyond = point_along(path, arc + pace.walking.look_beyond)
    target = sidestep(x, y, point_along(path, arc + pace.walking.look_ahead), beyond, obstacles, pace)
    turn, error = turn_towards(heading, x, y, target[0], target[1], pace)
    ahead = max(math.cos(error), 0.0)
    speed = min(pace.speed, math.sqrt(2.0 * pace.braking * left)) * ahead * ahead
    return speed * math.cos(error), speed * math.sin(error), turn


@kernel
def makes_progress(path: Floats, x: float, y: float, time: float, progress: Floats, pace: Pace) -> bool:
    """Whether a walk along `path` got on within the person's patience; updates `progress`, shape (2,)."""
    arc, gap = project(path, x, y)
    left = path_length(path) - arc + gap
    if left < progress[SHORTEST_LEFT] - pace.walking.least_progress or left > progress[SHORTEST_LEFT] + 1.0:
        progress[SHORTEST_LEFT], progress[SINCE] = left, time
        return True
    return bool(time - progress[SINCE] <= pace.patience + TIME_TOLERANCE)


@kernel
def next_step(
    walk: Walk, x: float, y: float, heading: float, time: float, progress: Floats
) -> tuple[int, float, float, float]:
    """The next control step of a walk from x, y, m, and `heading`, rad, at `time`, s.

    Updates `progress`, the shortest distance left so far, m, and when that was, s; (2,). Returns the phase of the walk,
    velocities forward and left (m/s), and the yaw rate (rad/s).
    """
    path = rest_of(walk.path, x, y) if walk.shown else walk.path
    at_the_end = distance(x, y, path[-1, 0], path[-1, 1]) < ARRIVED_WITHIN
    if distance(x, y, walk.goal[0], walk.goal[1]) > walk.stop_distance and not at_the_end:
        phase = WALKING if makes_progress(path, x, y, time, progress, walk.pace) else BLOCKED
        forward, left, turn = follow(path, x, y, heading, walk.obstacles, walk.pace)
        return phase, forward, left, turn
    turn, error = turn_towards(heading, x, y, walk.goal[0], walk.goal[1], walk.pace)
    if walk.face_goal and abs(error) > walk.pace.walking.facing_tolerance:
        return TURNING, 0.0, 0.0, turn
    return ARRIVED, 0.0, 0.0, 0.0


@kernel
def later_step(
    walk: Walk, x: float, y: float, heading: float, time: float, progress: Floats
) -> tuple[int, float, float, float]:
    """As `next_step` for the later steps of an action: `CHANGED` if the person has left the path or is blocked."""
    if project(walk.path, x, y)[1] > walk.tolerance:
        return CHANGED, 0.0, 0.0, 0.0
    step = next_step(walk, x, y, heading, time, progress)
    return step if step[0] != BLOCKED else (CHANGED, 0.0, 0.0, 0.0)


@kernel
def step_from_python(
    walk: Any, position: Floats, heading: float, time: float, progress: Floats, places: Floats, first: bool
) -> tuple[int, float, float, float]:  # fmt: skip
    """`next_step` or `later_step`; `CHANGED` also if a loose object is not where it was, in `places` (n, 3), m.

    Takes `plain` tuples, which numba unpacks in half the time of named ones.
    """
    path, goal, stop_distance, face_goal, shown, tolerance, pace, obstacles = walk
    speed, braking, turning_speed, clearance, patience, walking = pace
    own = Pace(speed, braking, turning_speed, clearance, patience, WalkingParameters(*walking))
    among = Obstacles(*obstacles)
    named = Walk(path, goal, stop_distance, face_goal, shown, tolerance, own, among)
    if first:
        return next_step(named, position[0], position[1], heading, time, progress)
    for k in range(len(among.is_loose)):
        if among.is_loose[k]:
            for axis in range(3):
                if places[k, axis] != among.positions[k, axis]:
                    return CHANGED, 0.0, 0.0, 0.0
    return later_step(named, position[0], position[1], heading, time, progress)


def plain(walk: Walk) -> Any:
    """A walk as nested tuples, for `step_from_python`."""
    pace = (*walk.pace[:-1], tuple(walk.pace.walking))
    return (*walk[:-2], pace, tuple(walk.obstacles))
