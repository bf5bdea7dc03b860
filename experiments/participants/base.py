"""What a simulated participant perceives and how it answers."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from experiments.known_house import KnownHouse
from hud.state import HudState
from mjsim.actions import Action, ActionResult

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
    """

    kind: str
    object: str
    path: NDArray[np.float64]
    goal: Point


@dataclass(frozen=True)
class Percept:
    """Everything a person can know at one control step.

    Attributes:
        time: Simulated time, s.
        position: Own floor position, m, shape (2,).
        heading: Own heading, rad.
        hands: Object in the left and in the right hand.
        busy: Whether a reach is under way.
        hud: What the glasses show; composed only when asked.
        guidance: The step shown by the HUD, in conditions that show the way; None when all is done.
        flagpoles: Object instance name -> floor position of the flagpole over it, m; empty in conditions without.
        targets: Object instance name -> receptacle key, from the lists in the HUD.
        answer: The world's answer to the previous action, if that was a pick or place.
        nearby: Misplaced objects within `NEARBY` -> floor position, m: nobody has to look to know what is at the feet.
        look: Misplaced objects in view at this moment -> their floor position, m; computed only when asked.
    """

    time: float
    position: Point
    heading: float
    hands: tuple[str | None, str | None]
    busy: bool
    hud: Callable[[], HudState]
    guidance: Guidance | None
    flagpoles: Mapping[str, Point]
    targets: Mapping[str, str]
    answer: ActionResult | None
    nearby: Mapping[str, Point]
    look: Callable[[], Mapping[str, Point]]

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


class ParticipantFactory(Protocol):
    """Makes a participant for one session; the generator is its only source of chance."""

    def __call__(self, house: KnownHouse, rng: np.random.Generator) -> Participant:
        """Make a fresh participant that knows `house` from the familiarisation."""
        ...
