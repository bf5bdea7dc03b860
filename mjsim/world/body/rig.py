"""The person's joints and servos, and the physics steps of a control step."""

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene, find_id
from mjsim.support.kernels import kernel
from mjsim.values.errors import AssetError

Vector = NDArray[np.float64]

# Indices into a body state: pose, velocities in the house frame, commands in the body frame, and the latest
# servo commands for x, y, yaw and pitch in the house frame. Units are metres, radians and seconds.
X, Y, HEADING, PITCH = 0, 1, 2, 3
VX, VY, TURN_RATE, PITCH_RATE = 4, 5, 6, 7
FORWARD, LEFT, TURN, LOOK = 8, 9, 10, 11
SERVO = 12
BODY_SIZE = 16

# A damped position servo lags behind a moving target by kv / kp seconds. Commands lead by the same time.
_LEAD = avatar.HAND_KV / avatar.HAND_KP
_SERVOS = 10


@dataclass(frozen=True, eq=False)
class RigState:
    """The commands to the person's servos."""

    motion: Vector  # see `Rig.motion`, shape (4,)
    hand_targets: Vector  # see `Rig.hand_targets`, in metres, shape (2, 3)
    previous_hand_targets: Vector  # `hand_targets` in the previous control step, shape (2, 3)
    command: Vector  # previous servo commands: x, y and yaw velocity, pitch, and hand positions, shape (10,)


