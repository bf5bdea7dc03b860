"""Every call that a session makes to its world in a trial, recorded to be played again: a realistic workload."""

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

Call = tuple[str, Any]  # `step` with an action and a limit, or `restore`


class RecordingWorld(World):
    """A world that records how it is called.

    Attributes:
        calls: `step` and `restore` so far.
        single_steps: The same, with each control step of an action as a call of its own.
    """

    def __init__(self, scene: Scene, options: WorldOptions | None = None, *, walls: Any = None) -> None:
        super().__init__(scene, options, walls=walls)
        self.calls: list[Call] = []
        self.single_steps: list[Call] = []

    def step(self, action: Action, limit: int = MAX_STEPS) -> StepResult:
        """See `World.step`."""
        self.calls.append(("step", (action, limit)))
        result = super().step(action, limit)
        taken = result.steps.actions
        actions = [Move(*row) for row in taken.tolist()] if isinstance(taken, np.ndarray) else [taken]
        self.single_steps += [("step", (action, 1)) for action in actions]
        return result

    def restore(self, state: WorldState) -> Observation:
        """See `World.restore`."""
        self.calls.append(("restore", None))
        self.single_steps.append(("restore", None))
        return super().restore(state)


@dataclass(frozen=True, eq=False)
class RecordedTrial:
    """The calls that a trial made to its world.

    Attributes:
        scene: The scene of the trial.
        fidelity: The tier.
        walls: Outline of the navigable floor, as `World` takes it, m, shape (e, 4).
        calls: `step` with an action and a limit, and `restore` at every checkpoint.
        single_steps: The same, with each control step as a call of its own.
    """

    scene: Scene
    fidelity: str
    walls: NDArray[np.float64]
    calls: tuple[Call, ...]
    single_steps: tuple[Call, ...]

    def world(self) -> World:
        """A new world to play the calls in."""
        return World(self.scene, WorldOptions(fidelity=self.fidelity), walls=self.walls)

    def actions(self, seconds: float) -> list[Action]:
        """The actions of the first control steps, as many as take `seconds` of simulated time."""
        steps = [argument[0] for name, argument in self.single_steps if name == "step"]
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
    world = RecordingWorld(scene, WorldOptions(fidelity=fidelity), walls=house.navmesh.outline)
    session, _ = prepare_session(config, house, scene, EventLog(), world=world)
    session.run()
    return RecordedTrial(
        scene, fidelity, house.navmesh.outline, tuple(world.calls), tuple(world.single_steps)
    )


def play(world: World, calls: Sequence[Call]) -> float:
    """Repeat calls on a world; returns the CPU time, s, without the checkpoints."""
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
