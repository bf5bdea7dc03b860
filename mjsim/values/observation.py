"""What the augmented-reality system observes: the whole state of the house (PAPER section 1)."""

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray


class ObjectStatus(enum.Enum):
    """Whether an object is on the floor, in a hand or in its receptacle."""

    LOOSE = "loose"
    CARRIED = "carried"
    DELIVERED = "delivered"


@dataclass(frozen=True)
class Observation:
    """Current poses of the person and of every object.

    Attributes:
        time: Simulated time since reset, s.
        position: Floor position (x, y) of the person's body axis, m, shape (2,).
        heading: Yaw of the body, rad, 0 along +x, counter-clockwise.
        pitch: Pitch of the head, rad, positive upwards.
        eye: Position of the eye camera, m, shape (3,).
        velocity: Planar velocity in the house frame, m/s, shape (2,).
        object_names: Instance names, in the episode's order.
        object_positions: Object origins, m, shape (n, 3).
        object_quaternions: Orientations wxyz, shape (n, 4).
        object_status: Status per object.
        hands: Instance name carried by the left and the right hand, or None.
        busy: Whether a pick or place motion is under way.
    """

    time: float
    position: NDArray[np.float64]
    heading: float
    pitch: float
    eye: NDArray[np.float64]
    velocity: NDArray[np.float64]
    object_names: tuple[str, ...]
    object_positions: NDArray[np.float64]
    object_quaternions: NDArray[np.float64]
    object_status: tuple[ObjectStatus, ...]
    hands: tuple[str | None, str | None]
    busy: bool

    @property
    def carried(self) -> tuple[str, ...]:
        """Instance names in the hands, left before right."""
        return tuple(name for name in self.hands if name is not None)

    def names_with(self, status: ObjectStatus) -> tuple[str, ...]:
        """Instance names of the objects that have `status`, in the episode's order."""
        return tuple(n for n, s in zip(self.object_names, self.object_status, strict=True) if s is status)
