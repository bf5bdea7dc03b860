"""What all tiers of fidelity have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from mjsim.values.actions import IDLE, ActionResult, Move, Pick, Place, StepAction
from mjsim.values.errors import PhysicsError
from mjsim.values.observation import Observation
from mjsim.values.steps import States, Steps
from mjsim.world.fidelity.episode_state import EpisodeState
from mjsim.world.health.values import HealthSample
from mjsim.world.walking.path_following import (
    ARRIVED,
    BLOCKED,
    CHANGED,
    WALKING,
    Walk,
    plain,
    step_from_python,
)


class Tier(ABC):
    """One way to advance the person and the objects by control steps."""

    episode_state: EpisodeState  # hands, statuses, and the events of the latest control step

    @property
    @abstractmethod
    def busy(self) -> bool:
        """Whether a pick or place is under way."""

    @property
    @abstractmethod
    def body(self) -> NDArray[np.float64]:
        """A copy of the body as `mjsim.world.fidelity.body_state` lays it out, shape (BODY_SIZE,)."""

    @property
    @abstractmethod
    def hands(self) -> NDArray[np.float64]:
        """Where the left and the right hand are in the body's frame, m, a copy of shape (2, 3)."""

    @property
    @abstractmethod
    def health_sample(self) -> HealthSample:
        """Health of the physics in the latest control step."""

    @abstractmethod
    def step(self, action: StepAction) -> ActionResult | None:
        """Advance by one control step; its events are in `episode_state` afterwards."""

    @abstractmethod
    def answer(self, action: Pick | Place) -> ActionResult:
        """What the answer to a pick or place would be now; nothing changes."""

    @abstractmethod
    def observation(self) -> Observation:
        """The present state."""

    @abstractmethod
    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""

    def follow(self, walk: Walk, progress: NDArray[np.float64], limit: int) -> tuple[int, Steps | None]:
        """Walk along a path for up to `limit` control steps, until a step brings events or the walk has to stop.

        Where loose objects may move, a path that no display shows is walked one step at a time: the person looks where
        it leads. `progress` is that of a `Walker`, shape (2,); updated. Returns the latest phase of the walk, and the
        steps, None where the person has arrived already.
        """
        arguments, phase, first = plain(walk), WALKING, True

        def choose(seen: Observation) -> Move | None:
            nonlocal phase, first
            if phase == BLOCKED:
                return None
            state = seen.position, seen.heading, seen.time, progress, seen.object_positions
            phase, *velocities = step_from_python(arguments, *state, first)
            first = False
            return None if phase in (ARRIVED, CHANGED) else Move(*velocities)

        steps = self._step_each(choose, limit if walk.shown else 1)
        return phase, steps

    def wait(self, limit: int) -> Steps:
        """Idle until no pick or place is under way or a step brings events; one control step if none is."""
        busy = self.busy
        steps = self._step_each(lambda _: IDLE if self.busy or not busy else None, limit if busy else 1)
        return cast(Steps, steps)

    def _step_each(self, choose: Callable[[Observation], Move | None], limit: int) -> Steps | None:
        """Up to `limit` control steps, until there is no move for the state, or a step brings events."""
        seen, moves = [self.observation()], list[Move]()
        hashes, health = list[int](), list[tuple[float, ...]]()

        def steps() -> Steps | None:
            if len(moves) <= 1:
                return Steps(moves[0]) if moves else None
            rows = np.array([(m.forward, m.left, m.turn, m.look) for m in moves])
            return Steps(rows, States.of(seen[1 : len(moves)], hashes, health))

        while len(moves) < limit and (move := choose(seen[-1])) is not None:
            if moves:
                hashes.append(self.state_hash())
                health.append(self.health_sample.row)
            moves.append(move)
            try:
                self.step(move)
            except PhysicsError as error:
                error.steps = steps()
                raise
            seen.append(self.observation())
            if self.episode_state.events:
                break
        return steps()
