"""Layout of the array with the state of a kinematic body."""

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar

X, Y, HEADING, PITCH = 0, 1, 2, 3  # m, m, rad (unwrapped), rad
VX, VY, TURN_RATE, PITCH_RATE = 4, 5, 6, 7  # in the house frame, m/s, rad/s
FORWARD, LEFT, TURN, LOOK = (
    8,
    9,
    10,
    11,
)  # commands in the body frame, m/s and rad/s, and pitch of the head, rad
SERVO = 12  # first of four: latest servo commands of x, y, yaw and pitch, in the house frame
BODY_SIZE = 16


def standing(x: float, y: float, heading: float, pitch: float = avatar.START_PITCH) -> NDArray[np.float64]:
    """Return a body at rest, with commands that keep it there, (BODY_SIZE,)."""
    body = np.zeros(BODY_SIZE)
    body[[X, Y, HEADING, PITCH]] = x, y, heading, pitch
    body[LOOK] = body[SERVO + 3] = pitch
    return body
