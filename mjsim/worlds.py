"""Many worlds stepped together, on several threads.

A world stepped here goes through the very states that it goes through alone: worlds share nothing that changes, and
each is stepped by one thread at a time. So the number of threads changes the speed and nothing else. The engine lets
go of Python's interpreter lock while it steps, which is most of a step (docs/physics.md, "Many worlds").
"""

from collections.abc import Callable, Sequence
from functools import partial
from types import TracebackType
from typing import Any, Self, TypeVar

from numpy.typing import ArrayLike

from mjsim.actions import Action
from mjsim.crew import Crew
from mjsim.errors import ActionError
from mjsim.observation import Observation
from mjsim.rollout import Rollout
from mjsim.world import StepResult, World

T = TypeVar("T")


class Worlds(Sequence[World]):
    """Worlds of any episodes, sizes and fidelities.

        with Worlds([World(scene) for scene in scenes], threads=4) as worlds:
            observations = worlds.reset()
            results = worlds.step([Move(1.0)] * len(worlds))

    A world may be read, or stepped by itself, between the calls. Should steps fail, all the other worlds have taken
    theirs, and the error of the first world that failed is raised.
    """

    def __init__(self, worlds: Sequence[World], threads: int = 1) -> None:
        """Take the worlds as they are.

        Args:
            worlds: All different.
            threads: How many of them are stepped at the same time, the caller's thread included.

        Raises:
            ActionError: `threads` is below 1, there is no world, or a world is there twice.
        """
        if not worlds or len({id(world) for world in worlds}) < len(worlds):
            raise ActionError(f"{len(worlds)} worlds to step, which must be at least one, and all different")
        self._worlds = tuple(worlds)
        self._crew = Crew(min(threads, len(worlds)))

    def __len__(self) -> int:
        return len(self._worlds)

    def __getitem__(self, number: Any) -> Any:
        return self._worlds[number]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """End the threads; the worlds live on."""
        self._crew.close()

    def reset(self) -> list[Observation]:
        """Return every world to its episode's beginning."""
        return self._crew.all([world.reset for world in self._worlds])

    def step(self, actions: Sequence[Action]) -> list[StepResult]:
        """Advance every world by one control step.

        Args:
            actions: One per world.

        Raises:
            ActionError: There are more or fewer actions than worlds, or one is no action.
            PhysicsError: As in `World.step`.
        """
        self._check_count(len(actions), "actions")
        pairs = zip(self._worlds, actions, strict=True)
        return self._crew.all([partial(world.step, action) for world, action in pairs])

    def walk(self, moves: Sequence[ArrayLike]) -> list[Rollout]:
        """Advance every world by its own moves, as `World.walk` does; one array per world, of any length.

        Raises:
            ActionError: There are more or fewer arrays than worlds, or a world cannot walk them.
            PhysicsError: As in `World.step`.
        """
        self._check_count(len(moves), "arrays of moves")
        pairs = zip(self._worlds, moves, strict=True)
        return self._crew.all([partial(world.walk, rows) for world, rows in pairs])

    def finish(self) -> list[Rollout]:
        """Let every world finish its pick or place, as `World.finish` does.

        Raises:
            PhysicsError: As in `World.step`.
        """
        return self._crew.all([world.finish for world in self._worlds])

    def each(self, function: Callable[[World], T]) -> list[T]:
        """Call a function with every world, on all threads; it may touch its own world alone."""
        return self._crew.all([partial(function, world) for world in self._worlds])

    def _check_count(self, count: int, what: str) -> None:
        if count != len(self._worlds):
            raise ActionError(f"{count} {what} for {len(self._worlds)} worlds; give one per world")
