"""Kernels that simulate the person's servos and trunk during kinematic walking.

A body state is an array of `BODY_SIZE` numbers. `command` changes the commands in it, as `Person.walk` does.
`advance` simulates the four servos in physics steps, with the masses, gains and force limits of the compiled
model. The trunk is a disc that slides along the outlines of the house. Loose objects are not obstacles.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import Floor
from mjsim.house.scene import avatar
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import kernel
from mjsim.values.options import WorldOptions
from mjsim.world.body import motion_profiles
from mjsim.world.body.rig import (
    FORWARD,
    HEADING,
    LEFT,
    LOOK,
    PITCH,
    PITCH_RATE,
    SERVO,
    TURN,
    TURN_RATE,
    VX,
    VY,
    X,
    Y,
)
from mjsim.world.fidelity.trunk_contact import is_clear, slide


class Gait(NamedTuple):
    """The limits of a person's movements and the parameters of the servos, in SI units."""

    # From `PersonParameters`: maximum walking, turning and looking speed, walking and turning acceleration.
    max_speed: float
    max_turn: float
    max_look: float
    acceleration: float
    turn_acceleration: float
    dt: float  # duration of a control step
    substeps: int  # number of physics steps per control step
    mass: float  # moving mass, gain and force limit of the velocity servos for x and y
    walk_gain: float
    walk_force: float
    # Moment of inertia, gain and torque limit of the velocity servo for the yaw.
    inertia: float
    turn_gain: float
    turn_force: float
    head_inertia: float  # moment of inertia, gains and torque limit of the position servo for the head
    head_stiffness: float
    head_damping: float
    head_force: float
    lowest: float  # lower and upper limit of the head's pitch
    highest: float
    radius: float  # radius of the trunk
    eye_height: float  # height of the eye above the floor
    eye_forward: float  # distance of the eye in front of the body's axis

    @classmethod
    def of(cls, scene: Scene, options: WorldOptions) -> "Gait":
        """Read the values from a compiled scene that includes a person."""
        model, person = scene.model, scene.person
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        inertia = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, inertia)
        names = [avatar.PREFIX + joint for joint in ("x", "yaw", "pitch")]
        moved = [float(inertia[dof, dof]) for dof in (int(model.joint(n).dofadr[0]) for n in names)]
        servos = [model.actuator(name) for name in names]
        stiffness = [float(-servo.biasprm[1]) for servo in servos]
        damping = [float(-servo.biasprm[2]) for servo in servos]
        force = [float(servo.forcerange[1]) for servo in servos]
        return cls(
            max_speed=person.fastest_walk,
            max_turn=person.turning_speed,
            max_look=person.looking_speed,
            acceleration=person.walking_acceleration,
            turn_acceleration=person.turning_acceleration,
            dt=options.control_timestep,
            substeps=round(options.control_timestep / model.opt.timestep),
            mass=moved[0],
            walk_gain=damping[0],
            walk_force=force[0],
            inertia=moved[1],
            turn_gain=damping[1],
            turn_force=force[1],
            head_inertia=moved[2],
            head_stiffness=stiffness[2],
            head_damping=damping[2],
            head_force=force[2],
            lowest=avatar.PITCH_RANGE[0],
            highest=avatar.PITCH_RANGE[1],
            radius=person.body_radius,
            eye_height=person.eye_height,
            eye_forward=avatar.EYE_FORWARD,
        )


@kernel
def command(
    body: NDArray[np.float64], forward: float, left: float, turn: float, look: float, gait: Gait
) -> None:
    """Bring the commanded velocities of a body closer to those of a move, in m/s and rad/s."""
    motion = body[FORWARD:SERVO]
    motion_profiles.change_velocity(motion, forward, left, gait.max_speed, gait.acceleration * gait.dt)
    motion_profiles.change_turn_rate(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)
    motion_profiles.change_pitch(motion, look, gait.max_look, gait.lowest, gait.highest, gait.dt)


