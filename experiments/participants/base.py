"""What a simulated participant perceives and how it answers."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np
from numpy.typing import NDArray

from hud.state import HudState
from mjsim.actions import Action, ActionResult, Move, Pick, Place
from mjsim.episode import CAPACITY
from mjsim.errors import ActionError
from mjsim.observation import ObjectStatus, Observation
from mjsim.person_parameters import PersonParameters
from planner.plan import Visit

if TYPE_CHECKING:  # options of commands name participants, and must not load the simulator
    from experiments.house import House
    from mjsim.model.receptacles import ReceptacleGeometry

Point = NDArray[np.float64]

TIME_TOLERANCE = 1e-6  # s; times are sums of many steps, and no decision may depend on their rounding

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


@dataclass(frozen=True, eq=False)
class WalkAlong:
    """Walk along a path, sidestep objects on the way, face the goal at its end, and pick or place there.

    The session walks. In the fidelity `full`, and while somebody films, it asks the participant again after every
    control step, else at the end of the walk. So as long as nothing happens, the answer must stay the same. On a shown
    path it is not asked in `full` either, unless somebody films, until something happens or an object has moved.

    Attributes:
        path: Floor points, m, shape (k, 2), k >= 1.
        goal: What is walked to, m, shape (2,): an object or a receptacle may lie beside the path's end.
        stop_distance: How near to the goal the walk ends, m; it also ends with the path.
        then: What to do there, once the person faces the goal; None to do nothing and face nothing.
        until: Simulated time at which the participant wants to be asked again, s; None for the end of the walk.
        shown: Whether the path is shown by the HUD, which cuts off what lies behind the person.
        tolerance: How far the person may leave the path before the participant is asked again, m.

    Raises:
        ActionError: The path has another shape.
    """

    path: NDArray[np.float64]
    goal: Point
    stop_distance: float
    then: Pick | Place | None = None
    until: float | None = None
    shown: bool = False
    tolerance: float = 0.4

    def __post_init__(self) -> None:
        _check_rows("the path of a walk", self.path, 2)


@dataclass(frozen=True, eq=False)
class Moves:
    """Make these moves, one per control step, unless something happens.

    Attributes:
        rows: Forward, left (m/s), turn and look (rad/s), shape (n, 4), n >= 1.

    Raises:
        ActionError: The rows have another shape.
    """

    rows: NDArray[np.float64]

    def __post_init__(self) -> None:
        _check_rows("moves", self.rows, 4)


def _check_rows(what: str, rows: NDArray[np.float64], width: int) -> None:
    shape = np.shape(rows)
    if len(shape) != 2 or shape[1] != width or shape[0] < 1:
        raise ActionError(f"{what} must be an array of shape (n, {width}) with n >= 1, got shape {shape}")


class Wait:
    """Do nothing until the pick or place under way is over; for one control step if none is."""


WAIT: Final = Wait()
Decision = Action | WalkAlong | Moves | Wait
DECISIONS = (Move, Pick, Place, WalkAlong, Moves, Wait)


class Participant(Protocol):
    """A user of the assistance: sees a percept, answers with a decision.

    Attributes:
        needs: Roles of the world-locked markers it cannot do without (`breadcrumb`, `flagpole`); a session in a
            condition that shows none of them is refused at the start. May be left out where there are none.
    """

    needs: frozenset[str]

    def act(self, percept: Percept) -> Decision:
        """Choose what to do next: an action for the next control step, a walk, or to wait."""
        ...


class ParticipantFactory(Protocol):
    """Makes a participant for one session; the generator is its only source of chance."""

    def __call__(self, house: "House", rng: np.random.Generator) -> Participant:
        """Make a fresh participant that knows `house` from the familiarisation."""
        ...
