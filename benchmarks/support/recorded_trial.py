"""Record a session's calls to its world, so that they can be repeated as a realistic workload."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.record.records import EventLog
from experiments.trials.setup import prepare_session
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.sampling import sample_episode
from mjsim.house.scene.scene import Scene, compose
from mjsim.values.actions import Action, Move
from mjsim.values.episode import POINTS
from mjsim.values.observation import Observation
from mjsim.values.options import WorldOptions
from mjsim.world.state import WorldState
from mjsim.world.world import MAX_STEPS, StepResult, World

Call = tuple[str, Any]  # method name and arguments: an action and a limit for `step`, or None for `restore`


class RecordingWorld(World):
    """A world that records calls to `step` and `restore`.

    Attributes:
        calls: The recorded calls.
        single_steps: The recorded calls, with a separate call for each control step of an action.
    """

    def __init__(self, scene: Scene, options: WorldOptions | None = None, *, walls: Any = None) -> None:
        super().__init__(scene, options, walls=walls)
        self.calls: list[Call] = []
        self.single_steps: list[Call] = []

    def step(self, action: Action, limit: int = MAX_STEPS) -> StepResult:
        self.calls.append(("step", (action, limit)))
        result = super().step(action, limit)
        taken = result.steps.actions
        actions = [Move(*row) for row in taken.tolist()] if isinstance(taken, np.ndarray) else [taken]
        self.single_steps += [("step", (action, 1)) for action in actions]
        return result

    def restore(self, state: WorldState) -> Observation:
        self.calls.append(("restore", None))
        self.single_steps.append(("restore", None))
        return super().restore(state)


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """Recorded calls of a trial to its world.

    Attributes:
        walls: Outline of the navigable floor in metres, (e, 4), as in `World`.
        calls: Calls of `step` with an action and a limit, and of `restore` at every checkpoint.
        single_steps: The same calls, with a separate call for each control step.
    """

    scene: Scene
    fidelity: str
    walls: NDArray[np.float64]
    calls: tuple[Call, ...]
    single_steps: tuple[Call, ...]

    def world(self) -> World:
        """Return a new world on which the calls can be repeated."""
        return World(self.scene, WorldOptions(fidelity=self.fidelity), walls=self.walls)

    def actions(self, seconds: float) -> list[Action]:
        """Return the actions of the first control steps, up to `seconds` of simulated time."""
        steps = [argument[0] for name, argument in self.single_steps if name == "step"]
        return steps[: round(seconds / WorldOptions().control_timestep)]


def record_trial(
    house: House, objects: int, seed: int, fidelity: str = "full", seconds: float | None = None
) -> RecordedTrial:
    """Run a trial of the follower under optimal assistance and record the calls to its world.

    Args:
        house: The house.
        objects: Number of objects. For more than 40 objects, other positions are sampled.
        seed: Seed of the episode.
        fidelity: Fidelity of the simulation.
        seconds: Simulated time after which the trial stops, s, or None to run to the end.

    Raises:
        SamplingError: There is not enough room in the house for the objects.
    """
    config = TrialConfig(
        objects=objects, assistance="optimal", seed=seed, fidelity=fidelity, regret=False, time_limit=seconds
    )
    points = max(objects, POINTS)
    episode = sample_episode(house.catalogue, house.navmesh, objects=objects, seed=seed, points=points)
    scene = compose(episode, house.catalogue, visuals=False)  # visual geoms are only needed for films
    world = RecordingWorld(scene, WorldOptions(fidelity=fidelity), walls=house.navmesh.outline)
    session, _ = prepare_session(config, house, scene, EventLog(), world=world)
    session.run()
    return RecordedTrial(
        scene, fidelity, house.navmesh.outline, tuple(world.calls), tuple(world.single_steps)
    )


def play(world: World, calls: Sequence[Call]) -> float:
    """Repeat calls on a world. Return the CPU time in seconds, excluding checkpoints."""
    clock, checkpoints = time.process_time, 0.0
    start = clock()
    for name, argument in calls:
        if name == "step":
            world.step(*argument)
        else:
            began = clock()
            world.restore(world.state())
            checkpoints += clock() - began
    return clock() - start - checkpoints
