"""Many control steps as one value."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import WorldEvent
from mjsim.observation import Observation

_HEALTH = 7  # numbers of a `HealthSample`


class RolloutArrays(NamedTuple):
    """The states that n control steps went through, for kernels to fill row by row.

    Row i is the state after step i, as `World.step` observes it.

    Attributes:
        times: Simulated time, s, shape (n,).
        positions: The person's floor positions, m, shape (n, 2).
        headings: Yaw of the body, rad, shape (n,).
        pitches: Pitch of the head, rad, shape (n,).
        object_positions: Object origins, m, shape (n, k, 3).
        object_quaternions: Orientations wxyz, shape (n, k, 4).
        state_hashes: `World.state_hash` after each step, shape (n,).
        health: Rows of `HealthSample` after each step, shape (n, 7).
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    headings: NDArray[np.float64]
    pitches: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_quaternions: NDArray[np.float64]
    state_hashes: NDArray[np.uint64]
    health: NDArray[np.float64]

    @classmethod
    def empty(cls, steps: int, objects: int) -> "RolloutArrays":
        """Arrays for `steps` control steps, not yet filled."""
        return cls(
            times=np.empty(steps),
            positions=np.empty((steps, 2)),
            headings=np.empty(steps),
            pitches=np.empty(steps),
            object_positions=np.empty((steps, objects, 3)),
            object_quaternions=np.empty((steps, objects, 4)),
            state_hashes=np.empty(steps, np.uint64),
            health=np.empty((steps, _HEALTH)),
        )


@dataclass(frozen=True, eq=False)
class Rollout:
    """What n control steps brought.

    Attributes:
        states: The state after every step.
        observation: State after the last step.
        events: What happened; only the last step can have events.
    """

    states: RolloutArrays
    observation: Observation
    events: tuple[WorldEvent, ...]

    def __len__(self) -> int:
        return len(self.states.times)

    @classmethod
    def of_steps(
        cls,
        observations: Sequence[Observation],
        state_hashes: Sequence[int],
        health: Sequence[tuple[float, ...]],
        last: Observation,
        events: tuple[WorldEvent, ...],
    ) -> "Rollout":
        """The rollout of single steps; `last` is the present state, also where there are no steps."""
        arrays = RolloutArrays.empty(len(observations), len(last.object_names))
        arrays.state_hashes[:] = state_hashes
        for step, o in enumerate(observations):
            arrays.times[step], arrays.positions[step] = o.time, o.position
            arrays.headings[step], arrays.pitches[step] = o.heading, o.pitch
            arrays.object_positions[step] = o.object_positions
            arrays.object_quaternions[step] = o.object_quaternions
            arrays.health[step] = health[step]
        return cls(arrays, last, events)

    def followed_by(self, later: "Rollout") -> "Rollout":
        """This rollout and the one that continues it, as one."""
        joined = (np.concatenate(pair) for pair in zip(self.states, later.states, strict=True))
        return dataclasses.replace(later, states=RolloutArrays(*joined))