class Rig:
    """An interface to the person's joints and servos in a simulation."""

    def __init__(self, scene: Scene, data: mujoco.MjData, control_timestep: float) -> None:
        self.model, self.data = scene.model, data
        self._eye_height = scene.person.eye_height
        model = scene.model
        self._substeps = round(control_timestep / model.opt.timestep)
        self._dt = control_timestep
        joints = [avatar.PREFIX + n for n in ("x", "y", "yaw", "pitch")]
        joints += [f"{avatar.PREFIX}{hand}/{axis}" for hand in avatar.HANDS for axis in "xyz"]
        ids = [find_id(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in joints]
        actuators = np.array([find_id(model, mujoco.mjtObj.mjOBJ_ACTUATOR, name) for name in joints])
        # View of the state, shape (10,): x, y, yaw, pitch of the head, and both hands in the body frame.
        self.pose = _view(data.qpos, model.jnt_qposadr[ids])
        self.rates = _view(data.qvel, model.jnt_dofadr[ids])  # velocities of `pose`, shape (10,)
        self._activations = _view(data.act, model.actuator_actadr[actuators])
        self._controls = _view(data.ctrl, actuators)
        # Commanded forward and left velocity (m/s), yaw rate (rad/s) and pitch of the head (rad).
        self.motion = np.zeros(4)
        self.hand_targets = np.zeros((2, 3))  # commanded hand positions in the body frame, in metres
        self._last_hand_targets = np.zeros((2, 3))
        self._last_command = np.zeros(_SERVOS)
        self.grip_sites = tuple(
            find_id(model, mujoco.mjtObj.mjOBJ_SITE, f"{avatar.PREFIX}{hand}_grip") for hand in avatar.HANDS
        )
        self.trunk = find_id(model, mujoco.mjtObj.mjOBJ_GEOM, avatar.TRUNK)
        self.foot = find_id(model, mujoco.mjtObj.mjOBJ_GEOM, avatar.FOOT)
        self.body = find_id(model, mujoco.mjtObj.mjOBJ_BODY, avatar.BODY)
        self.reset()

    def reset(self) -> None:
        """Set the commands so that the person stops in the current pose."""
        self.motion[:] = 0.0, 0.0, 0.0, self.pose[3]
        self.hand_targets[:] = self.pose[4:].reshape(2, 3)
        self._last_hand_targets[:] = self.hand_targets
        self._last_command[:3] = 0.0
        self._last_command[3:] = self.pose[3:]
        self._activations[:] = self._last_command
        self._controls[:] = 0.0

    @property
    def body_state(self) -> Vector:
        """The body state, shape (BODY_SIZE,), whose layout is defined by constants of this module."""
        return np.concatenate((self.pose[:4], self.rates[:4], self.motion, self._last_command[:4]))

    def get_state(self) -> RigState:
        arrays = (self.motion, self.hand_targets, self._last_hand_targets, self._last_command)
        return RigState(*(array.copy() for array in arrays))

    def set_state(self, state: RigState) -> None:
        self.motion[:] = state.motion
        self.hand_targets[:] = state.hand_targets
        self._last_hand_targets[:] = state.previous_hand_targets
        self._last_command[:] = state.command

    @property
    def turn(self) -> float:
        return float(self.motion[2])

    @property
    def pitch_target(self) -> float:
        return float(self.motion[3])

    @property
    def position(self) -> Vector:
        """The position of the body's axis on the floor in metres, shape (2,)."""
        return self.pose[:2].copy()

    @property
    def heading(self) -> float:
        """The yaw angle in radians, which is not wrapped."""
        return float(self.pose[2])

    @property
    def pitch(self) -> float:
        return float(self.pose[3])

    @property
    def speed(self) -> float:
        return math.hypot(self.rates[0], self.rates[1])

    @property
    def turn_rate(self) -> float:
        return float(self.rates[2])

    @property
    def hands(self) -> Vector:
        """The positions (2, 3) of the hands in the body frame, in metres."""
        return self.pose[4:].reshape(2, 3).copy()

    @property
    def eye(self) -> Vector:
        """The position (3,) of the eye in the house frame, in metres."""
        x, y, heading, pitch = self.pose[:4].tolist()
        return np.array(avatar.eye_position(x, y, heading, pitch, self._eye_height))

    def to_body(self, point: Vector) -> Vector:
        """Transform a point (3,) from the house frame to the body frame."""
        x, y, heading = self.pose[:3].tolist()
        px, py, pz = point.tolist()
        c, s = math.cos(heading), math.sin(heading)
        return np.array([c * (px - x) + s * (py - y), c * (py - y) - s * (px - x), pz])

    def bearing(self, point: Vector) -> float:
        """Return the direction to a point (2,) or (3,) relative to the heading, in radians from -pi to pi."""
        x, y, heading = self.pose[:3].tolist()
        dx, dy = float(point[0]) - x, float(point[1]) - y
        c, s = math.cos(heading), math.sin(heading)
        return math.atan2(c * dy - s * dx, c * dx + s * dy)

    def advance(self, division: int = 1) -> None:
        """Simulate one control step, during which the servos ramp from the previous to the new commands.

        Physics steps are divided into `division` steps. The time constants of objects' contacts shrink with them.
        """
        ramp_servos(
            self.pose, self.motion, self.hand_targets, self._last_hand_targets, self._last_command,
            self._activations, self._controls, self._dt,
        )  # fmt: skip
        if division == 1:
            mujoco.mj_step(self.model, self.data, self._substeps)
            return
        model, option = self.model, self.model.opt
        before = option.timestep, option.sleep_tolerance, model.geom_solref[:, 0].copy()
        divided = (model.geom_priority == 0) & (before[2] > 0.0)  # not the person's geoms
        try:
            option.timestep /= division
            # Otherwise, an object could fall asleep in the air while it changes direction.
            option.sleep_tolerance /= division
            model.geom_solref[divided, 0] /= division
            mujoco.mj_step(model, self.data, self._substeps * division)
        finally:
            option.timestep, option.sleep_tolerance, model.geom_solref[:, 0] = before


@kernel
def ramp_servos(
    pose: Vector, motion: Vector, targets: Vector, last_targets: Vector, last_command: Vector,
    activations: Vector, controls: Vector, dt: float,
) -> None:  # fmt: skip
    """Set the activations of the servos and their rates, so that they reach the commands in one control step.

    The hand targets ramp from `last_targets` (2, 3) to `targets`, both shifted by the lead. `activations` and
    `controls` (10,) are views of `MjData`. All arrays from `last_targets` on are overwritten.
    """
    heading = pose[2] + 0.5 * motion[2] * dt
    c, s = math.cos(heading), math.sin(heading)
    end = np.empty(_SERVOS)
    end[0] = c * motion[0] - s * motion[1]
    end[1] = s * motion[0] + c * motion[1]
    end[2], end[3] = motion[2], motion[3]
    for hand in range(2):
        for axis in range(3):
            lead = (targets[hand, axis] - last_targets[hand, axis]) * (_LEAD / dt)
            servo = 4 + 3 * hand + axis
            end[servo] = targets[hand, axis] + lead
            last_command[servo] = last_targets[hand, axis] + lead
            last_targets[hand, axis] = targets[hand, axis]
    for servo in range(_SERVOS):
        activations[servo] = last_command[servo]
        controls[servo] = (end[servo] - last_command[servo]) / dt
        last_command[servo] = end[servo]


def _view(values: Vector, addresses: NDArray[np.integer[Any]]) -> Vector:
    first, count = int(addresses[0]), len(addresses)
    if not np.array_equal(addresses, np.arange(first, first + count)):
        raise AssetError(
            f"the person's joints lie at {addresses.tolist()} in the state, expected one after another; "
            "compose the scene with avatar=True"
        )
    return values[first : first + count]
