"""The interface of participants, their percepts, and helper functions for them."""

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from hud.state import HudState
from mjsim.values.actions import Action, ActionResult, Move
from mjsim.values.episode import CAPACITY
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PersonParameters
from planner.errors import PlannerError
from planner.plan import Visit

if TYPE_CHECKING:  # the command line imports this module and must not load the simulator
    from experiments.house import House
    from mjsim.house.compiled.sites import ReceptacleGeometry

Point = NDArray[np.float64]
"""Floor position in metres, shape (2,)."""

NEARBY = 1.3  # distance within which an object is noticed without looking at it, in metres
DEFAULT_PERSON = PersonParameters()
FAR = 1e6  # distance in metres that is used if there is no path
TURNING = 0.8  # turning speed while looking around, relative to the person's maximum speed
LOOK_GAIN = 4.0  # ratio of the pitch rate to the pitch while the gaze is being levelled, in 1/s
FULL_TURN = 2.0 * math.pi


@dataclass(frozen=True, eq=False)
class Guidance:
    """The step that the HUD currently shows.

    Attributes:
        visit: Visit in which an object is picked up or placed.
        path: Floor points of the path that the breadcrumbs mark, in metres, shape (k, 2).
        goal: Position of the object or the receptacle, in metres, shape (2,).
        tolerance: Distance from the path beyond which a new path is shown, in metres.
    """

    visit: Visit
    path: NDArray[np.float64]
    goal: Point
    tolerance: float


@dataclass(frozen=True, eq=False)
class Choice:
    """A possible next visit and its regret.

    Attributes:
        visit: Visit in which an object is picked up or placed.
        goal: Position of the object or the receptacle, in metres, shape (2,).
        regret: Extra length of the remaining tour in metres. It is computed after the previous visit.
        capped: True if `regret` is only a lower bound.
        find_exact: Function that returns the exact regret in metres or None. It takes about 0.1 s.
    """

    visit: Visit
    goal: Point
    regret: float
    capped: bool
    find_exact: Callable[[], float | None]


class Percept:
    """The information that a participant receives at one control step.

    This base class contains neither the objects in view nor the HUD. Sessions use a subclass that adds both.

    Attributes:
        time: Simulated time in seconds.
        position: Floor position in metres, shape (2,).
        heading: Heading in radians.
        pitch: Elevation of the gaze, in radians, positive upwards.
        hands: Objects in the left and the right hand.
        hands_full: True if no other object can be carried.
        busy: True if a pick or place is in progress.
        targets: Key of each object's receptacle, by object name. The HUD lists all objects and receptacles.
        answer: Result of the previous action if that action was a pick or place, otherwise None.
        blocked: True if the person makes no progress. It stays True until the person steps back.
        person: Parameters of the participant's body.
    """

    def __init__(
        self,
        seen: Observation,
        targets: Mapping[str, str],
        answer: ActionResult | None = None,
        *,
        blocked: bool = False,
        capacity: int = CAPACITY,
        person: PersonParameters = DEFAULT_PERSON,
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
        """Names of the objects in the person's hands."""
        return self._seen.carried

    @cached_property
    def nearby(self) -> Mapping[str, Point]:
        """Floor positions of misplaced objects within 1.3 m of the person, in metres, by object name."""
        loose = positions_of(self._seen, self._seen.names_with(ObjectStatus.LOOSE))
        return {n: p for n, p in loose.items() if math.dist(p, self.position) < NEARBY}

    def look(self) -> Mapping[str, Point]:
        """Return the floor positions of the misplaced objects in view, in metres, by object name."""
        return {}

    def look_for(self, receptacles: Mapping[str, "ReceptacleGeometry"]) -> frozenset[str]:  # noqa: ARG002 - overridden
        """Return the keys of those receptacles that are in view."""
        return frozenset()

    @property
    def visible_shares(self) -> Mapping[str, float]:
        """Visible fraction (0 to 1) of each misplaced object in view, by object name."""
        return {}

    def hud(self) -> HudState | None:
        """Return the HUD state, or None if there is no HUD."""
        return None

    @property
    def shown_roles(self) -> frozenset[str]:
        """Roles of the markers that the HUD shows in this condition."""
        return frozenset()

    @property
    def guidance(self) -> Guidance | None:
        """The step that the HUD shows, or None if the condition shows no path or the task is finished."""
        return None

    @property
    def flagpoles(self) -> Mapping[str, Point]:
        """Floor positions of the flagpoles in view, in metres, by object. They are visible through walls."""
        return {}

    @property
    def choices(self) -> Sequence[Choice]:
        """All possible next visits with their regrets, starting with the best visit.

        The choices are never shown to participants. They are intended for models of compliance. The sequence
        is empty if the task is finished and, in live planning, until the regrets have been computed.
        """
        return ()


def positions_of(seen: Observation, names: Iterable[str]) -> dict[str, Point]:
    """Return the floor positions of objects in metres, by object name."""
    return {name: seen.object_positions[seen.object_names.index(name), :2] for name in names}


class Participant(Protocol):
    """The interface of participants, who receive a percept and return an action at each decision.

    Attributes:
        needs: Roles of the markers that the participant requires (`breadcrumb`, `flagpole`). Sessions whose condition
            does not show them are rejected. The attribute is optional.
    """

    needs: frozenset[str]

    def act(self, percept: Percept) -> Action:
        """Choose the next action.

        Walking along a path or waiting takes many control steps. In a filmed session, however, `act` is
        called after each control step. It must therefore return the same action until something happens.
        """
        ...


class ParticipantFactory(Protocol):
    """A function that creates a participant for one session. All random numbers must come from `rng`."""

    def __call__(self, house: "House", rng: np.random.Generator) -> Participant:
        """Create a participant who has been familiarized with the house."""
        ...


def estimated_distance(house: "House", start: Point, goal: Point) -> float:
    """Return the walking distance between two points in metres, or `FAR` if there is no path."""
    try:
        return house.geodesics.shortest_path(start, goal).geodesic_distance
    except PlannerError:
        return FAR


def estimated_distances(house: "House", start: Point, goals: Sequence[Point]) -> list[float]:
    """Return the walking distances in metres from a point to several goals, or `FAR` if there is no path."""
    try:
        return [float(gap) for gap in house.geodesics.distances_between([start], goals)[0]]
    except PlannerError:  # at least one goal is unreachable
        return [estimated_distance(house, start, goal) for goal in goals]


class FullTurn:
    """A full turn on the spot, starting at the given heading in radians.

    If `level` is set, the gaze becomes horizontal during the turn. Otherwise, the pitch does not change.
    """

    def __init__(self, heading: float, *, level: bool = False) -> None:
        self._turned, self._heading, self._level = 0.0, heading, level

    def act(self, percept: Percept) -> Action | None:
        """Return the next action, or None if the turn is complete."""
        step = (percept.heading - self._heading + math.pi) % FULL_TURN - math.pi
        self._turned, self._heading = self._turned + step, percept.heading
        if self._turned >= FULL_TURN:
            return None
        look, fastest = -LOOK_GAIN * percept.pitch, percept.person.looking_speed
        return Move(
            turn=TURNING * percept.person.turning_speed,
            look=min(max(look, -fastest), fastest) if self._level else 0.0,
        )
