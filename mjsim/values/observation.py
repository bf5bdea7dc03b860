"""Observations of the state of a house and its person, and records of control steps."""

import enum
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.values.actions import StepAction

_HEALTH = 7  # number of values in a `HealthSample`


class ObjectStatus(enum.Enum):
    """The status of an object: loose, carried in a hand, or delivered to its receptacle."""

    LOOSE = "loose"
    CARRIED = "carried"
    DELIVERED = "delivered"


@dataclass(frozen=True)
class Observation:
    """The poses of the person and of all objects at one point in time (PAPER section 1).

    Attributes:
        time: Simulated time since the last reset, in seconds.
        position: Position (x, y) of the body axis on the floor, in metres, shape (2,).
        heading: Yaw of the body in radians, counter-clockwise from the +x direction.
        pitch: Pitch of the head in radians, which is positive upwards.
        eye: Position of the eye camera, in metres, shape (3,).
        velocity: Horizontal velocity in the frame of the house, in m/s, shape (2,).
        object_names: Instance names of the objects, in the order of the episode.
        object_positions: Positions of the objects' origins in metres, shape (n, 3).
        object_quaternions: Orientations of the objects as wxyz quaternions, shape (n, 4).
        object_status: Status of each object.
        hands: Instance names of the objects in the left and the right hand, or None for a free hand.
        busy: True while a pick or place is in progress.
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
        """Instance names of the carried objects."""
        return tuple(name for name in self.hands if name is not None)

    def names_with(self, status: ObjectStatus) -> tuple[str, ...]:
        """Return the instance names of all objects with this status."""
        return tuple(n for n, s in zip(self.object_names, self.object_status, strict=True) if s is status)


class StepStates(NamedTuple):
    """The states after n control steps, with one row per step. Compiled kernels fill the arrays in place."""

    time: NDArray[np.float64]  # simulated time in seconds, shape (n,)
    position: NDArray[np.float64]  # position of the person on the floor, in metres, shape (n, 2)
    heading: NDArray[np.float64]  # yaw of the body, in radians, shape (n,)
    pitch: NDArray[np.float64]  # pitch of the head, in radians, shape (n,)
    object_position: NDArray[np.float64]  # positions of k objects in metres, shape (n, k, 3)
    object_quaternion: NDArray[np.float64]  # wxyz quaternions of k objects, shape (n, k, 4)
    state_hash: NDArray[np.uint64]  # `World.state_hash` after each step, shape (n,)
    health: NDArray[np.float64]  # rows of `HealthSample` after each step, shape (n, 7)

    @classmethod
    def empty(cls, steps: int, objects: int) -> "StepStates":
        return cls(
            time=np.empty(steps),
            position=np.empty((steps, 2)),
            heading=np.empty(steps),
            pitch=np.empty(steps),
            object_position=np.empty((steps, objects, 3)),
            object_quaternion=np.empty((steps, objects, 4)),
            state_hash=np.empty(steps, np.uint64),
            health=np.empty((steps, _HEALTH)),
        )

    @classmethod
    def of(
        cls, seen: Sequence[Observation], state_hashes: Sequence[int], health: Sequence[tuple[float, ...]]
    ) -> "StepStates":
        return cls(
            time=np.array([o.time for o in seen]),
            position=np.array([o.position for o in seen]),
            heading=np.array([o.heading for o in seen]),
            pitch=np.array([o.pitch for o in seen]),
            object_position=np.array([o.object_positions for o in seen]),
            object_quaternion=np.array([o.object_quaternions for o in seen]),
            state_hash=np.array(state_hashes, np.uint64),
            health=np.array(health),
        )


@dataclass(frozen=True, eq=False)
class Steps:
    """A record of one or more executed control steps."""

    # The action of a single step, or n moves (forward, left, turn, look) in m/s and rad/s, shape (n, 4).
    actions: StepAction | NDArray[np.float64]
    passed: StepStates | None = None  # the n - 1 states between the steps, or None for a single step

    def __len__(self) -> int:
        return 1 if self.passed is None else len(self.passed.time) + 1
