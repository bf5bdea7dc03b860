"""What all tiers of fidelity have in common."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.values.actions import IDLE, ActionResult, EventKind, Move, Pick, Place, StepAction, WorldEvent
from mjsim.values.errors import PhysicsError, StateError
from mjsim.values.inventory import Inventory
from mjsim.values.observation import ObjectStatus, Observation, Steps, StepStates
from mjsim.world.health.monitor import HealthSample, HealthState
from mjsim.world.state import PersonState, StateDetails
from mjsim.world.walking.path_following import (
    ARRIVED,
    BLOCKED,
    CHANGED,
    WALKING,
    Walk,
    plain,
    step_from_python,
)

Floats = NDArray[np.float64]


class EpisodeState:
    """Bookkeeping of one running world: hands, status of each object, and events of the present control step."""

    def __init__(self, scene: Scene, capacity: int) -> None:
        self._capacity = capacity
        self._index, self._targets = scene.index, scene.episode.targets
        self._eye_height = scene.person.eye_height
        self.held: list[int | None] = [None, None]
        self.reset()

    def reset(self) -> None:
        """Empty hands, nothing put away."""
        self._set(Inventory(capacity=self._capacity))
        self.status = [ObjectStatus.LOOSE] * len(self._index.names)
        self.events: list[WorldEvent] = []

    def report(self, time: float, kind: EventKind, item: int, receptacle: str | None = None) -> None:
        """Record an event of object `item`."""
        self.events.append(WorldEvent(time, kind, self._index.names[item], receptacle))

    def picked(self, time: float, hand: int, item: int, success: bool) -> None:
        """A pick has ended."""
        if success:
            self._set(self.inventory.take(hand, self._index.names[item]))
            self.status[item] = ObjectStatus.CARRIED
        self.report(time, EventKind.PICKED if success else EventKind.PICK_FAILED, item)

    def placed(self, time: float, item: int, receptacle: str | None, success: bool) -> None:
        """A place has ended."""
        self._let_go(item)
        self.status[item] = ObjectStatus.DELIVERED if success else ObjectStatus.LOOSE
        self.report(time, EventKind.PLACED if success else EventKind.PLACE_FAILED, item, receptacle)

    def lost(self, time: float, item: int) -> None:
        """An object has slipped out of a hand."""
        self._let_go(item)
        self.status[item] = ObjectStatus.LOOSE
        self.report(time, EventKind.GRIP_LOST, item)

    def dislodged(self, time: float, item: int) -> None:
        """A delivered object has left its receptacle."""
        self.status[item] = ObjectStatus.LOOSE
        self.report(time, EventKind.DISLODGED, item, self._targets[self._index.names[item]])

    def observation(
        self, time: float, person: Floats, velocity: Floats, objects: tuple[Floats, Floats], *, busy: bool
    ) -> Observation:
        """The present state.

        `person` is x, y, yaw and pitch of the head, m and rad, (4,); `velocity` that in the house frame, m/s, (2,);
        `objects` are origins, m, (n, 3), and orientations wxyz, (n, 4).
        """
        x, y, heading, pitch = person.tolist()
        return Observation(
            time=time,
            position=np.array([x, y]),
            heading=heading,
            pitch=pitch,
            eye=np.array(avatar.eye_position(x, y, heading, pitch, self._eye_height)),
            velocity=velocity.copy(),
            object_names=self._index.names,
            object_positions=objects[0],
            object_quaternions=objects[1],
            object_status=tuple(self.status),
            hands=self.inventory.hands,
            busy=busy,
        )

    def details(self, health: HealthState, person: PersonState | None = None) -> StateDetails:
        """Hands and statuses as part of a world's state."""
        return StateDetails(self.inventory.hands, tuple(self.status), health, person)

    def restore(self, details: StateDetails) -> None:
        """Continue from hands and statuses of a world's state; `StateError` where it is of other objects."""
        if len(details.status) != len(self._index.names) or not {*details.hands} <= {
            None,
            *self._index.names,
        }:
            raise StateError(
                f"a state of {len(details.status)} objects with {details.hands} in the hands does not fit a world of "
                f"{len(self._index.names)} objects; take it from a world of the same episode"
            )
        self._set(Inventory(*details.hands, self._capacity))
        self.status = list(details.status)
        self.events = []

    def _let_go(self, item: int) -> None:
        name = self._index.names[item]
        if name in self.inventory.carried:
            self._set(self.inventory.release(name))

    def _set(self, inventory: Inventory) -> None:
        self.inventory = inventory
        position = self._index.position_of
        self.held[:] = [None if name is None else position(name) for name in inventory.hands]


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
            return Steps(rows, StepStates.of(seen[1 : len(moves)], hashes, health))

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
