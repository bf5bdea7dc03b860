"""Actions of the person, their results, and events that they cause."""

import enum
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.values.errors import ActionError

TIME_TOLERANCE = 1e-6  # tolerance for comparing simulated times, in seconds


@dataclass(frozen=True)
class Move:
    """An action that moves the body and the head for one control step. Velocities are in the body frame.

    Attributes:
        forward: Velocity along the heading, in m/s.
        left: Velocity to the left of the heading, in m/s.
        turn: Yaw rate, counter-clockwise seen from above, in rad/s.
        look: Pitch rate of the head, positive upwards, in rad/s.

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
    """An action that picks up an object with a free hand.

    Attributes:
        object: Instance name of the object, or None for the nearest object in reach.

    Raises:
        ActionError: The name is not printable text.
    """

    object: str | None = None

    def __post_init__(self) -> None:
        _check_name(self.object)


@dataclass(frozen=True)
class Place:
    """An action that places a carried object in its receptacle.

    Attributes:
        object: Instance name of the object, or None for the carried object with the nearest receptacle.

    Raises:
        ActionError: The name is not printable text.
    """

    object: str | None = None

    def __post_init__(self) -> None:
        _check_name(self.object)


def _check_name(name: str | None) -> None:
    if name is not None and not (isinstance(name, str) and name.isprintable()):
        raise ActionError(f"the name of an object must be printable text, or None, got {name!r:.200}")


@dataclass(frozen=True, eq=False)
class FollowPath:
    """An action that walks along a path, avoids objects on the floor, and then picks or places an object.

    Attributes:
        points: Points of the path on the floor in metres, shape (k, 2), k >= 1.
        goal: Position of the object or receptacle to which the path leads, in metres, shape (2,). It need not
            be on the path.
        stop_distance: Distance to the goal at which the walk ends, in metres, unless the path ends earlier.
        then: Action that follows after the person has turned to the goal, or None to stop without turning.
        until: Simulated time at which the person stops, in seconds, or None to walk to the end.
        shown: True if the HUD shows the part of the path that lies ahead.
        tolerance: Distance to the path beyond which the walk stops, in metres.

    Raises:
        ActionError: The points or the goal have a wrong shape, or a number is not finite.
    """

    points: NDArray[np.float64]
    goal: NDArray[np.float64]
    stop_distance: float
    then: Pick | Place | None = None
    until: float | None = None
    shown: bool = False
    tolerance: float = 0.4

    def __post_init__(self) -> None:
        try:  # compiled kernels accept only float arrays
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
    """An action that waits until the current pick or place ends, or until a given time if there is none.

    Attributes:
        until: Simulated time at which waiting ends, in seconds, or None for one control step.

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
"""An action with which the person stands still for one control step."""
WAIT = Wait()
"""An action that waits until the current pick or place ends, or for one control step if there is none."""


class Refusal(enum.Enum):
    """A reason why a pick or place is refused, which leaves the world unchanged (PAPER section 3.2)."""

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
    """The result of a `Pick` or `Place`, which is reported in its first control step.

    Attributes:
        action: The requested action.
        refusal: Reason why the action was refused, or None if the motion has started.
        object: Instance name of the affected object, if any.
        receptacle: Key of the affected receptacle, if any.
    """

    action: Pick | Place
    refusal: Refusal | None = None
    object: str | None = None
    receptacle: str | None = None

    @property
    def applied(self) -> bool:
        """True if the action was executed."""
        return self.refusal is None


class EventKind(enum.Enum):
    """A type of physical event. The types are described in docs/metrics.md."""

    PICKED = "picked"
    PICK_FAILED = "pick_failed"
    PLACED = "placed"
    PLACE_FAILED = "place_failed"
    GRIP_LOST = "grip_lost"
    DISLODGED = "dislodged"
    EJECTED = "ejected"
    TUNNELLED = "tunnelled"


class Stop(enum.Enum):
    """A reason why an action with several control steps stopped."""

    DONE = "done"  # the action is complete
    ARRIVED = "arrived"  # the walk is complete, and `FollowPath.then` follows in the next step
    BLOCKED = "blocked"  # the walk does not make progress
    CHANGED = "changed"  # the person has left the path, or an object has moved
    EVENT = "event"  # a `WorldEvent` occurred
    DUE = "due"  # the requested time or the maximum number of control steps is reached


@dataclass(frozen=True)
class WorldEvent:
    """A physical event, such as a picked or dropped object."""

    time: float  # simulated time of the event, in seconds
    kind: EventKind
    object: str  # instance name of the object
    receptacle: str | None = None  # key of the receptacle, if any
