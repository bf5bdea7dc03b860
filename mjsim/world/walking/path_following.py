"""Kernels for walking along a polyline, one control step at a time.

All levels of fidelity run the same kernels, so that their results are bit-identical.
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

ARRIVED_WITHIN = 0.06  # a walk ends within this distance of the end of its path, in metres

WALKING, TURNING, ARRIVED, BLOCKED, CHANGED = range(5)  # phases of a walk
# Indices into `progress`: the shortest remaining distance so far (metres), and when it was reached (seconds).
SHORTEST_LEFT, SINCE = range(2)

Floats = NDArray[np.float64]


class Pace(NamedTuple):
    """The speeds and clearances of a walking person."""

    speed: float  # preferred speed in m/s
    braking: float  # planned deceleration in m/s^2
    turning_speed: float  # maximum turning speed in rad/s
    clearance: float  # distance kept from the centre of objects on the floor, in metres
    patience: float  # time without progress after which the person counts as blocked, in seconds
    walking: WalkingParameters

    @classmethod
    def of(cls, person: PersonParameters) -> "Pace":
        walking = person.walking
        braking = walking.braking_share * person.walking_acceleration
        clearance = person.body_radius + walking.object_clearance
        return cls(person.walking_speed, braking, person.turning_speed, clearance, person.patience, walking)


class Obstacles(NamedTuple):
    """The objects and walls that a walking person avoids."""

    positions: Floats  # positions of all objects in metres, shape (n, 2) or wider
    is_loose: NDArray[np.bool_]  # True for objects on the floor, shape (n,)
    target: int  # index of the object to pick or place, which is not an obstacle, or -1
    walls: Floats  # edges of the navigable floor, each as x, y, x, y in metres, shape (e, 4)


class Walk(NamedTuple):
    """Arguments of the kernels that follow a path: the `FollowPath` action, the person's pace and the obstacles."""

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
    """Wrap an angle in radians to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@kernel
def turn_towards(
    heading: float, x: float, y: float, to_x: float, to_y: float, pace: Pace
) -> tuple[float, float]:
    """Return the yaw rate (rad/s) at which the person turns to a point, and the remaining angle (rad)."""
    error = wrap_angle(math.atan2(to_y - y, to_x - x) - heading)
    fastest = pace.turning_speed
    return min(max(pace.walking.turn_gain * error, -fastest), fastest), error


@kernel
def is_free(x: float, y: float, walls: Floats) -> bool:
    """Return True if (x, y) is inside the outline `walls` (e, 4) of the floor, or if there is no outline."""
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
    """Return a point to walk to in place of `target`, so that the person avoids objects on the floor.

    The person at (x, y) passes the nearest object ahead on the side that needs the smaller sidestep. If that
    side is blocked, the person tries the other side. If the other side is blocked too or needs a detour, the
    person steps over the object. `beyond`, a point farther along the path, determines which object is in the
    way and on which side to pass it. All points are in metres.
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
    """Compute a control step along `path`. Return the forward and left velocity (m/s) and yaw rate (rad/s).

    The body turns towards the look-ahead point and walks straight to it, so that the person stays on the path
    at corners and during turns. The person slows down for turns and near the end of the path. The path has
    shape (k, 2), k >= 1. Lengths are in metres, angles in radians.
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
    """Return True if the remaining distance has decreased within `pace.patience`. Updates `progress` (2,)."""
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
    """Compute the next control step of a walk.

    `x` and `y` are in metres, `heading` in radians, `time` in seconds. Updates `progress` (2,). Returns the
    phase of the walk, the forward and left velocity (m/s), and the yaw rate (rad/s).
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
    """Compute a control step after the first. Return `CHANGED` if the person left the path or is blocked."""
    if project(walk.path, x, y)[1] > walk.tolerance:
        return CHANGED, 0.0, 0.0, 0.0
    step = next_step(walk, x, y, heading, time, progress)
    return step if step[0] != BLOCKED else (CHANGED, 0.0, 0.0, 0.0)


@kernel
def step_from_python(
    walk: Any, position: Floats, heading: float, time: float, progress: Floats, places: Floats, first: bool
) -> tuple[int, float, float, float]:  # fmt: skip
    """Call `next_step` or `later_step`. Return `CHANGED` if a loose object has moved since the walk began.

    `walk` is a result of `plain`, because Numba unpacks plain tuples twice as fast. `places` (n, 3) contains
    the current positions of the objects in metres.
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
    """Convert the named tuples of a walk to plain tuples, as required by `step_from_python`."""
    pace = (*walk.pace[:-1], tuple(walk.pace.walking))
    return (*walk[:-2], pace, tuple(walk.obstacles))
