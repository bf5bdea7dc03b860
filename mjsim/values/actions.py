"""Actions of the person, and the answer of the world to them."""

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.values.errors import ActionError

TIME_TOLERANCE = 1e-6  # s; times are sums of many steps, and no decision may depend on their rounding


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

    Raises:
        ActionError: The name is no text.
    """

    object: str | None = None

    def __post_init__(self) -> None:
        _check_name(self.object)


@dataclass(frozen=True)
class Place:
    """Put a carried object into its receptacle.

    Attributes:
        object: Instance name, or None for the carried object whose receptacle is nearest.

    Raises:
        ActionError: The name is no text.
    """

    object: str | None = None

    def __post_init__(self) -> None:
        _check_name(self.object)


def _check_name(name: str | None) -> None:
    if name is not None and not (isinstance(name, str) and name.isprintable()):
        raise ActionError(f"the name of an object must be printable text, or None, got {name!r:.200}")


@dataclass(frozen=True, eq=False)
class FollowPath:
    """Walk along a path, pass objects on the floor, face the goal at its end, and pick or place there.

    Attributes:
        points: Floor polyline, m, shape (k, 2), k >= 1.
        goal: Where the walk leads, m, shape (2,): an object or a receptacle may be beside the end of the path.
        stop_distance: How near to the goal the walk ends, m; it also ends with the path.
        then: The action at the end, once the person faces the goal; None to do nothing and face nothing.
        until: Simulated time at which to stop, s; None for the end of the walk.
        shown: Whether the path is shown by the HUD, which cuts off the part behind the person.
        tolerance: Distance from the path at which to stop, m.

    Raises:
        ActionError: The points or the goal have another shape, or a number is not finite.
    """

    points: NDArray[np.float64]
    goal: NDArray[np.float64]
    stop_distance: float
    then: Pick | Place | None = None
    until: float | None = None
    shown: bool = False
    tolerance: float = 0.4

    def __post_init__(self) -> None:
        try:  # kernels take arrays of floats alone
            for name in ("points", "goal"):
                object.__setattr__(self, name, np.ascontiguousarray(getattr(self, name), np.float64))
        except (TypeError, ValueError) as error:
            raise ActionError(f"points and goal of a path must be arrays of numbers: {error}") from error
        shape = self.points.shape
        if len(shape) != 2 or shape[1] != 2 or shape[0] < 1:
            raise ActionError(f"the points of a path must have the shape (n, 2) with n >= 1, got {shape}")
        if self.goal.shape != (2,):
            raise ActionError(f"the goal of a path must have the shape (2,), got {self.goal.shape}")
        numbers = (*self.goal, self.stop_distance, self.tolerance, 0.0 if self.until is None else self.until)
        if not (np.isfinite(self.points).all() and np.isfinite(numbers).all()):
            raise ActionError("points, goal, distances and times of a path must be finite numbers")


@dataclass(frozen=True)
class Wait:
    """Stand still until the pick or place under way has ended; without one, for a time.

    Attributes:
        until: Simulated time at which to stop, s; None for one control step.

    Raises:
        ActionError: The time is not a number.
    """

    until: float | None = None

    def __post_init__(self) -> None:
        if self.until is not None and math.isnan(self.until):
            raise ActionError(f"Wait.until must be a time or None, got {self.until!r}")


StepAction = Move | Pick | Place
"""An action that takes one control step."""
Action = StepAction | FollowPath | Wait

IDLE = Move()
"""Stand still."""
WAIT = Wait()
"""Wait for the end of a pick or place, or for one control step."""


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
        """Whether the motion was started."""
        return self.refusal is None


class EventKind(enum.Enum):
    """What happened in the physics: outcome of a motion, object lost or dislodged, or an anomaly (docs/metrics.md)."""

    PICKED = "picked"
    PICK_FAILED = "pick_failed"
    PLACED = "placed"
    PLACE_FAILED = "place_failed"
    GRIP_LOST = "grip_lost"
    DISLODGED = "dislodged"
    EJECTED = "ejected"
    TUNNELLED = "tunnelled"


class Stop(enum.Enum):
    """Why an action stopped."""

    DONE = "done"  # complete: the control step, the wait, or the motion that was waited for
    ARRIVED = "arrived"  # at the end of the path; the next step does what is to be done there
    BLOCKED = "blocked"  # the walk makes no progress
    CHANGED = "changed"  # the person has left the path, or an object has moved
    EVENT = "event"  # something happened
    DUE = "due"  # the time is up, or the limit of control steps is reached


@dataclass(frozen=True)
class WorldEvent:
    """One physical outcome."""

    time: float  # simulated time, s
    kind: EventKind  # what happened
    object: str  # instance name of the object concerned
    receptacle: str | None = None  # receptacle concerned, if any
