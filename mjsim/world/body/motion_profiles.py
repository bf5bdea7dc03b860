"""Kernels for point-to-point movements of a hand and for rate-limited commands."""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

STRAIGHT, ACROSS_FIRST, UP_FIRST = 0, 1, 2  # order of the horizontal and vertical parts of a movement

# Forward and left velocity (m/s), yaw rate (rad/s) and pitch of the head (rad), as in `Rig.motion`.
Command = NDArray[np.float64]
FORWARD, LEFT, TURN, LOOK = 0, 1, 2, 3


@kernel
def minimum_jerk(phase: float) -> float:
    """Return the progress of a minimum-jerk movement (Flash and Hogan, 1985) at a phase, both from 0 to 1."""
    s = min(1.0, max(0.0, phase))
    return s * s * s * (10.0 - 15.0 * s + 6.0 * s * s)


@kernel
def progress(phase: float, order: int, lead: float) -> tuple[float, float]:
    """Return the horizontal and vertical progress of a movement. One of the two starts `lead` earlier."""
    if order == STRAIGHT:
        share = minimum_jerk(phase)
        return share, share
    early, late = minimum_jerk(phase / (1.0 - lead)), minimum_jerk((phase - lead) / (1.0 - lead))
    return (early, late) if order == ACROSS_FIRST else (late, early)


@kernel
def point_between(
    start: NDArray[np.float64], goal: NDArray[np.float64], phase: float, order: int, lead: float
) -> NDArray[np.float64]:
    """Return the position (3,) of a hand that moves from `start` to `goal`. The phase increases from 0 to 1."""
    across, up = progress(phase, order, lead)
    point = np.empty(3)
    for axis in range(3):
        point[axis] = start[axis] + (across if axis < 2 else up) * (goal[axis] - start[axis])
    return point


@kernel
def change_velocity(
    command: Command, forward: float, left: float, max_speed: float, max_change: float
) -> None:
    """Change the commanded velocity towards a target by at most `max_change`, within `max_speed`, in m/s."""
    speed = math.hypot(forward, left)
    if speed > max_speed:
        forward, left = forward * (max_speed / speed), left * (max_speed / speed)
    change_f, change_l = forward - command[FORWARD], left - command[LEFT]
    size = math.hypot(change_f, change_l)
    if size <= max_change:
        command[FORWARD], command[LEFT] = forward, left
    else:
        command[FORWARD] += change_f * (max_change / size)
        command[LEFT] += change_l * (max_change / size)


@kernel
def change_turn_rate(command: Command, rate: float, max_rate: float, max_change: float) -> None:
    """Bring the commanded yaw rate closer to `rate`, by at most `max_change`. All rates are in rad/s."""
    change = min(max_rate, max(-max_rate, rate)) - command[TURN]
    command[TURN] += min(max_change, max(-max_change, change))


@kernel
def change_pitch(
    command: Command, rate: float, max_rate: float, lowest: float, highest: float, seconds: float
) -> None:
    """Change the commanded pitch (rad) at `rate` (rad/s). Both the rate and the pitch are limited."""
    rate = min(max_rate, max(-max_rate, rate))
    if rate != 0.0:
        command[LOOK] = min(highest, max(lowest, command[LOOK] + rate * seconds))
