"""What a simulated participant perceives and how it answers."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from hud.state import HudState
from mjsim.actions import Action, ActionResult
from mjsim.fidelity.kinematics import LocomotionState

Point = NDArray[np.float64]

NEARBY = 1.3  # m


@dataclass(frozen=True)
class Guidance:
    """The step that the HUD shows now: what to do, with which object, along which breadcrumbs.

    Attributes:
        kind: `pick` or `place`.
        object: Instance name.
        path: Floor points of the segment still ahead, m, shape (k, 2).
        goal: Where the object or the receptacle is, m, shape (2,).
        way: The segment as it was shown first, m, shape (k, 2): `path` is what is left of it.
    """

    kind: str
    object: str
    path: NDArray[np.float64]
    goal: Point
    way: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Choice:
    """A visit that is possible next, and what it costs compared with the best one.

    Attributes:
        kind: `pick` or `place`.
        object: Instance name.
        goal: Where the object or the receptacle is, m, shape (2,).
        regret: By how much it makes the rest of the task longer, m, as of the last visit.
        capped: Whether `regret` is only a lower bound.
        find_exact: Gives the exact regret, m, or None where nothing is proven; takes some 0.1 s.
    """

    kind: str
    object: str
    goal: Point
    regret: float
    capped: bool
    find_exact: Callable[[], float | None]


@dataclass(frozen=True, eq=False)
class Things:
    """What lies about in the house, near or far.

    Attributes:
        names: Instance names.
        positions: m, shape (n, 3).
        minded: Whether a walker minds it: it lies on the floor and is neither carried nor in its bin; shape (n,).
    """

    names: tuple[str, ...]
    positions: NDArray[np.float64]
    minded: NDArray[np.bool_]

    def index(self, name: str) -> int:
        """Number of an object; -1 if there is none of that name."""
        return self.names.index(name) if name in self.names else -1


NO_THINGS = Things((), np.zeros((0, 3)), np.zeros(0, np.bool_))


@dataclass(frozen=True)
class Percept:
    """Everything a person can know at one control step. What takes work to find out is found out when it is asked.

    Attributes:
        time: Simulated time, s.
        position: Own floor position, m, shape (2,).
        heading: Own heading, rad.
        hands: Object in the left and in the right hand.
        busy: Whether a reach is under way.
        targets: Object instance name -> receptacle key, from the lists in the HUD.
        answer: The world's answer to the previous action, if that was a pick or place.
        things: What the feet feel their way around; nobody knows more of it than `nearby`.
        hud: What the glasses show; composed only when asked.
        look: Misplaced objects in view at this moment -> their floor position, m; computed only when asked.
        find_guidance: Gives `guidance`.
        find_flagpoles: Gives `flagpoles`.
        find_choices: Gives `choices`.
    """

    time: float
    position: Point
    heading: float
    hands: tuple[str | None, str | None]
    busy: bool
    targets: Mapping[str, str]
    answer: ActionResult | None
    things: Things
    hud: Callable[[], HudState]
    look: Callable[[], Mapping[str, Point]]
    find_guidance: Callable[[], Guidance | None]
    find_flagpoles: Callable[[], Mapping[str, Point]]
    find_choices: Callable[[], Sequence[Choice]] = tuple

    @cached_property
    def guidance(self) -> Guidance | None:
        """The step shown by the HUD, in conditions that show the way; None when all is done."""
        return self.find_guidance()

    @cached_property
    def flagpoles(self) -> Mapping[str, Point]:
        """Object instance name -> floor position of the flagpole over it, m; empty in conditions without."""
        return self.find_flagpoles()

    @cached_property
    def choices(self) -> Sequence[Choice]:
        """All visits that are possible next with their regrets, the best first: for models of people, who know less.

        Empty when all is done, and beside a person until the regrets are known.
        """
        return self.find_choices()

    @cached_property
    def nearby(self) -> Mapping[str, Point]:
        """Misplaced objects within `NEARBY` -> floor position, m: nobody has to look to know what is at the feet."""
        floor = self.things.positions[:, :2]
        near = (np.linalg.norm(floor - self.position, axis=1) < NEARBY) & self.things.minded
        return {self.things.names[i]: floor[i] for i in np.flatnonzero(near)}

    @property
    def carried(self) -> tuple[str, ...]:
        """Instance names in the hands."""
        return tuple(name for name in self.hands if name is not None)


class Participant(Protocol):
    """A user of the assistance: sees a percept, answers with an action, once per control step.

    Attributes:
        needs: Roles of the world-locked markers it cannot do without (`goal`, `flagpole`); a session in a condition
            that shows none of them is refused at the start.
    """

    needs: frozenset[str]

    def act(self, percept: Percept) -> Action:
        """Choose what to do during the next control step."""
        ...


@dataclass(frozen=True, eq=False)
class Outlook:
    """What a walk depends on as long as nothing happens; not for deciding, only for foreseeing one's own steps.

    Attributes:
        locomotion: What moves the person.
        limit: How many control steps to foresee at most.
        stray: How far from the way that is shown another one is shown, m.
    """

    locomotion: LocomotionState
    limit: int
    stray: float


@runtime_checkable
class Foreseeing(Participant, Protocol):
    """A participant that can say what it will do, where the walk follows from the walker alone.

    Foreseeing is a matter of speed: a run in which nothing is foreseen is the same.
    """

    def foresee(self, percept: Percept, outlook: Outlook) -> NDArray[np.float64]:
        """Moves of the next control steps if nothing happens: forward, left (m/s), turn, look (rad/s), shape (n, 4).

        With n = 0 it is asked to `act`.
        """
        ...

    def went(self, steps: int) -> None:
        """So many of the moves foreseen last were made."""
        ...

    def waits(self) -> bool:
        """Whether it will do nothing until the pick or place under way is over."""
        ...


class ParticipantFactory(Protocol):
    """Makes a participant for one session; the generator is its only source of chance."""

    def __call__(self, house: KnownHouse, rng: np.random.Generator) -> Participant:
        """Make a fresh participant that knows `house` from the familiarisation."""
        ...
