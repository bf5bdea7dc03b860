"""Demonstrations for imitation: what a built-in participant does, as pairs of observation and action."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.house import House
from experiments.locomotion import LocomotionController
from experiments.participants.base import Choice, Guidance, Percept, Point, WalkAlong
from experiments.participants.nearest import Nearest
from hud.state import HudState
from mjsim.actions import IDLE, Action, ActionResult, Move, Pick
from mjsim.environments.core import ObservationDict, Rearrangement
from mjsim.observation import ObjectStatus, Observation
from mjsim.options import WorldOptions

Policy = Callable[[ObservationDict], NDArray[np.float32]]


@dataclass(frozen=True, eq=False)
class Demonstrations:
    """What was observed and what the demonstrator would have done, row by row.

    Attributes:
        observations: Sensor name -> arrays, first axis the row.
        actions: Actions for continuous control, float32, shape (rows, 4).
        delivered: Share of all objects that were delivered in the episodes.
    """

    observations: Mapping[str, NDArray[Any]]
    actions: NDArray[np.float32]
    delivered: float


class Demonstrator:
    """A participant who knows the house and where everything is, in one episode of an environment.

    Args:
        house: The house, which the participant knows.
        targets: Object instance name -> receptacle key.
    """

    def __init__(self, house: House, targets: Mapping[str, str]) -> None:
        self._participant = Nearest(house)
        self._controller = LocomotionController(house.navmesh.outline)
        self._targets = targets
        self.answer: ActionResult | None = None

    def act(self, observation: Observation) -> Action:
        """What it would do now."""
        decision = self._participant.act(
            Percept(
                time=observation.time,
                position=observation.position,
                heading=observation.heading,
                hands=observation.hands,
                busy=observation.busy,
                targets=self._targets,
                answer=self.answer,
                blocked=self._controller.blocked,
                senses=_Flagpoles(observation),
            )
        )
        if not isinstance(decision, WalkAlong):
            return IDLE
        return self._controller.step(decision, _without_objects(observation))


class _Flagpoles:
    """Senses of somebody who sees a flagpole over every misplaced object, and nothing else."""

    def __init__(self, observation: Observation) -> None:
        self._observation = observation

    def flagpoles(self) -> Mapping[str, Point]:
        """Object instance name -> floor position, m, shape (2,)."""
        seen = self._observation
        positions = zip(seen.object_names, seen.object_positions[:, :2], strict=True)
        loose = set(seen.names_with(ObjectStatus.LOOSE))
        return {name: xy for name, xy in positions if name in loose}

    def look(self) -> Mapping[str, Point]:
        """Nothing."""
        return {}

    def nearby(self) -> Mapping[str, Point]:
        """Nothing."""
        return {}

    def guidance(self) -> Guidance | None:
        """None."""
        return None

    def choices(self) -> Sequence[Choice]:
        """None."""
        return ()

    def hud(self) -> HudState:
        """Raises `NotImplementedError`."""
        raise NotImplementedError("this participant sees the flagpoles alone")


def _without_objects(observation: Observation) -> Observation:
    """The learner cannot see what lies at its feet, so its teacher walks straight on, too."""
    nothing = np.zeros((0, 3))
    return dataclasses.replace(observation, object_names=(), object_status=(), object_positions=nothing)


def encode(action: Action, options: WorldOptions) -> NDArray[np.float32]:
    """An action of the world as one of continuous control: (forward, left, turn, trigger)."""
    if isinstance(action, Move):
        speed, turn = options.max_speed, options.max_turn
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
    """Run episodes and write down what the demonstrator would do at every step.

    Args:
        core: Environment with continuous control.
        house: The house it is in.
        seeds: Seeds of the episodes.
        rng: Chance of the noise.
        driver: Who acts; None for the demonstrator. Letting the learner act and the demonstrator correct it shows
            the learner the states that its own mistakes lead to (DAgger, Ross et al. 2011).
        noise: Standard deviation of what is added to the velocities of the driver, share of the fastest.
    """
    rows: list[ObservationDict] = []
    actions: list[NDArray[np.float32]] = []
    delivered = total = 0
    for seed in seeds:
        seen, _ = core.reset(seed)
        expert = Demonstrator(house, core.world.scene.episode.targets)
        over = False
        while not over:
            advice = encode(expert.act(core.state), core.world.options)
            action = advice if driver is None else driver(seen)
            if not core.world.busy:  # what is asked of busy hands is ignored, and teaches nothing
                rows.append(seen)
                actions.append(advice)
            taken = core.step(_noisy(action, noise, rng))
            answers = [s.result for s in taken.steps if s.result is not None]
            expert.answer = answers[-1] if answers else None
            seen, over = taken.observation, taken.terminated or taken.truncated
        delivered += taken.info["delivered"]
        total += taken.info["objects"]
    stacked = {name: np.stack([row[name] for row in rows]) for name in rows[0]}
    return Demonstrations(stacked, np.stack(actions), delivered / total)


def _noisy(action: NDArray[np.float32], noise: float, rng: np.random.Generator) -> NDArray[np.float32]:
    if not noise:
        return action
    disturbance = np.append(rng.normal(0.0, noise, 3), 0.0).astype(np.float32)
    return np.asarray(np.clip(action + disturbance, -1.0, 1.0))