@kernel
def brake(body: NDArray[np.float64], turn: float, gait: Gait) -> None:
    """Reduce the commanded velocity, and bring the commanded yaw rate closer to `turn` (rad/s)."""
    motion = body[FORWARD:SERVO]
    motion_profiles.change_velocity(motion, 0.0, 0.0, gait.max_speed, gait.acceleration * gait.dt)
    motion_profiles.change_turn_rate(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)


@kernel
def look_at(body: NDArray[np.float64], pitch: float, gait: Gait) -> None:
    """Set the commanded pitch of the head, in radians, and clamp it to the head's range."""
    body[LOOK] = min(gait.highest, max(gait.lowest, pitch))


@kernel
def advance(body: NDArray[np.float64], gait: Gait, floor: Floor) -> None:
    """Simulate the servos and the trunk for one control step. The servos ramp to the new commands."""
    heading = body[HEADING] + 0.5 * body[TURN] * gait.dt
    c, s = math.cos(heading), math.sin(heading)
    to_x = c * body[FORWARD] - s * body[LEFT]
    to_y = s * body[FORWARD] + c * body[LEFT]
    to_turn, to_pitch = body[TURN], body[LOOK]
    h = gait.dt / gait.substeps
    ramp_x, ramp_y = (to_x - body[SERVO]) / gait.substeps, (to_y - body[SERVO + 1]) / gait.substeps
    ramp_turn, ramp_pitch = (
        (to_turn - body[SERVO + 2]) / gait.substeps,
        (to_pitch - body[SERVO + 3]) / gait.substeps,
    )
    walk, turn = _servo(gait.mass, gait.walk_gain, h), _servo(gait.inertia, gait.turn_gain, h)
    head = _servo(gait.head_inertia, gait.head_damping, h)
    # The speed never exceeds the largest of the current speed, the previous command and the new command.
    reach_x = gait.radius + gait.dt * max(abs(body[VX]), abs(body[SERVO]), abs(to_x))
    reach_y = gait.radius + gait.dt * max(abs(body[VY]), abs(body[SERVO + 1]), abs(to_y))
    free = is_clear(body[X], body[Y], reach_x, reach_y, gait.radius, floor)
    for k in range(1, gait.substeps + 1):
        push_x = gait.walk_gain * (body[SERVO] + k * ramp_x)
        push_y = gait.walk_gain * (body[SERVO + 1] + k * ramp_y)
        torque = gait.turn_gain * (body[SERVO + 2] + k * ramp_turn)
        spring = gait.head_stiffness * (body[SERVO + 3] + k * ramp_pitch - body[PITCH])
        body[VX] = _driven(body[VX], push_x, gait.walk_gain, gait.walk_force, walk)
        body[VY] = _driven(body[VY], push_y, gait.walk_gain, gait.walk_force, walk)
        body[TURN_RATE] = _driven(body[TURN_RATE], torque, gait.turn_gain, gait.turn_force, turn)
        body[PITCH_RATE] = _driven(body[PITCH_RATE], spring, gait.head_damping, gait.head_force, head)
        if free:
            body[X] += h * body[VX]
            body[Y] += h * body[VY]
        else:
            slide(body, h, gait.radius, floor)
        body[HEADING] += h * body[TURN_RATE]
        body[PITCH] += h * body[PITCH_RATE]
    body[SERVO], body[SERVO + 1], body[SERVO + 2], body[SERVO + 3] = to_x, to_y, to_turn, to_pitch


@kernel
def _servo(mass: float, damping: float, h: float) -> tuple[float, float, float]:
    """Return the share of speed that remains after a step, and the speed per force, damped and undamped."""
    return mass / (mass + h * damping), h / (mass + h * damping), h / mass


@kernel
def _driven(
    speed: float, push: float, damping: float, limit: float, servo: tuple[float, float, float]
) -> float:
    """Return the speed after a step. Damping is integrated implicitly unless the force is at its limit."""
    force = push - damping * speed
    if force > limit or force < -limit:
        return speed + servo[2] * min(limit, max(-limit, force))
    return servo[0] * speed + servo[1] * push
