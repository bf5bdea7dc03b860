"""Every call that a session makes to its world in a trial, recorded to be played again: a realistic workload."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from numpy.typing import ArrayLike

from experiments.house import House
from experiments.runs.records import EventLog
from experiments.trials.setup import prepare_session
from experiments.trials.trial_config import TrialConfig
from mjsim.actions import Action
from mjsim.episode import POINTS
from mjsim.model.sampling import sample_episode
from mjsim.model.scene import Scene, compose
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.rollout import Rollout
from mjsim.world import StepResult, World
from mjsim.world_state import WorldState

Call = tuple[str, Any]  # method of the world and its argument


class RecordingWorld(World):
    """A world that records how it is called.

    Attributes:
        calls: `step`, `walk`, `finish` and `restore` so far, each with its argument or None.
    """

    def __init__(self, scene: Scene, options: WorldOptions | None = None) -> None:
        super().__init__(scene, options)
        self.calls: list[Call] = []

    def step(self, action: Action) -> StepResult:
        """See `World.step`."""
        self.calls.append(("step", action))
        return super().step(action)

    def walk(self, moves: ArrayLike) -> Rollout:
        """See `World.walk`."""
        self.calls.append(("walk", moves))
        return super().walk(moves)

    def finish(self) -> Rollout:
        """See `World.finish`."""
        self.calls.append(("finish", None))
        return super().finish()

    def restore(self, state: WorldState) -> Observation:
        """See `World.restore`."""
        self.calls.append(("restore", None))
        return super().restore(state)


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """The calls that a trial made to its world.

    Attributes:
        scene: The scene of the trial.
        fidelity: The tier.
        calls: `step`, `walk`, `finish`, and `restore` at every checkpoint.
    """

    scene: Scene
    fidelity: str
    calls: tuple[Call, ...]

    def world(self) -> World:
        """A new world to play the calls in."""
        return World(self.scene, WorldOptions(fidelity=self.fidelity))

    def actions(self, seconds: float) -> list[Action]:
        """The first single steps, as many as take `seconds` of simulated time."""
        steps = [argument for name, argument in self.calls if name == "step"]
        return steps[: round(seconds / WorldOptions().control_timestep)]


def record_trial(
    house: House, objects: int, seed: int, fidelity: str = "full", seconds: float | None = None
) -> RecordedTrial:
    """Run a trial of the follower under optimal assistance and record the calls to its world.

    Args:
        house: The house.
        objects: Number of objects; above 40 the sampling points of the house are drawn anew.
        seed: Seed of the episode.
        fidelity: The tier.
        seconds: Simulated time after which the trial is cut off, s; None to run to the end.

    Raises:
        SamplingError: The house has no room for so many objects.
    """
    config = TrialConfig(
        objects=objects, assistance="optimal", seed=seed, fidelity=fidelity, regret=False, time_limit=seconds
    )
    points = max(objects, POINTS)
    episode = sample_episode(house.catalogue, house.navmesh, objects=objects, seed=seed, points=points)
    scene = compose(episode, house.catalogue, visuals=False)  # as a trial that is not filmed
    world = RecordingWorld(scene, WorldOptions(fidelity=fidelity))
    session, _ = prepare_session(config, house, scene, EventLog(), world=world)
    session.run()
    return RecordedTrial(scene, fidelity, tuple(world.calls))


def play(world: World, calls: Sequence[Call]) -> float:
    """Repeat calls on a world; returns the CPU time, s, without the checkpoints."""
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
