"""Demonstrations for imitation learning: pairs of an observation and the action of a built-in participant."""

import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments import House
from experiments.participants import Nearest, Percept, Point, positions_of
from mjsim import (
    IDLE,
    ActionResult,
    FollowPath,
    Move,
    ObjectStatus,
    Observation,
    PersonParameters,
    Pick,
    Scene,
    StepAction,
    Walker,
)
from mjsim.environments import ObservationDict, Rearrangement

Policy = Callable[[ObservationDict], NDArray[np.float32]]


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """Observations, and the action that the expert would have taken in each.

    Attributes:
        observations: Sensor name -> array; the first axis counts the samples.
        actions: Actions for continuous control, float32, shape (samples, 4).
        delivered: Share of the objects that were delivered.
    """

    observations: Mapping[str, NDArray[Any]]
    actions: NDArray[np.float32]
    delivered: float


class Expert:
    """The participant that goes to the nearest flagpole, in one episode of an environment.

    Args:
        house: The house, which the participant knows.
        scene: The scene of the episode.

    Attributes:
        answer: Result of the last pick or place of the episode; to be set by the caller.
    """

    def __init__(self, house: House, scene: Scene) -> None:
        self._participant = Nearest(house)
        self._walker = Walker(scene.person, house.navmesh.outline)
        self._scene = scene
        self.answer: ActionResult | None = None

    def act(self, observation: Observation) -> StepAction:
        """What the participant would do now."""
        percept = _Omniscient(
            observation,
            self._scene.episode.targets,
            self.answer,
            blocked=self._walker.blocked,
            person=self._scene.person,
        )
        decision = self._participant.act(percept)
        if not isinstance(decision, FollowPath):
            return IDLE
        return self._walker.step(decision, _without_objects(observation))


class _Omniscient(Percept):
    """The percept of a person who sees a flagpole over every misplaced object."""

    @property
    def flagpoles(self) -> Mapping[str, Point]:
        """Object instance name -> floor position, m, shape (2,)."""
        return positions_of(self._seen, self._seen.names_with(ObjectStatus.LOOSE))


def _without_objects(observation: Observation) -> Observation:
    """The policy does not observe objects at its feet, so the expert must not walk around them."""
    nothing = np.zeros((0, 3))
    return dataclasses.replace(observation, object_names=(), object_status=(), object_positions=nothing)


def encode(action: StepAction, person: PersonParameters) -> NDArray[np.float32]:
    """An action of the world as one of continuous control: (forward, left, turn, trigger), -1 to 1, shape (4,)."""
    if isinstance(action, Move):
        speed, turn = person.fastest_walk, person.turning_speed
        values = [action.forward / speed, action.left / speed, action.turn / turn, 0.0]
    else:
        values = [0.0, 0.0, 0.0, 1.0 if isinstance(action, Pick) else -1.0]
    return np.clip(np.array(values, np.float32), -1.0, 1.0)


def demonstrate(
    core: Rearrangement,
    house: House,
    *,
    seeds: range,
    rng: np.random.Generator,
    driver: Policy | None = None,
    noise: float = 0.0,
) -> Demonstrations:
    """Run episodes and record what the expert would do at every step.

    Args:
        core: Environment with continuous control.
        house: The house of the environment.
        seeds: Seeds of the episodes.
        rng: Draws the noise.
        driver: The policy that acts; None for the expert. If the policy acts and the expert corrects it, the policy
            learns from the states that its own mistakes lead to (DAgger, Ross et al. 2011).
        noise: Standard deviation of what is added to the velocities, as a share of the limits.
    """
    rows: list[ObservationDict] = []
    actions: list[NDArray[np.float32]] = []
    delivered = total = 0
    for seed in seeds:
        seen, _ = core.reset(seed)
        expert = Expert(house, core.world.scene)
        is_over = False
        while not is_over:
            advice = encode(expert.act(core.state), core.world.scene.person)
            action = advice if driver is None else driver(seen)
            if not core.world.busy:  # busy hands ignore the action
                rows.append(seen)
                actions.append(advice)
            taken = core.step(_noisy(action, noise, rng))
            answers = [s.result for s in taken.steps if s.result is not None]
            expert.answer = answers[-1] if answers else None
            seen, is_over = taken.observation, taken.terminated or taken.truncated
        delivered += taken.info["delivered"]
        total += taken.info["objects"]
    stacked = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return Demonstrations(stacked, np.stack(actions), delivered / total)


def _noisy(action: NDArray[np.float32], noise: float, rng: np.random.Generator) -> NDArray[np.float32]:
    if not noise:
        return action
    disturbance = np.append(rng.normal(0.0, noise, 3), 0.0).astype(np.float32)
    return np.asarray(np.clip(action + disturbance, -1.0, 1.0))
