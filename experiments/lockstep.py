"""What a session asks of the world, and driving one session or many side by side."""

from collections.abc import Generator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Action
from mjsim.errors import PhysicsError
from mjsim.stretch import Stretch
from mjsim.world import StepResult, World


@dataclass(frozen=True, eq=False)
class Walk:
    """Walk many control steps: forward, left (m/s), turn, look (rad/s), shape (n, 4)."""

    moves: NDArray[np.float64]


@dataclass(frozen=True)
class Finish:
    """Idle until the pick or place under way is over."""


Request = Action | Walk | Finish
# A session: yields what the world is to do, takes what came of it, returns why it ended.
Play = Generator[Request, StepResult | Stretch, str]


def perform(world: World, request: Request) -> StepResult | Stretch:
    """Do what a session asks.

    Raises:
        PhysicsError: The physics failed.
    """
    if isinstance(request, Walk):
        return world.walk(request.moves)
    if isinstance(request, Finish):
        return world.finish()
    return world.step(request)


def drive(play: Play, world: World) -> str:
    """Run a session in its world; returns why it ended.

    Raises:
        PhysicsError: The physics failed.
    """
    try:
        request = next(play)
        while True:
            try:
                outcome = perform(world, request)
            except (PhysicsError, KeyboardInterrupt) as error:
                request = play.throw(error)
            else:
                request = play.send(outcome)
    except StopIteration as over:
        return str(over.value)
