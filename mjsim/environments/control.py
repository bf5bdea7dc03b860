"""What an agent may do: velocities with a trigger, or a few discrete moves.

A control turns one action of the agent into actions of the world, one per control step, and sees what each
brought. It is a generator, so that it can go on for as long as its action takes.
"""

import math
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from dm_env import specs

from mjsim.actions import IDLE, Action, Move, Pick, Place
from mjsim.environments.errors import EnvironmentConfigError
from mjsim.errors import ActionError
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.world import StepResult

Steps = Generator[Action, StepResult, None]


class Control(Protocol):
    """How an agent's actions become actions of the world."""

    def spec(self) -> specs.BoundedArray:
        """What an action is."""
        ...

    def steps(self, action: Any, observation: Observation, options: WorldOptions) -> Steps:
        """The world's actions of one action.

        Args:
            action: Conforms to `spec`.
            observation: The state before it.
            options: Limits of the world.

        Raises:
            ActionError: The action does not conform.
        """
        ...


@dataclass(frozen=True)
class Continuous:
    """Velocities and a trigger: (forward, left, turn, trigger), each -1 to 1; clipped to that.

    Velocities are shares of the world's limits. A trigger above 0.5 picks the nearest object in reach, below -0.5
    places what is carried; an attempt stands still for its first control step.

    Attributes:
        repeat: Control steps that one action lasts.
    """

    repeat: int = 1

    def __post_init__(self) -> None:
        if self.repeat < 1:
            raise EnvironmentConfigError(f"repeat must be at least 1 control step, got {self.repeat}")

    def spec(self) -> specs.BoundedArray:
        """Float32, shape (4,), -1 to 1."""
        return specs.BoundedArray((4,), np.float32, -1.0, 1.0, name="action")

    def steps(self, action: Any, observation: Observation, options: WorldOptions) -> Steps:  # noqa: ARG002
        """`repeat` control steps."""
        forward, left, turn, trigger = self._checked(action)
        move = Move(options.max_speed * forward, options.max_speed * left, options.max_turn * turn)
        first: Action = Pick() if trigger > 0.5 else Place() if trigger < -0.5 else move
        yield first
        for _ in range(self.repeat - 1):
            yield move

    def _checked(self, action: Any) -> list[float]:
        values = np.asarray(action, dtype=np.float64)
        if values.shape != (4,) or not np.isfinite(values).all():
            raise ActionError(
                f"an action is (forward, left, turn, trigger), four finite numbers; got {action!r}"
            )
        clipped: list[float] = np.clip(values, -1.0, 1.0).tolist()
        return clipped


MOVES = ("forward", "turn_left", "turn_right", "pick", "place")


@dataclass(frozen=True)
class Discrete:
    """Five actions, by their position in `MOVES`; each lasts until it is done or nothing moves any more.

    Attributes:
        stride: How far `forward` walks, m.
        angle: How far a turn turns, rad.
    """

    stride: float = 0.25
    angle: float = math.radians(10.0)

    def __post_init__(self) -> None:
        if not (self.stride > 0 and self.angle > 0):
            raise EnvironmentConfigError(
                f"stride and angle must be positive, got {self.stride} m and {self.angle} rad"
            )

    def spec(self) -> specs.BoundedArray:
        """An integer, the position of the action in `MOVES`."""
        return specs.DiscreteArray(len(MOVES), dtype=np.int64, name="action")

    def steps(self, action: Any, observation: Observation, options: WorldOptions) -> Steps:
        """As many control steps as the action takes."""
        try:
            move = MOVES[_index(action)]
        except (IndexError, TypeError, ValueError):
            raise ActionError(f"an action is a whole number below {len(MOVES)}, got {action!r}") from None
        if move == "forward":
            return _walk(observation, self.stride, options)
        if move in ("turn_left", "turn_right"):
            return _turn(observation, self.angle if move == "turn_left" else -self.angle, options)
        return _attempt(Pick() if move == "pick" else Place())


def _index(action: Any) -> int:
    value = np.asarray(action)
    if value.ndim or not np.issubdtype(value.dtype, np.integer) or value < 0:
        raise ValueError
    return int(value)


_GAIN = 8.0  # 1/s, for the last bit of a walk or a turn
_BRAKING = 2.0  # m/s^2 planned for; the body can do 3
_NEAR = 0.002  # m
_NEAR_ANGLE = math.radians(0.1)
_STILL = 0.01  # m/s
_PATIENCE = 4  # control steps without headway before a walk counts as blocked
_LONGEST = 2.0  # s for a walk that slides along something


def _walk(observation: Observation, stride: float, options: WorldOptions) -> Steps:
    """Walk straight ahead until the stride is made or something is in the way, and stand."""
    start, heading = observation.position, observation.heading
    ahead = np.array([math.cos(heading), math.sin(heading)])
    walked, waited = 0.0, 0
    for _ in range(math.ceil((_LONGEST + stride) / options.control_timestep)):
        if waited == _PATIENCE or stride - walked <= _NEAR:
            break
        left = stride - walked
        late = _BRAKING * options.control_timestep / 2  # braking begins a step late, and acts in steps
        pace = min(options.max_speed, math.sqrt(2 * _BRAKING * left + late**2) - late, _GAIN * left)
        step = yield Move(forward=pace)
        now = float((step.observation.position - start) @ ahead)
        waited = waited + 1 if now - walked < 0.0005 else 0
        walked = now
    yield from _stand(options)


def _stand(options: WorldOptions) -> Steps:
    for _ in range(math.ceil(options.max_speed / (options.acceleration * options.control_timestep)) + 1):
        step = yield IDLE
        if float(np.linalg.norm(step.observation.velocity)) < _STILL:
            return


def _turn(observation: Observation, angle: float, options: WorldOptions) -> Steps:
    """Turn on the spot."""
    goal, error = observation.heading + angle, angle
    longest = abs(angle) / options.max_turn + 1.0
    for _ in range(math.ceil(longest / options.control_timestep)):
        step = yield Move(turn=_GAIN * error)
        error = goal - step.observation.heading
        if abs(error) < _NEAR_ANGLE:
            break
    yield IDLE


def _attempt(action: Pick | Place) -> Steps:
    """Pick or place, and wait until the hands are done."""
    step = yield action
    while step.observation.busy:
        step = yield IDLE


CONTROLS = {"continuous": Continuous, "discrete": Discrete}


def resolve_control(actions: str | Control) -> Control:
    """The control itself, or the one of that name: `continuous` or `discrete`.

    Raises:
        EnvironmentConfigError: No control has that name.
    """
    if not isinstance(actions, str):
        return actions
    if actions not in CONTROLS:
        raise EnvironmentConfigError(
            f"no actions {actions!r}; choose from {sorted(CONTROLS)}, or pass a control"
        )
    made: Control = CONTROLS[actions]()
    return made
