"""Hands, statuses and events of an episode, in whatever tier it runs."""

import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.values.actions import EventKind, WorldEvent
from mjsim.values.errors import StateError
from mjsim.values.inventory import Inventory
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.world.health.monitor import HealthState
from mjsim.world.state import PersonState, StateDetails

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
