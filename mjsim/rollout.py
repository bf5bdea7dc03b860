"""Many control steps as one value."""

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import WorldEvent
from mjsim.observation import Observation

_LAST = ("observation", "events")  # of a stretch's last step alone


@dataclass(frozen=True, eq=False)
class Rollout:
    """What n control steps brought; row i is the state after step i, as single steps would have observed it.

    Attributes:
        times: Simulated time, s, shape (n,).
        positions: The person's floor positions, m, shape (n, 2).
        headings: Yaw of the body, rad, shape (n,).
        pitches: Pitch of the head, rad, shape (n,).
        object_positions: Object origins, m, shape (n, k, 3).
        object_quaternions: Orientations wxyz, shape (n, k, 4).
        state_hashes: `World.state_hash` after each step, shape (n,).
        health: Rows of `HealthSample` after each step, shape (n, 7).
        observation: State after the last step.
        events: What happened; only the last step can have events.
    """

    times: NDArray[np.float64]
    positions: NDArray[np.float64]
    headings: NDArray[np.float64]
    pitches: NDArray[np.float64]
    object_positions: NDArray[np.float64]
    object_quaternions: NDArray[np.float64]
    state_hashes: NDArray[np.uint64]
    health: NDArray[np.float64]
    observation: Observation
    events: tuple[WorldEvent, ...]

    def __len__(self) -> int:
        return len(self.headings)

    def then(self, later: "Rollout") -> "Rollout":
        """This stretch and the one that follows it, as one."""
        arrays = {f.name: getattr(self, f.name) for f in dataclasses.fields(self) if f.name not in _LAST}
        joined = {name: np.concatenate((rows, getattr(later, name))) for name, rows in arrays.items()}
        return Rollout(**joined, observation=later.observation, events=later.events)

    @classmethod
    def of(
        cls,
        observations: list[Observation],
        state_hashes: list[int],
        last: Observation,
        events: tuple[WorldEvent, ...],
        health: list[tuple[float, ...]],
    ) -> "Rollout":
        """Stack the observations after each step; `last` stands for them where there are none."""
        count, objects = len(observations), len(last.object_names)
        return cls(
            times=np.array([o.time for o in observations]),
            positions=np.array([o.position for o in observations]).reshape(count, 2),
            headings=np.array([o.heading for o in observations]),
            pitches=np.array([o.pitch for o in observations]),
            object_positions=np.array([o.object_positions for o in observations]).reshape(count, objects, 3),
            object_quaternions=np.array([o.object_quaternions for o in observations]).reshape(
                count, objects, 4
            ),
            state_hashes=np.array(state_hashes, np.uint64),
            health=np.array(health, np.float64).reshape(count, 7),
            observation=last,
            events=events,
        )
