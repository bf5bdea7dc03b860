"""What a simulated participant perceives and how it answers."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from hud.state import HudState
from mjsim.values.actions import Action, ActionResult
from mjsim.values.episode import CAPACITY
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PersonParameters
from planner.plan import Visit

if TYPE_CHECKING:  # options of commands name participants, and must not load the simulator
    from experiments.house import House
    from mjsim.house.compiled.sites import ReceptacleGeometry

Point = NDArray[np.float64]
"""Position on the floor, m, shape (2,)."""

NEARBY = 1.3  # m
USUAL_PERSON = PersonParameters()


@dataclass(frozen=True, eq=False)
class Guidance:
    """The step that the HUD shows now: what to do, with which object, along which breadcrumbs.

    Attributes:
        visit: What to do.
        path: Floor points of the path that the breadcrumbs mark, m, shape (k, 2).
        goal: Where the object or the receptacle is, m, shape (2,).
        tolerance: How far the person may leave the path before a new one is shown, m.
    """

    visit: Visit
    path: NDArray[np.float64]
    goal: Point
    tolerance: float


@dataclass(frozen=True, eq=False)
class Choice:
    """A visit that is possible next, and what it costs compared with the best one.

    Attributes:
        visit: What could be done.
        goal: Where the object or the receptacle is, m, shape (2,).
        regret: By how much it makes the rest of the task longer, m, as of the last visit.
        capped: Whether `regret` is only a lower bound.
        find_exact: Gives the exact regret, m, or None where nothing is proven; takes some 0.1 s.
    """

    visit: Visit
    goal: Point
    regret: float
    capped: bool
    find_exact: Callable[[], float | None]


class Percept:
    """What a person can know at one control step, without any assistance.

    A session adds what is in view and what the HUD shows, which is found out when it is asked for.

    Args:
        seen: State of the world.
        targets: Object instance name -> receptacle key.
        answer: The world's answer to the previous action, if that was a pick or place.
        blocked: Whether the walk makes no progress.
        capacity: How many objects the person carries at most.
        person: The participant itself.

    Attributes:
        time: Simulated time, s.
        position: Own floor position, m, shape (2,).
        heading: Own heading, rad.
        pitch: Elevation of the own gaze, rad, positive upwards.
        hands: Object in the left and in the right hand.
        hands_full: Whether no other object can be carried.
        busy: Whether a pick or place is under way.
        targets: As above, from the lists in the HUD.
        answer: As above.
        blocked: As above; until the person has backed off.
        person: As above: own speeds, reach, eyes and times.
    """

    def __init__(
        self,
        seen: Observation,
        targets: Mapping[str, str],
        answer: ActionResult | None = None,
        *,
        blocked: bool = False,
        capacity: int = CAPACITY,
        person: PersonParameters = USUAL_PERSON,
    ) -> None:
        self._seen = seen
        self.time, self.position = seen.time, seen.position
        self.heading, self.pitch = seen.heading, seen.pitch
        self.hands, self.busy = seen.hands, seen.busy
        self.hands_full = len(seen.carried) >= capacity
        self.targets, self.answer, self.blocked = targets, answer, blocked
        self.person = person

    @property
    def carried(self) -> tuple[str, ...]:
        """Instance names in the hands."""
        return self._seen.carried

    @cached_property
    def nearby(self) -> Mapping[str, Point]:
        """Misplaced objects at the feet (within 1.3 m) -> floor position, m, shape (2,)."""
        loose = positions_of(self._seen, self._seen.names_with(ObjectStatus.LOOSE))
        return {n: p for n, p in loose.items() if math.dist(p, self.position) < NEARBY}

    def look(self) -> Mapping[str, Point]:
        """Misplaced objects in view at this moment -> floor position, m, shape (2,)."""
        return {}

    def look_for(self, receptacles: Mapping[str, "ReceptacleGeometry"]) -> frozenset[str]:  # noqa: ARG002 - for a session
        """Keys of those of the receptacles that are in view at this moment."""
        return frozenset()

    @property
    def visible_shares(self) -> Mapping[str, float]:
        """How much is seen of each object in view: the share of the rays to it that nothing blocks, 0 < share <= 1."""
        return {}

    def hud(self) -> HudState | None:
        """What the HUD shows; None without one."""
        return None

    @property
    def shown_roles(self) -> frozenset[str]:
        """Roles of the markers that the HUD shows in this condition; the person knows it from the training."""
        return frozenset()

    @property
    def guidance(self) -> Guidance | None:
        """The step shown by the HUD, in conditions that show a path; None when all is done."""
        return None

    @property
    def flagpoles(self) -> Mapping[str, Point]:
        """Flagpoles in view now, through walls too: object -> floor position, m, shape (2,)."""
        return {}

    @property
    def choices(self) -> Sequence[Choice]:
        """All visits that are possible next with their regrets, the best first: for models of compliance.

        No condition shows as much. Empty when all is done, and in live planning until the regrets are known.
        """
        return ()


def positions_of(seen: Observation, names: Iterable[str]) -> dict[str, Point]:
    """Floor positions of objects by name, m, shape (2,)."""
    return {name: seen.object_positions[seen.object_names.index(name), :2] for name in names}


class Participant(Protocol):
    """A user of the assistance: sees a percept, answers with a decision.

    Attributes:
        needs: Roles of the world-locked markers it cannot do without (`breadcrumb`, `flagpole`); a session in a
            condition that shows none of them is refused at the start. May be left out where there are none.
    """

    needs: frozenset[str]

    def act(self, percept: Percept) -> Action:
        """Choose the next action.

        A path and a wait take many control steps, unless the session is filmed; then the participant is asked after
        each. So as long as nothing happens the answer must stay the same.
        """
        ...


class ParticipantFactory(Protocol):
    """Makes a participant for one session; the generator is its only source of chance."""

    def __call__(self, house: "House", rng: np.random.Generator) -> Participant:
        """Make a fresh participant that knows `house` from the familiarisation."""
        ...
