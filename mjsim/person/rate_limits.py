"""How commands change: walking, turning and looking within what a person can do, as numba kernels.

A motion holds the commanded velocity forward and to the left, m/s, the yaw rate, rad/s, and the pitch of the head,
rad: `Rig.motion`, or part of a body of `mjsim.fidelity.kinematics`.
"""

import math

import numpy as np
from numpy.typing import NDArray

from mjsim.kernels import kernel

Motion = NDArray[np.float64]

FORWARD, LEFT, TURN, LOOK = 0, 1, 2, 3


@kernel
def slew_walk(motion: Motion, forward: float, left: float, fastest: float, most: float) -> None:
    """Change the velocity towards a wanted one, no faster than `fastest`, by `most` at most; all m/s."""
    speed = math.hypot(forward, left)
    if speed > fastest:
        forward, left = forward * (fastest / speed), left * (fastest / speed)
    change_f, change_l = forward - motion[FORWARD], left - motion[LEFT]
    size = math.hypot(change_f, change_l)
    if size <= most:
        motion[FORWARD], motion[LEFT] = forward, left
    else:
        motion[FORWARD] += change_f * (most / size)
        motion[LEFT] += change_l * (most / size)


@kernel
def slew_turn(motion: Motion, rate: float, fastest: float, most: float) -> None:
    """Change the yaw rate towards a wanted one, no faster than `fastest`, by `most` at most; all rad/s."""
    change = min(fastest, max(-fastest, rate)) - motion[TURN]
    motion[TURN] += min(most, max(-most, change))


@kernel
def slew_look(
    motion: Motion, rate: float, fastest: float, lowest: float, highest: float, seconds: float
) -> None:
    """Move the pitch at a wanted rate, rad/s, no faster than `fastest`, between the lowest and the highest, rad."""
    rate = min(fastest, max(-fastest, rate))
    if rate != 0.0:
        motion[LOOK] = min(highest, max(lowest, motion[LOOK] + rate * seconds))
