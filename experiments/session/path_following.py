"""Walking along a polyline the way a person does: look ahead, slow down for sharp turns, pass objects beside the feet.

Compiled, because this runs at every control step of every participant. The same kernels run step by step and in
rollouts (`experiments.session.locomotion`), so both give the same numbers to the last bit.
"""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel
from mjsim.motion_parameters import WalkingParameters
from mjsim.person_parameters import PersonParameters
from planner.polyline import AT_THE_END, Path, distance, path_length, point_along, project


class Pace(NamedTuple):
    """How fast a person walks and turns, and how wide it is.

    Attributes:
        speed: Usual walk, m/s.
        braking: Deceleration planned for, m/s^2.
        turning_speed: Fastest turn, rad/s.
        clearance: Distance kept from the middle of objects on the floor, m.
        patience: Time without progress until the person is blocked, s.
        walking: How it follows a path.
    """

    speed: float
    braking: float
    turning_speed: float
    clearance: float
    patience: float
    walking: WalkingParameters

    @classmethod
    def of(cls, person: PersonParameters) -> "Pace":
        """That of a person."""
        walking = person.walking
        braking = walking.braking_share * person.walking_acceleration
        clearance = person.body_radius + walking.object_clearance
        return cls(person.walking_speed, braking, person.turning_speed, clearance, person.patience, walking)


class Obstacles(NamedTuple):
    """What a walker keeps clear of.

    Attributes:
        positions: Object positions, m, shape (n, 2 or more).
        is_obstacle: Whether to walk around the object, shape (n,).
        walls: Outline of the navigable floor, ends x, y, x, y of its edges, m, shape (e, 4).
    """

    positions: NDArray[np.float64]
    is_obstacle: NDArray[np.bool_]
    walls: NDArray[np.float64]


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
def is_free(x: float, y: float, walls: NDArray[np.float64]) -> bool:
    """Whether a person can stand at (x, y), given the outline of the navigable floor, m, shape (e, 4)."""
    inside = False
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

    Passes the nearest object ahead on the side it is not on; on the other side if that is blocked and takes no
    turn aside; and else straight on, over it.

    Args:
        x: Where the person is, m.
        y: Where the person is, m.
        target: Where the person is heading for, m.
        beyond: Farther along the path, m: it decides what is in the way and on which side, and keeps the person on
            that side, because it lies behind the object.
        obstacles: What to keep clear of.
        pace: How the person walks.
    """
    clearance, walking = pace.clearance, pace.walking
    reach = distance(x, y, beyond[0], beyond[1])
    if reach < AT_THE_END:
        return target
    ahead_x, ahead_y = (beyond[0] - x) / reach, (beyond[1] - y) / reach
    nearest_along, nearest_across = np.inf, np.inf
    for k in range(len(obstacles.positions)):
        if not obstacles.is_obstacle[k]:
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
    corners nor while it turns; the pace drops with the angle still to turn and with the distance left.

    Args:
        path: Floor polyline, m, shape (k, 2), k >= 1.
        x: Where the person is, m.
        y: Where the person is, m.
        heading: Where the person faces, rad.
        obstacles: What to keep clear of.
        pace: How the person walks.
    """
    arc, gap = project(path, x, y)
    left = max(path_length(path) - arc, 0.0) + gap
    beyond = point_along(path, arc + pace.walking.look_beyond)
    target = sidestep(x, y, point_along(path, arc + pace.walking.look_ahead), beyond, obstacles, pace)
    turn, error = turn_towards(heading, x, y, target[0], target[1], pace)
    ahead = max(math.cos(error), 0.0)
    speed = min(pace.speed, math.sqrt(2.0 * pace.braking * left)) * ahead * ahead
    return speed * math.cos(error), speed * math.sin(error), turn
