"""Limits on how fast commands change: walking, turning and looking within what a person can do, as numba kernels.

A command holds the velocity forward and to the left, m/s, the yaw rate, rad/s, and the pitch of the head, rad:
`Rig.motion`, or part of a body of `mjsim.world.fidelity.kinematics`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.support.kernels import kernel

Command = NDArray[np.float64]

FORWARD, LEFT, TURN, LOOK = 0, 1, 2, 3


@kernel
def change_velocity(
    command: Command, forward: float, left: float, max_speed: float, max_change: float
) -> None:
    """Change the velocity towards a wanted one, no faster than `max_speed`, by `max_change` at most; all m/s."""
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
    """Change the yaw rate towards a wanted one, no faster than `max_rate`, by `max_change` at most; all rad/s."""
    change = min(max_rate, max(-max_rate, rate)) - command[TURN]
    command[TURN] += min(max_change, max(-max_change, change))


@kernel
def change_pitch(
    command: Command, rate: float, max_rate: float, lowest: float, highest: float, seconds: float
) -> None:
    """Move the pitch at a wanted rate, rad/s, no faster than `max_rate`, between the lowest and the highest, rad."""
    rate = min(max_rate, max(-max_rate, rate))
    if rate != 0.0:
        command[LOOK] = min(highest, max(lowest, command[LOOK] + rate * seconds))
