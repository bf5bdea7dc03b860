"""The person as servos: where the body is, where it is told to go, and the physics steps in between."""

import math
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim import avatar
from mjsim.errors import AssetError
from mjsim.scene import Scene

Vector = NDArray[np.float64]

# A position servo with damping lags a moving target by kv / kp seconds; the command leads by as much.
_LEAD = avatar.HAND_KV / avatar.HAND_KP


class Rig:
    """Reads and commands the avatar of one simulation.

    Attributes:
        model: The compiled scene, never modified.
        data: Its state.
        velocity: Commanded walking velocity in the body frame (forward, left), m/s, shape (2,).
        turn: Commanded yaw rate, rad/s.
        pitch_target: Commanded pitch of the head, rad.
        hand_targets: Commanded hand positions in the body frame, m, shape (2, 3).
    """

    def __init__(self, scene: Scene, data: mujoco.MjData, control_timestep: float) -> None:
        self.model, self.data = scene.model, data
        model = scene.model
        self._substeps = round(control_timestep / model.opt.timestep)
        self._dt = control_timestep
        joints = [avatar.PREFIX + n for n in ("x", "y", "yaw", "pitch")]
        joints += [f"{avatar.PREFIX}{hand}/{axis}" for hand in avatar.HANDS for axis in "xyz"]
        ids = [_find(model, mujoco.mjtObj.mjOBJ_JOINT, name) for name in joints]
        self._qpos = model.jnt_qposadr[ids].astype(np.intp)
        self._dofs = model.jnt_dofadr[ids].astype(np.intp)
        self._actuators = np.array([_find(model, mujoco.mjtObj.mjOBJ_ACTUATOR, n) for n in joints], np.intp)
        self.grip_sites = tuple(
            _find(model, mujoco.mjtObj.mjOBJ_SITE, f"{avatar.PREFIX}{hand}_grip") for hand in avatar.HANDS
        )
        self.trunk = _find(model, mujoco.mjtObj.mjOBJ_GEOM, avatar.TRUNK)
        self.foot = _find(model, mujoco.mjtObj.mjOBJ_GEOM, avatar.FOOT)
        self.body = _find(model, mujoco.mjtObj.mjOBJ_BODY, avatar.BODY)
        self.reset()

    def reset(self) -> None:
        """Take the commands from the present state: standing still."""
        q = self.data.qpos[self._qpos]
        self.velocity = np.zeros(2)
        self.turn = 0.0
        self.pitch_target = float(q[3])
        self.hand_targets = q[4:].reshape(2, 3).copy()
        self._hand_targets_before = self.hand_targets.copy()
        self._command = np.concatenate(([0.0, 0.0, 0.0, q[3]], q[4:]))
        self.data.ctrl[self._actuators] = self._command

    def memory(self) -> dict[str, Any]:
        """The commands, JSON-ready."""
        return {
            "velocity": [float(v) for v in self.velocity],
            "turn": float(self.turn),
            "pitch_target": float(self.pitch_target),
            "hand_targets": self.hand_targets.tolist(),
            "hand_targets_before": self._hand_targets_before.tolist(),
            "command": self._command.tolist(),
        }

    def recall(self, memory: dict[str, Any]) -> None:
        """Take the commands from what `memory` gave."""
        self.velocity = np.array(memory["velocity"])
        self.turn = float(memory["turn"])
        self.pitch_target = float(memory["pitch_target"])
        self.hand_targets = np.array(memory["hand_targets"])
        self._hand_targets_before = np.array(memory["hand_targets_before"])
        self._command = np.array(memory["command"])

    @property
    def position(self) -> Vector:
        """Body axis on the floor, m, shape (2,)."""
        return np.array(self.data.qpos[self._qpos[:2]])

    @property
    def heading(self) -> float:
        """Yaw, rad, unwrapped."""
        return float(self.data.qpos[self._qpos[2]])

    @property
    def pitch(self) -> float:
        """Pitch of the head, rad, positive upwards."""
        return float(self.data.qpos[self._qpos[3]])

    @property
    def planar_velocity(self) -> Vector:
        """Velocity in the house frame, m/s, shape (2,)."""
        return np.array(self.data.qvel[self._dofs[:2]])

    @property
    def turn_rate(self) -> float:
        """Yaw rate, rad/s."""
        return float(self.data.qvel[self._dofs[2]])

    @property
    def hands(self) -> Vector:
        """Hand positions in the body frame, m, shape (2, 3)."""
        return np.array(self.data.qpos[self._qpos[4:]].reshape(2, 3))

    @property
    def eye(self) -> Vector:
        """Eye camera in the house frame, m, shape (3,)."""
        out = avatar.EYE_FORWARD * math.cos(self.pitch)
        x, y = self.position
        c, s = math.cos(self.heading), math.sin(self.heading)
        height = avatar.EYE_HEIGHT + avatar.EYE_FORWARD * math.sin(self.pitch)
        return np.array([x + out * c, y + out * s, height])

    def look_at_pitch(self, pitch: float) -> None:
        """Command a pitch of the head, rad, kept within what a neck can do."""
        low, high = avatar.PITCH_RANGE
        self.pitch_target = min(high, max(low, pitch))

    def to_body(self, point: Vector) -> Vector:
        """A point of the house frame, (3,) m, in the body frame."""
        dx, dy = point[:2] - self.position
        c, s = math.cos(self.heading), math.sin(self.heading)
        return np.array([c * dx + s * dy, c * dy - s * dx, point[2]])

    def bearing(self, point: Vector) -> float:
        """Direction of a point relative to the heading, rad in [-pi, pi]."""
        x, y, _ = self.to_body(np.array([point[0], point[1], 0.0]))
        return math.atan2(y, x)

    def advance(self) -> None:
        """Step the physics by one control step, ramping the servos from the last commands to the new ones."""
        heading = self.heading + 0.5 * self.turn * self._dt
        c, s = math.cos(heading), math.sin(heading)
        forward, left = self.velocity
        lead = (self.hand_targets - self._hand_targets_before) * (_LEAD / self._dt)
        hands = (self.hand_targets + lead).ravel()
        walk = [c * forward - s * left, s * forward + c * left, self.turn, self.pitch_target]
        command = np.concatenate((walk, hands))
        # Hands are ramped from where they were told to be, with the lead in force from the first step on.
        start = self._command.copy()
        start[4:] = (self._hand_targets_before + lead).ravel()
        if np.array_equal(start, command):
            self.data.ctrl[self._actuators] = command
            mujoco.mj_step(self.model, self.data, self._substeps)
        else:
            self._ramp(start, command)
        self._command = command
        self._hand_targets_before = self.hand_targets.copy()

    def _ramp(self, start: Vector, end: Vector) -> None:
        change = (end - start) / self._substeps
        for step in range(1, self._substeps + 1):
            self.data.ctrl[self._actuators] = start + step * change
            mujoco.mj_step(self.model, self.data)


def _find(model: mujoco.MjModel, kind: mujoco.mjtObj, name: str) -> int:
    found = int(mujoco.mj_name2id(model, kind, name))
    if found < 0:
        raise AssetError(f"the model has no {kind.name} {name!r}; compose the scene with avatar=True")
    return found
