"""Record demonstrations for imitation learning: observations with the actions of an expert."""

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
    """Observations, each with the action that the expert would have taken.

    Attributes:
        observations: Arrays by sensor name, with the samples along the first axis.
        actions: Actions for continuous control, float32, shape (samples, 4).
        delivered: Share of the objects that were delivered.
    """

    observations: Mapping[str, NDArray[Any]]
    actions: NDArray[np.float32]
    delivered: float


class Expert:
    """An expert for one episode: the built-in participant that always goes to the nearest flagpole.

    Args:
        house: The house in which the participant walks.
        scene: The scene of the episode.

    Attributes:
        answer: Result of the last pick or place in the episode, which the caller must set.
    """

    def __init__(self, house: House, scene: Scene) -> None:
        self._participant = Nearest(house)
        self._walker = Walker(scene.person, house.navmesh.outline)
        self._scene = scene
        self.answer: ActionResult | None = None

    def act(self, observation: Observation) -> StepAction:
        """Return the action that the participant would take now."""
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
    """Percept of a participant who sees a flagpole over every misplaced object."""

    @property
    def flagpoles(self) -> Mapping[str, Point]:
        """Floor positions of misplaced objects by instance name, in metres, each of shape (2,)."""
        return positions_of(self._seen, self._seen.names_with(ObjectStatus.LOOSE))


def _without_objects(observation: Observation) -> Observation:
    """Remove all objects from an observation, because the policy cannot see objects at its feet either."""
    nothing = np.zeros((0, 3))
    return dataclasses.replace(observation, object_names=(), object_status=(), object_positions=nothing)


def encode(action: StepAction, person: PersonParameters) -> NDArray[np.float32]:
    """Convert a world action to continuous control: (forward, left, turn, trigger), -1 to 1, shape (4,)."""
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
    """Run episodes and record the expert's action at every step.

    Args:
        core: Environment with continuous control.
        house: The house of the environment.
        seeds: Seeds of the episodes.
        rng: Random generator for the noise.
        driver: The policy that acts, or None if the expert acts. A policy that acts while the expert corrects
            it learns from its own mistakes (DAgger, Ross et al. 2011).
        noise: Standard deviation of the noise that is added to velocities, as a share of their limits.
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
            if not core.world.busy:  # actions are ignored during a pick or place
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
