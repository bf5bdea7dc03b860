"""Controls: continuous velocities with a trigger, or a few discrete actions.

A control turns an action of the agent into one action of the world per control step. It is a generator that receives
the result of each control step, so that an action can last until it is done.
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
    """Turns actions of the agent into actions of the world."""

    def spec(self) -> specs.BoundedArray: ...

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:
        """Yield the actions of the world for one action of the agent, at least one.

        Args:
            action: Conforms to `spec`.
            observation: State before the action.
            world: World of the actions, which must not be changed.

        Raises:
            ActionError: The action does not conform to `spec`.
        """
        ...


@dataclass(frozen=True)
class Continuous:
    """Velocities and a trigger: (forward, left, turn, trigger), each clipped to [-1, 1].

    Velocities are shares of the person's limits. A trigger above 0.5 picks the nearest object in reach, below -0.5
    places a carried object. The first control step of a pick or place does not walk.

    Attributes:
        repeat: Number of control steps per action.

    Raises:
        EnvironmentConfigError: `repeat` is below 1.
    """

    repeat: int = 1

    def __post_init__(self) -> None:
        if self.repeat < 1:
            raise EnvironmentConfigError(f"repeat must be at least 1 control step, got {self.repeat}")

    def spec(self) -> specs.BoundedArray:
        return specs.BoundedArray((4,), np.float32, -1.0, 1.0, name="action")

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:  # noqa: ARG002
        try:
            values = np.asarray(action, dtype=np.float64)
        except (TypeError, ValueError):
            values = np.empty(0)
        if values.shape != (4,) or not np.isfinite(values).all():
            raise ActionError(
                f"an action is (forward, left, turn, trigger), four finite numbers; got {action!r:.200}"
            )
        forward, left, turn, trigger = np.clip(values, -1.0, 1.0).tolist()
        person = world.scene.person
        speed = person.fastest_walk
        move = Move(speed * forward, speed * left, person.turning_speed * turn)
        yield Pick() if trigger > 0.5 else Place() if trigger < -0.5 else move
        for _ in range(self.repeat - 1):
            yield move


MOVES = ("forward", "turn_left", "turn_right", "pick", "place")


@dataclass(frozen=True)
class Discrete:
    """Five actions, numbered as in `MOVES`. Each lasts until it is done or blocked.

    Attributes:
        stride: Distance of `forward`, m.
        angle: Angle of a turn, rad.

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
        return specs.DiscreteArray(len(MOVES), dtype=np.int64, name="action")

    def steps(self, action: Any, observation: Observation, world: World) -> Steps:
        index = np.asarray(action)
        if index.ndim or not np.issubdtype(index.dtype, np.integer) or not 0 <= index < len(MOVES):
            raise ActionError(f"an action is a whole number below {len(MOVES)}, got {action!r}")
        move = MOVES[int(index)]
        if move == "forward":
            return _walk(observation, self.stride, world)
        if move in ("turn_left", "turn_right"):
            return _turn(observation, self.angle if move == "turn_left" else -self.angle, world)
        return _pick_or_place(Pick() if move == "pick" else Place())


_GAIN = 8.0  # gain of the controller at the end of a walk or a turn, 1/s
_BRAKING = 2 / 3  # planned deceleration, as a share of the limit
_DISTANCE_TOLERANCE = 0.002  # m
_ANGLE_TOLERANCE = math.radians(0.1)
_STANDING = 0.01  # m/s
_MIN_PROGRESS = 0.0005  # m per control step
_MAX_BLOCKED_STEPS = 4  # number of control steps without progress after which a walk ends
_MAX_EXTRA_TIME = 2.0  # additional time for a walk that slides along an obstacle, s


def _walk(observation: Observation, stride: float, world: World) -> Steps:
    """Walk straight ahead until the distance is covered or the way is blocked, then stand still."""
    start, heading = observation.position, observation.heading
    direction = np.array([math.cos(heading), math.sin(heading)])
    walked, blocked = 0.0, 0
    person, timestep = world.scene.person, world.control_timestep
    fastest, braking = person.fastest_walk, _BRAKING * person.walking_acceleration
    for _ in range(math.ceil((_MAX_EXTRA_TIME + stride / min(1.0, fastest)) / timestep)):
        if blocked == _MAX_BLOCKED_STEPS or stride - walked <= _DISTANCE_TOLERANCE:
            break
        left = stride - walked
        delay = braking * timestep / 2  # compensates for the discrete steps, in which braking starts late
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
    """Pick or place, and stand until the hands are done."""
    step = yield action
    while step.observation.busy:
        step = yield IDLE


CONTROLS: dict[str, Control] = {"continuous": Continuous(), "discrete": Discrete()}
