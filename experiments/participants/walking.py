"""Following a polyline on the floor the way a person walks: look ahead, slow down for sharp turns."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Move

CONTROL_TIMESTEP = 0.04  # s
CRUISE_SPEED = 1.3  # m/s, an unhurried indoor pace
LOOK_AHEAD = 0.25  # m; longer cuts corners into the walls, shorter wobbles
LOOK_BEYOND = 1.2  # m; farther than `STEP_AROUND_FROM`
STEP_AROUND_FROM = 0.8  # m ahead
CLEAR_OF_FEET = 0.40  # m from the body's axis: its radius and half an object
BRAKING = 1.5  # m/s^2 planned for, half of what the body can do
TURN_GAIN = 5.0  # 1/s
MAX_TURN = 2.5  # rad/s


def wrap_angle(angle: float) -> float:
    """Wrap to [-pi, pi)."""
    return float((angle + np.pi) % (2 * np.pi) - np.pi)


def project(path: NDArray[np.float64], position: NDArray[np.float64]) -> tuple[float, float]:
    """Arc length of the point of `path` nearest to `position`, and the distance to it, both m."""
    if len(path) < 2:
        return 0.0, float(np.linalg.norm(path[0] - position))
    start, step = path[:-1], np.diff(path, axis=0)
    length = np.linalg.norm(step, axis=1)
    safe = np.where(length > 0, length, 1.0)
    t = np.clip(np.einsum("ij,ij->i", position - start, step) / safe**2, 0.0, 1.0)
    gap = np.linalg.norm(start + t[:, None] * step - position, axis=1)
    nearest = int(np.argmin(gap))
    return float(length[:nearest].sum() + t[nearest] * length[nearest]), float(gap[nearest])


def point_along(path: NDArray[np.float64], arc: float) -> NDArray[np.float64]:
    """Point of `path` at arc length `arc` m, clamped to its ends, shape (2,)."""
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(path, axis=0), axis=1))])
    return np.array([np.interp(arc, length, path[:, 0]), np.interp(arc, length, path[:, 1])])


def path_length(path: NDArray[np.float64]) -> float:
    """Length of a polyline, m."""
    return float(np.linalg.norm(np.diff(path, axis=0), axis=1).sum())


def turn_towards(
    heading: float, position: NDArray[np.float64], target: NDArray[np.float64]
) -> tuple[float, float]:
    """Yaw rate (rad/s) that turns `heading` towards `target`, and the angle still to turn (rad)."""
    offset = target - position
    error = wrap_angle(float(np.arctan2(offset[1], offset[0])) - heading)
    return float(np.clip(TURN_GAIN * error, -MAX_TURN, MAX_TURN)), error


def sidestep(
    position: NDArray[np.float64],
    target: NDArray[np.float64],
    beyond: NDArray[np.float64],
    things: Sequence[NDArray[np.float64]],
    is_free: Callable[[NDArray[np.float64]], bool],
) -> NDArray[np.float64]:
    """Where to walk instead of straight to `target` so that things on the floor stay beside the feet, m, (2,).

    Passes the nearest thing ahead on the side it is not on; on the other side if that is blocked; and straight on,
    over it, if both are.

    Args:
        position: Where the person is, m, shape (2,).
        target: Where the person is heading for, m, shape (2,).
        beyond: Farther along the way, m, shape (2,): it decides what is in the way and on which side, and keeps the
            person on that side, because it lies behind the thing.
        things: Floor positions of what lies about, m, each (2,).
        is_free: Whether a person can stand at a point.
    """
    distance, reach = float(np.linalg.norm(target - position)), float(np.linalg.norm(beyond - position))
    if reach < 1e-9:
        return target
    ahead = (beyond - position) / reach
    left = np.array([-ahead[1], ahead[0]])
    in_the_way = [
        (along, across)
        for along, across in ((float(r @ ahead), float(r @ left)) for r in (t - position for t in things))
        if 0.0 < along < STEP_AROUND_FROM and abs(across) < CLEAR_OF_FEET
    ]
    if not in_the_way:
        return target
    along, across = min(in_the_way)
    side = -1.0 if across >= 0 else 1.0
    for sign in (side, -side):
        beside = position + along * ahead + (across + sign * CLEAR_OF_FEET) * left
        step = beside - position
        aside = position + step * (distance / float(np.linalg.norm(step)))
        if is_free(beside) and is_free(aside):
            return aside
    return target


def follow(
    path: NDArray[np.float64],
    position: NDArray[np.float64],
    heading: float,
    *,
    speed: float = CRUISE_SPEED,
    around: Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]] = lambda target, _: (
        target
    ),
) -> Move:
    """One control step along `path`, stopping at its end.

    The body turns towards the look-ahead point and walks straight at it, so that it leaves the path neither at
    corners nor while it turns; the pace drops with the angle still to turn and with the way left.

    Args:
        path: Floor polyline, m, shape (k, 2), k >= 1.
        position: Where the person is, m, shape (2,).
        heading: Where the person faces, rad.
        speed: Pace on a straight, m/s.
        around: Given the look-ahead point and one farther along, says where to walk; see `sidestep`.
    """
    arc, gap = project(path, position)
    left = max(path_length(path) - arc, 0.0) + gap
    target = around(point_along(path, arc + LOOK_AHEAD), point_along(path, arc + LOOK_BEYOND))
    turn, error = turn_towards(heading, position, target)
    pace = min(speed, float(np.sqrt(2 * BRAKING * left))) * max(float(np.cos(error)), 0.0) ** 2
    return Move(forward=pace * float(np.cos(error)), left=pace * float(np.sin(error)), turn=turn)
