"""Everything that a session asked of its world in a trial, to be asked of a world again: work of a real kind."""

import tempfile
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.house import House
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from mjsim.actions import Action
from mjsim.model.sampling import POINTS, sample_episode
from mjsim.model.scene import Scene, compose
from mjsim.options import WorldOptions
from mjsim.world import World

Call = tuple[str, Any]  # method of the world and its argument


@dataclass(frozen=True, eq=False)
class VisitTask:
    """A trial as its world saw it.

    Attributes:
        scene: Where it took place.
        fidelity: The tier.
        calls: What was asked: `step`, `walk`, `finish`, and `restore` where a checkpoint was passed.
    """

    scene: Scene
    fidelity: str
    calls: tuple[Call, ...]

    def world(self) -> World:
        """A new world to play it in."""
        return World(self.scene, WorldOptions(fidelity=self.fidelity))

    def actions(self, seconds: float) -> list[Action]:
        """Its first single steps, of so much simulated time."""
        steps = [argument for name, argument in self.calls if name == "step"]
        return steps[: round(seconds / WorldOptions().control_timestep)]


def record_errand(
    house: House, objects: int, seed: int, fidelity: str = "full", seconds: float | None = None
) -> VisitTask:
    """Run a trial of the follower under optimal assistance and keep what its session asked of the world.

    Args:
        house: Where.
        objects: How many there are; above 40 the points of the house are drawn anew.
        seed: Of the house.
        fidelity: The tier.
        seconds: Simulated time after which it is cut off, s; None to let it end.

    Raises:
        SamplingError: The house has no room for so many objects.
    """
    config = TrialConfig(
        objects=objects, assistance="optimal", seed=seed, fidelity=fidelity, regret=False, time_limit=seconds
    )
    points = max(objects, POINTS)
    episode = sample_episode(house.catalogue, house.navmesh, objects=objects, seed=seed, points=points)
    scene = compose(episode, house.catalogue)
    calls: list[Call] = []
    with tempfile.TemporaryDirectory() as folder, EventLog(Path(folder) / "events.jsonl") as log:
        session, world = prepare_session(config, house, scene, log)
        for name in ("step", "walk", "finish", "restore"):
            setattr(world, name, _noted(calls, name, getattr(world, name)))
        session.run()
    return VisitTask(scene, fidelity, tuple(calls))


def _noted(calls: list[Call], name: str, method: Callable[..., Any]) -> Callable[..., Any]:
    def noted(*arguments: Any) -> Any:
        calls.append((name, arguments[0] if arguments else None))
        return method(*arguments)

    return noted


def play(world: World, calls: Sequence[Call]) -> float:
    """Ask the same of a world; returns the CPU time that it took, s, checkpoints left out."""
    clock, checkpoints = time.process_time, 0.0
    start = clock()
    for name, argument in calls:
        if name == "step":
            world.step(argument)
        elif name == "walk":
            world.walk(argument)
        elif name == "finish":
            world.finish()
        else:
            began = clock()
            world.restore(world.state())
            checkpoints += clock() - began
    return clock() - start - checkpoints
