"""What a person has in mind."""

import math
from dataclasses import dataclass

from experiments.participants.guest.searching import Place
from planner.plan import Visit


@dataclass(frozen=True)
class Intention:
    """What a person is about to do.

    Attributes:
        aim: A visit, or a place to look around from.
        suggested: Whether it is the suggested step.
        strays: Whether it goes its own way there: it is not on the path that is shown, or came to a halt there.
        gives_up_at: Simulated time at which the suggested step is given up, s.
    """

    aim: Visit | Place
    suggested: bool = False
    strays: bool = False
    gives_up_at: float = math.inf
