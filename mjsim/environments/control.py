"""Action spaces of agents, and the conversion of agent actions into simulator actions.

The conversion is a generator that receives the result of every control step. A single agent action can
therefore span many control steps.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from dm_env import specs

from mjsim.values.actions import IDLE, Action, Move, Pick, Place
from mjsim.values.errors import ActionError, EnvironmentConfigError
from mjsim.values.observation import Observation
from mjsim.world.world import StepResult, World

Steps = Generator[Action, StepResult, None]


class Control(Protocol):
    """Protocol for classes that convert agent actions into simulator actions."""

    def spec(self) -> specs.BoundedArray:
        """Return the specification of an action."""

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:
        """Yield the simulator actions that carry out one agent action.

        Args:
            action: The agent action, which conforms to `spec`.
            observation: The state before the action.
            world: The simulated world. It must not be changed.

        Raises:
            ActionError: The action does not conform to `spec`.
        """
        ...


@dataclass(frozen=True)
class Continuous:
    """A continuous action space with four components (forward, left, turn, trigger) from -1 to 1.

    Values outside this range are clipped. Velocities are fractions of the person's maximum speeds. A trigger
    above 0.5 picks the nearest object in reach, and a trigger below -0.5 places a carried object. The person
    does not walk in the first control step of a pick or place.

    Attributes:
        repeat: Number of control steps per agent action.

    Raises:
        EnvironmentConfigError: `repeat` is below 1.
    """

    repeat: int = 1

    def __post_init__(self) -> None:
        if self.repeat < 1:
            raise EnvironmentConfigError(f"repeat must be at least 1 control step, got {self.repeat}")

    def spec(self) -> specs.BoundedArray:
        """Return the specification of an action."""
        return specs.BoundedArray((4,), np.float32, -1.0, 1.0, name="action")

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:  # noqa: ARG002
        """Return the steps that execute an action. Raise an ActionError if the action is invalid."""
        try:
            array = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            array = np.empty(0)
        values = array.tolist() if array.shape == (4,) else []
        if not values or not all(map(math.isfinite, values)):
            raise ActionError(
                f"an action is (forward, left, turn, trigger), four finite numbers; got {action!r:.200}"
            )
        forward, left, turn, trigger = (min(max(value, -1.0), 1.0) for value in values)
        person = world.scene.person
        speed = person.fastest_walk
        move = Move(speed * forward, speed * left, person.turning_speed * turn)
        yield Pick() if trigger > 0.5 else Place() if trigger < -0.5 else move
        for _ in range(self.repeat - 1):
            yield move


MOVES = ("forward", "turn_left", "turn_right", "pick", "place")


@dataclass(frozen=True)
class Discrete:
    """A discrete action space with the actions in `MOVES`. An action runs until it is complete or blocked.

    Attributes:
        stride: Distance that `forward` walks, in metres.
        angle: Angle by which a turn action rotates the person, in radians.

    Raises:
        EnvironmentConfigError: A value is not positive.
    """

    stride: float = 0.25
    angle: float = math.radians(10.0)

    def __post_init__(self) -> None:
        if not (self.stride > 0 and self.angle > 0):
            raise EnvironmentConfigError(
                f"stride and angle must be positive, got {self.stride} m and {self.angle} rad"
            )

    def spec(self) -> specs.BoundedArray:
        """Return the specification of an action."""
        return specs.DiscreteArray(len(MOVES), dtype=np.int64, name="action")

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:
        """Return the steps that execute an action. Raise an ActionError if the action is invalid."""
        index = np.asarray(action)
        if index.ndim or not np.issubdtype(index.dtype, np.integer) or not 0 <= index < len(MOVES):
            raise ActionError(f"an action is a whole number below {len(MOVES)}, got {action!r}")
        move = MOVES[int(index)]
        if move == "forward":
            return _walk(observation, self.stride, world)
        if move in ("turn_left", "turn_right"):
            return _turn(observation, self.angle if move == "turn_left" else -self.angle, world)
        return _pick_or_place(Pick() if move == "pick" else Place())


_GAIN = 8.0  # proportional gain of the controller for walks and turns, in 1/s
_BRAKING = 2 / 3  # planned deceleration as a fraction of the maximum acceleration
_DISTANCE_TOLERANCE = 0.002  # remaining distance below which a walk is complete, in metres
_ANGLE_TOLERANCE = math.radians(0.1)
_STANDING = 0.01  # speed below which the person counts as standing still, in m/s
_MIN_PROGRESS = 0.0005  # minimum distance per control step that counts as progress, in metres
_MAX_BLOCKED_STEPS = 4  # number of consecutive steps without progress after which a walk ends
_MAX_EXTRA_TIME = 2.0  # extra time allowed for a walk that slides along an obstacle, in seconds


def _walk(observation: Observation, stride: float, world: World) -> Steps:
    start, heading = observation.position, observation.heading
    direction = np.array([math.cos(heading), math.sin(heading)])
    walked, blocked = 0.0, 0
    person, timestep = world.scene.person, world.control_timestep
    fastest, braking = person.fastest_walk, _BRAKING * person.walking_acceleration
    for _ in range(math.ceil((_MAX_EXTRA_TIME + stride / min(1.0, fastest)) / timestep)):
        if blocked == _MAX_BLOCKED_STEPS or stride - walked <= _DISTANCE_TOLERANCE:
            break
        left = stride - walked
        delay = braking * timestep / 2  # compensates for braking that starts only at the next time step
        speed = min(fastest, math.sqrt(2 * braking * left + delay**2) - delay, _GAIN * left)
        step = yield Move(forward=speed)
        now = float((step.observation.position - start) @ direction)
        blocked = blocked + 1 if now - walked < _MIN_PROGRESS else 0
        walked = now
    for _ in range(math.ceil(fastest / (person.walking_acceleration * timestep)) + 1):
        step = yield IDLE
        if float(np.linalg.norm(step.observation.velocity)) < _STANDING:
            return


def _turn(observation: Observation, angle: float, world: World) -> Steps:
    goal, error = observation.heading + angle, angle
    max_time = abs(angle) / world.scene.person.turning_speed + 1.0
    for _ in range(math.ceil(max_time / world.control_timestep)):
        step = yield Move(turn=_GAIN * error)
        error = goal - step.observation.heading
        if abs(error) < _ANGLE_TOLERANCE:
            break
    yield IDLE


def _pick_or_place(action: Pick | Place) -> Steps:
    step = yield action
    while step.observation.busy:
        step = yield IDLE


CONTROLS: dict[str, Control] = {"continuous": Continuous(), "discrete": Discrete()}
