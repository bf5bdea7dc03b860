"""Looking around: a full turn on the spot."""

import math

from experiments.participants.base import Percept
from mjsim.values.actions import Action, Move

TURNING = 0.8  # of the turning speed
LOOK_GAIN = 4.0  # rad/s per rad of pitch
FULL_TURN = 2.0 * math.pi


class FullTurn:
    """Turns once around from a heading, rad; with `level` the gaze is straight ahead, else the pitch stays."""

    def __init__(self, heading: float, *, level: bool = False) -> None:
        self._turned, self._heading, self._level = 0.0, heading, level

    def act(self, percept: Percept) -> Action | None:
        """Turn on; None once the turn is complete."""
        step = (percept.heading - self._heading + math.pi) % FULL_TURN - math.pi
        self._turned, self._heading = self._turned + step, percept.heading
        if self._turned >= FULL_TURN:
            return None
        look, fastest = -LOOK_GAIN * percept.pitch, percept.person.looking_speed
        return Move(
            turn=TURNING * percept.person.turning_speed,
            look=min(max(look, -fastest), fastest) if self._level else 0.0,
        )
