"""The base class of the levels of fidelity, and the episode state that they share."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import cast

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.values.actions import IDLE, ActionResult, EventKind, Move, Pick, Place, StepAction, WorldEvent
from mjsim.values.errors import PhysicsError, StateError
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
    """The contents of the hands, the status of each object, and the events of the current control step."""

    def __init__(self, scene: Scene) -> None:
        self._index, self._targets = scene.index, scene.episode.targets
        self._eye_height = scene.person.eye_height
        self.held: list[int | None] = [None, None]  # index of the object in each hand, or None
        self.reset()

    def reset(self) -> None:
        self.held[:] = None, None
        self.status = [ObjectStatus.LOOSE] * len(self._index.names)
        self.events: list[WorldEvent] = []

    def report(self, time: float, kind: EventKind, item: int, receptacle: str | None = None) -> None:
        self.events.append(WorldEvent(time, kind, self._index.names[item], receptacle))

    def picked(self, time: float, hand: int, item: int, success: bool) -> None:
        if success:
            self.held[hand] = item
            self.status[item] = ObjectStatus.CARRIED
        self.report(time, EventKind.PICKED if success else EventKind.PICK_FAILED, item)

    def placed(self, time: float, item: int, receptacle: str | None, success: bool) -> None:
        self._release(item)
        self.status[item] = ObjectStatus.DELIVERED if success else ObjectStatus.LOOSE
        self.report(time, EventKind.PLACED if success else EventKind.PLACE_FAILED, item, receptacle)

    def lost(self, time: float, item: int) -> None:
        self._release(item)
        self.status[item] = ObjectStatus.LOOSE
        self.report(time, EventKind.GRIP_LOST, item)

    def dislodged(self, time: float, item: int) -> None:
        self.status[item] = ObjectStatus.LOOSE
        self.report(time, EventKind.DISLODGED, item, self._targets[self._index.names[item]])

    def observation(
        self, time: float, person: Floats, velocity: Floats, objects: tuple[Floats, Floats], *, busy: bool
    ) -> Observation:
        """Create an observation of the current state.

        `person` (4,) contains x, y, yaw and the pitch of the head. `velocity` (2,) is in the house frame.
        `objects` are positions (n, 3) and orientations wxyz (n, 4). Lengths are in metres, angles in radians.
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
            hands=self._hands,
            busy=busy,
        )

    def details(self, health: HealthState, person: PersonState | None = None) -> StateDetails:
        return StateDetails(self._hands, tuple(self.status), health, person)

    def restore(self, details: StateDetails) -> None:
        """Set the hands and statuses to those of a state. Raise a StateError if its objects differ."""
        names = self._index.names
        carried = [name for name in details.hands if name is not None]
        if len(details.status) != len(names) or len(carried) != len(set(carried) & set(names)):
            raise StateError(
                f"a state of {len(details.status)} objects with {details.hands} in the hands does not fit a world of "
                f"{len(names)} objects; take it from a world of the same episode"
            )
        self.held[:] = [None if name is None else names.index(name) for name in details.hands]
        self.status = list(details.status)
        self.events = []

    def _release(self, item: int) -> None:
        if item in self.held:
            self.held[self.held.index(item)] = None

    @property
    def _hands(self) -> tuple[str | None, str | None]:
        left, right = (None if item is None else self._index.names[item] for item in self.held)
        return left, right


class Tier(ABC):
    """A simulation of the person and the objects. Each level of fidelity has its own subclass."""

    episode_state: EpisodeState

    @property
    @abstractmethod
    def busy(self) -> bool:
        """True while a pick or place is in progress."""

    @property
    @abstractmethod
    def body(self) -> NDArray[np.float64]:
        """A copy of the body state, shape (BODY_SIZE,), with the layout of `mjsim.world.body.rig`."""

    @property
    @abstractmethod
    def hands(self) -> NDArray[np.float64]:
        """A copy of the positions of the left and right hand in the body frame, in metres, shape (2, 3)."""

    @property
    @abstractmethod
    def health_sample(self) -> HealthSample:
        """The physics problems in the latest control step."""

    @abstractmethod
    def step(self, action: StepAction) -> ActionResult | None:
        """Advance by one control step, and store its events in `episode_state`."""

    @abstractmethod
    def answer(self, action: Pick | Place) -> ActionResult:
        """Return the result that `step` would return for a pick or place, without executing the action."""

    @abstractmethod
    def observation(self) -> Observation:
        """Return an observation of the current state."""

    @abstractmethod
    def state_hash(self) -> int:
        """Return a 64-bit hash of the physics state."""

    def follow(self, walk: Walk, progress: NDArray[np.float64], limit: int) -> tuple[int, Steps | None]:
        """Walk along a path for up to `limit` control steps, until an event occurs or the walk has to stop.

        If no display shows the path, each call takes only one step, because the person may see other objects
        on the way. Updates `progress` (2,) of a `Walker`. Returns the latest phase of the walk and the steps,
        which are None if the person has already arrived.
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
        """Wait until the current motion ends or an event occurs. Without a motion, wait one control step."""
        busy = self.busy
        steps = self._step_each(lambda _: IDLE if self.busy or not busy else None, limit if busy else 1)
        return cast(Steps, steps)

    def _step_each(self, choose: Callable[[Observation], Move | None], limit: int) -> Steps | None:
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
