"""What a session asks of its world, and driving one session or many side by side."""

import itertools
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any, TypeVar, cast

import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Action
from mjsim.errors import PhysicsError
from mjsim.stretch import Stretch
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

    def perform(self) -> Stretch:
        """Do it; raises `PhysicsError` as `World.walk`."""
        return self.world.walk(self.moves)


@dataclass(frozen=True, eq=False)
class Finish:
    """Idle until the pick or place under way is over."""

    world: World

    def perform(self) -> Stretch:
        """Do it; raises `PhysicsError` as `World.finish`."""
        return self.world.finish()


Request = Step | Walk | Finish
Outcome = StepResult | Stretch
# Yields what a world is to do, takes what came of it, or is thrown the PhysicsError or KeyboardInterrupt that came.
Play = Generator[Request, Outcome, T]
# Takes a control step in each of several worlds.
StepTogether = Callable[[Sequence[Step]], Sequence[StepResult | PhysicsError]]


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
    step_together: StepTogether,
) -> Iterator[tuple[str, T | Exception]]:
    """Run sessions side by side: all take a control step, then all decide, and so on.

    Args:
        plays: Sessions with their names; one is taken when there is room for it.
        at_once: How many run at a time.
        step_together: Steps the worlds of several sessions.

    Yields:
        Name and result of each session that is over, or what it raised.
    """
    waiting = iter(plays)
    running: dict[str, tuple[Play[T], Request]] = {}
    while True:
        outcomes: dict[str, Outcome | PhysicsError | None] = _perform(running, step_together)
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


def _perform(
    running: Mapping[str, tuple[Play[T], Request]],
    step_together: StepTogether,
) -> dict[str, Outcome | PhysicsError | None]:
    """Do what all sessions ask; what came of it, in the sessions' order."""
    steps = {name: request for name, (_, request) in running.items() if isinstance(request, Step)}
    results = dict(zip(steps, step_together(list(steps.values())) if steps else (), strict=True))
    outcomes: dict[str, Outcome | PhysicsError | None] = {}
    for name, (_, request) in running.items():
        outcomes[name] = results[name] if name in results else _attempt(request)
    return outcomes


@contextmanager
def stepping(threads: int = 1) -> Iterator[StepTogether]:
    """How to step many worlds at once, on so many threads; what comes of it does not depend on their number."""
    if threads == 1:
        yield lambda steps: [_attempt(step) for step in steps]
        return
    with ThreadPoolExecutor(threads) as pool:
        yield lambda steps: list(pool.map(_attempt, steps))


def _attempt(request: Step | Walk | Finish) -> Any:
    """Do what a session asks; a failure of the physics is an answer like any other."""
    try:
        return request.perform()
    except PhysicsError as error:
        return error
