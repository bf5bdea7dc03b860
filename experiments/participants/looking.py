"""Looking around: a full turn on the spot."""

import math

from experiments.participants.base import Decision, Percept
from mjsim.actions import Move

TURNING = 0.8  # of the turning speed
FULL_TURN = 2.0 * math.pi


class FullTurn:
    """Turns once around.

    Args:
        heading: Where the turn begins, rad.
    """

    def __init__(self, heading: float) -> None:
        self._turned, self._heading = 0.0, heading

    def act(self, percept: Percept) -> Decision | None:
        """Turn on; None once the turn is complete."""
        step = (percept.heading - self._heading + math.pi) % FULL_TURN - math.pi
        self._turned, self._heading = self._turned + step, percept.heading
        return Move(turn=TURNING * percept.person.turning_speed) if self._turned < FULL_TURN else None
