"""What a session asks of its world, and driving one session or many side by side."""

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Action
from mjsim.crew import Crew
from mjsim.errors import PhysicsError
from mjsim.rollout import Rollout
from mjsim.world import StepResult, World

T = TypeVar("T")


@dataclass(frozen=True, eq=False)
class Step:
    """One control step."""

    world: World
    action: Action

    def perform(self) -> StepResult:
        """Do it; raises `PhysicsError` as `World.step`."""
        return self.world.step(self.action)


@dataclass(frozen=True, eq=False)
class Walk:
    """Many control steps: forward, left (m/s), turn, look (rad/s), shape (n, 4)."""

    world: World
    moves: NDArray[np.float64]

    def perform(self) -> Rollout:
        """Do it; raises `PhysicsError` as `World.walk`."""
        return self.world.walk(self.moves)


@dataclass(frozen=True, eq=False)
class Finish:
    """Idle until the pick or place under way is over."""

    world: World

    def perform(self) -> Rollout:
        """Do it; raises `PhysicsError` as `World.finish`."""
        return self.world.finish()


Request = Step | Walk | Finish
Outcome = StepResult | Rollout
# Yields what a world is to do, takes what came of it, or is thrown the PhysicsError or KeyboardInterrupt that came.
Play = Generator[Request, Outcome, T]
# Does what several sessions ask, each of a world of its own.
Performer = Callable[[Sequence[Request]], Sequence[Outcome | PhysicsError]]


def drive(play: Play[T]) -> T:
    """Run a session to its end; returns and raises what it does."""
    try:
        request = next(play)
        while True:
            try:
                outcome = request.perform()
            except (PhysicsError, KeyboardInterrupt) as error:
                request = play.throw(error)
            else:
                request = play.send(outcome)
    except StopIteration as over:
        return cast(T, over.value)


def drive_many(
    plays: Iterable[tuple[str, Play[T]]],
    at_once: int,
    perform: Performer,
) -> Iterator[tuple[str, T | Exception]]:
    """Run sessions side by side: all worlds do what their sessions ask, then all sessions decide, and so on.

    Args:
        plays: Sessions with their names; one is taken when there is room for it.
        at_once: How many run at a time.
        perform: Does what the sessions ask for; see `performer`.

    Yields:
        Name and result of each session that is over, or what it raised.
    """
    waiting = iter(plays)
    running: dict[str, tuple[Play[T], Request]] = {}
    while True:
        done = perform([request for _, request in running.values()])
        outcomes: dict[str, Outcome | PhysicsError | None] = dict(zip(running, done, strict=True))
        begun = dict(itertools.islice(waiting, at_once - len(running)))
        outcomes |= dict.fromkeys(begun)
        if not outcomes:
            return
        for name, outcome in outcomes.items():
            play = begun[name] if name in begun else running.pop(name)[0]
            try:
                running[name] = play, _go_on(play, outcome)
            except StopIteration as over:
                yield name, over.value
            except Exception as error:  # whatever goes wrong in one session, the others go on
                yield name, error


def _go_on(play: Play[T], outcome: Outcome | PhysicsError | None) -> Request:
    """Hand a session what came of its request (None to begin); its next request."""
    if outcome is None:
        return next(play)
    return play.throw(outcome) if isinstance(outcome, PhysicsError) else play.send(outcome)


@contextmanager
def performer(threads: int = 1) -> Iterator[Performer]:
    """Does what many sessions ask at once, on so many threads; what comes of it does not depend on their number."""
    with Crew(threads) as crew:
        yield lambda requests: crew.all([partial(_attempt, request) for request in requests])


def _attempt(request: Request) -> Any:
    """Do what a session asks; a failure of the physics is an answer like any other."""
    try:
        return request.perform()
    except PhysicsError as error:
        return error
