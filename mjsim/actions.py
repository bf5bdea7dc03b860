"""Actions of the person, and the answer of the world to them."""

import enum
import math
from dataclasses import dataclass

from mjsim.errors import ActionError


@dataclass(frozen=True)
class Move:
    """Walk, turn and look for one control step, in the person's own frame.

    Attributes:
        forward: Velocity along the heading, m/s.
        left: Velocity to the left of the heading, m/s.
        turn: Yaw rate, counter-clockwise seen from above, rad/s.
        look: Pitch rate of the head, positive upwards, rad/s.

    Raises:
        ActionError: A component is not finite.
    """

    forward: float = 0.0
    left: float = 0.0
    turn: float = 0.0
    look: float = 0.0

    def __post_init__(self) -> None:
        for name in ("forward", "left", "turn", "look"):
            value = getattr(self, name)
            if not math.isfinite(value):
                raise ActionError(f"Move.{name} must be a finite number, got {value!r}")


@dataclass(frozen=True)
class Pick:
    """Reach for an object and take it into a free hand.

    Attributes:
        object: Instance name, or None for the nearest object in reach.
    """

    object: str | None = None


@dataclass(frozen=True)
class Place:
    """Put a carried object into its receptacle.

    Attributes:
        object: Instance name, or None for the carried object whose receptacle is nearest.
    """

    object: str | None = None


Action = Move | Pick | Place

IDLE = Move()


class Refusal(enum.Enum):
    """Why an attempt is infeasible; a refusal changes nothing in the world (PAPER section 3.2)."""

    BUSY = "busy"
    NOTHING_IN_REACH = "nothing_in_reach"
    OUT_OF_REACH = "out_of_reach"
    HANDS_FULL = "hands_full"
    HANDS_EMPTY = "hands_empty"
    NOT_CARRIED = "not_carried"
    ALREADY_CARRIED = "already_carried"
    ALREADY_DELIVERED = "already_delivered"
    NOT_THE_RECEPTACLE = "not_the_receptacle"
    RECEPTACLE_OUT_OF_REACH = "receptacle_out_of_reach"
    UNKNOWN_OBJECT = "unknown_object"


@dataclass(frozen=True)
class ActionResult:
    """Answer to a `Pick` or `Place` at the control step that asked for it.

    Attributes:
        action: What was asked.
        refusal: None when the motion was begun, else why it was not.
        object: Instance name that the action resolved to, if any.
        receptacle: Receptacle that is involved, if any.
    """

    action: Pick | Place
    refusal: Refusal | None = None
    object: str | None = None
    receptacle: str | None = None

    @property
    def applied(self) -> bool:
        """Whether the motion was begun."""
        return self.refusal is None


class EventKind(enum.Enum):
    """What happened in the physics: outcome of a motion, object lost or dislodged, or an anomaly (docs/health.md)."""

    PICKED = "picked"
    PICK_FAILED = "pick_failed"
    PLACED = "placed"
    PLACE_FAILED = "place_failed"
    GRIP_LOST = "grip_lost"
    DISLODGED = "dislodged"
    EJECTED = "ejected"
    TUNNELLED = "tunnelled"


@dataclass(frozen=True)
class WorldEvent:
    """One physical outcome.

    Attributes:
        time: Simulated time, s.
        kind: What happened.
        object: Instance name of the object concerned.
        receptacle: Receptacle concerned, if any.
    """

    time: float
    kind: EventKind
    object: str
    receptacle: str | None = None
