"""Following a polyline on the floor the way a person walks: look ahead, slow down for sharp turns.

Compiled, because this runs at every control step of every participant. Points are passed as two numbers, paths as
arrays (k, 2), k >= 1, in m. The same kernels run where a participant acts step by step and where it foresees a walk, so
that both give the same numbers to the last bit.
"""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel

Path = NDArray[np.float64]

CRUISE_SPEED = 1.3  # m/s, an unhurried indoor pace
LOOK_AHEAD = 0.25  # m; longer cuts corners into the walls, shorter wobbles
LOOK_BEYOND = 1.2  # m; farther than `STEP_AROUND_FROM`
STEP_AROUND_FROM = 0.8  # m ahead
CLEAR_OF_FEET = 0.40  # m from the body's axis: its radius and half an object
LEAST_AHEAD = 0.6  # m ahead per metre aside on the way around a thing's far side; with less one would dither
BRAKING = 1.5  # m/s^2 planned for, half of what the body can do
TURN_GAIN = 5.0  # 1/s
MAX_TURN = 2.5  # rad/s
AT_THE_END = 1e-9  # m


@kernel
def wrap_angle(angle: float) -> float:
    """Wrap to [-pi, pi)."""
    return (angle + math.pi) % (2.0 * math.pi) - math.pi


@kernel
def distance(x: float, y: float, to_x: float, to_y: float) -> float:
    """Distance of two points, m."""
    return math.sqrt((to_x - x) * (to_x - x) + (to_y - y) * (to_y - y))


@kernel
def project(path: Path, x: float, y: float) -> tuple[float, float]:
    """Arc length of the point of `path` nearest to (x, y), and the distance to it, both m."""
    nearest_arc, nearest_gap = 0.0, distance(x, y, path[0, 0], path[0, 1])
    arc = 0.0
    for k in range(len(path) - 1):
        dx, dy = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if length > 0.0:
            t = ((x - path[k, 0]) * dx + (y - path[k, 1]) * dy) / (length * length)
            t = min(max(t, 0.0), 1.0)
            gap = distance(x, y, path[k, 0] + t * dx, path[k, 1] + t * dy)
            if gap < nearest_gap:
                nearest_arc, nearest_gap = arc + t * length, gap
            arc += length
    return nearest_arc, nearest_gap


@kernel
def path_length(path: Path) -> float:
    """Length of a polyline, m."""
    arc = 0.0
    for k in range(len(path) - 1):
        arc += distance(path[k, 0], path[k, 1], path[k + 1, 0], path[k + 1, 1])
    return arc


@kernel
def point_along(path: Path, arc: float) -> tuple[float, float]:
    """Point of `path` at arc length `arc` m, clamped to its ends."""
    gone = 0.0
    if arc <= 0.0:
        return path[0, 0], path[0, 1]
    for k in range(len(path) - 1):
        dx, dy = path[k + 1, 0] - path[k, 0], path[k + 1, 1] - path[k, 1]
        length = math.sqrt(dx * dx + dy * dy)
        if arc < gone + length:
            t = (arc - gone) / length
            return path[k, 0] + t * dx, path[k, 1] + t * dy
        gone += length
    return path[-1, 0], path[-1, 1]


@kernel
def rest_of(path: Path, x: float, y: float) -> Path:
    """What is left of `path` from its point nearest to (x, y) on, m, shape (k, 2)."""
    arc, _ = project(path, x, y)
    if path_length(path) - arc < AT_THE_END:
        return path[-1:].copy()
    gone, first = 0.0, 0
    while gone <= arc + AT_THE_END and first < len(path) - 1:
        gone += distance(path[first, 0], path[first, 1], path[first + 1, 0], path[first + 1, 1])
        first += 1
    rest = np.empty((len(path) - first + 1, 2))
    rest[0, 0], rest[0, 1] = point_along(path, arc)
    rest[1:] = path[first:]
    return rest


@kernel
def first_astray(path: Path, positions: NDArray[np.float64], first: int, gap: float) -> int:
    """The first of `positions` (n, 2), from number `first` on, farther than `gap` m from `path`; -1 if none is."""
    for k in range(first, len(positions)):
        if project(path, positions[k, 0], positions[k, 1])[1] > gap:
            return k
    return -1


@kernel
def turn_towards(heading: float, x: float, y: float, to_x: float, to_y: float) -> tuple[float, float]:
    """Yaw rate (rad/s) that turns `heading` towards a point, and the angle still to turn (rad)."""
    error = wrap_angle(math.atan2(to_y - y, to_x - x) - heading)
    return min(max(TURN_GAIN * error, -MAX_TURN), MAX_TURN), error


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
    things: NDArray[np.float64],
    minded: NDArray[np.bool_],
    errand: int,
    walls: NDArray[np.float64],
) -> tuple[float, float]:
    """Where to walk instead of straight to `target` so that things on the floor stay beside the feet, m.

    Passes the nearest thing ahead on the side it is not on; on the other side if that is blocked and takes no
    turn aside; and else straight on, over it.

    Args:
        x: Where the person is, m.
        y: Where the person is, m.
        target: Where the person is heading for, m.
        beyond: Farther along the way, m: it decides what is in the way and on which side, and keeps the person on
            that side, because it lies behind the thing.
        things: Floor positions of objects, m, shape (n, 2 or more).
        minded: Which of them count, shape (n,).
        errand: One that does not, because it is what the person is after; -1 for none.
        walls: Outline of the navigable floor, m, shape (e, 4).
    """
    reach = distance(x, y, beyond[0], beyond[1])
    if reach < AT_THE_END:
        return target
    ahead_x, ahead_y = (beyond[0] - x) / reach, (beyond[1] - y) / reach
    nearest_along, nearest_across = np.inf, np.inf
    for k in range(len(things)):
        if not minded[k] or k == errand:
            continue
        dx, dy = things[k, 0] - x, things[k, 1] - y
        along, across = dx * ahead_x + dy * ahead_y, dy * ahead_x - dx * ahead_y
        in_the_way = 0.0 < along < STEP_AROUND_FROM and abs(across) < CLEAR_OF_FEET
        nearer = along < nearest_along or (along == nearest_along and across < nearest_across)
        if in_the_way and nearer:
            nearest_along, nearest_across = along, across
    if nearest_along == np.inf:
        return target
    gap = distance(x, y, target[0], target[1])
    side = -1.0 if nearest_across >= 0.0 else 1.0
    for sign in (side, -side):
        out = nearest_across + sign * CLEAR_OF_FEET
        if sign != side and nearest_along < LEAST_AHEAD * abs(out):
            break
        step_x = nearest_along * ahead_x - out * ahead_y
        step_y = nearest_along * ahead_y + out * ahead_x
        share = gap / math.sqrt(step_x * step_x + step_y * step_y)
        aside_x, aside_y = x + share * step_x, y + share * step_y
        if is_free(x + step_x, y + step_y, walls) and is_free(aside_x, aside_y, walls):
            return aside_x, aside_y
    return target


@kernel
def follow(
    path: Path,
    x: float,
    y: float,
    heading: float,
    things: NDArray[np.float64],
    minded: NDArray[np.bool_],
    errand: int,
    walls: NDArray[np.float64],
) -> tuple[float, float, float]:
    """One control step along `path`, stopping at its end: velocities forward and left (m/s), and yaw rate (rad/s).

    The body turns towards the look-ahead point and walks straight at it, so that it leaves the path neither at
    corners nor while it turns; the pace drops with the angle still to turn and with the way left.

    Args:
        path: Floor polyline, m, shape (k, 2), k >= 1.
        x: Where the person is, m.
        y: Where the person is, m.
        heading: Where the person faces, rad.
        things: What may lie in the way, with `minded`, `errand` and `walls`; see `sidestep`.
        minded: See `sidestep`.
        errand: See `sidestep`.
        walls: See `sidestep`.
    """
    arc, gap = project(path, x, y)
    left = max(path_length(path) - arc, 0.0) + gap
    beyond = point_along(path, arc + LOOK_BEYOND)
    target = sidestep(x, y, point_along(path, arc + LOOK_AHEAD), beyond, things, minded, errand, walls)
    turn, error = turn_towards(heading, x, y, target[0], target[1])
    ahead = max(math.cos(error), 0.0)
    pace = min(CRUISE_SPEED, math.sqrt(2.0 * BRAKING * left)) * ahead * ahead
    return pace * math.cos(error), pace * math.sin(error), turn
