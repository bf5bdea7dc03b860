"""Walking without physics: the person's servos and trunk as numba kernels, one control step at a time.

A body is one array of `BODY_SIZE` numbers, laid out by the indices of `body_state`. Any numba kernel may step it:

    @kernel
    def ten_steps_ahead(body, gait, floor):
        for _ in range(10):
            walk(body, 1.4, 0.0, 0.3, 0.0, gait, floor)  # forward m/s, left m/s, turn rad/s, look rad/s

    body = standing(x, y, heading, pitch)
    ten_steps_ahead(body, Gait.of(scene, WorldOptions()), Floor.of(scene.model, scene.person.body_radius))

`walk` changes `body` in place and returns nothing. It slews the commands as `Person.walk` does, then lets the four
servos follow them in steps of the physics, with the masses, gains and force limits of the compiled model. The trunk
is a disc that slides along the outlines of the house and never enters them. Loose objects are no obstacles.
"""

import math
from typing import NamedTuple

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.fidelity.body_state import (
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
from mjsim.fidelity.trunk_contact import Floor, is_free, slide
from mjsim.kernels import kernel
from mjsim.model import avatar
from mjsim.model.scene import Scene
from mjsim.options import WorldOptions
from mjsim.person import rate_limits


class Gait(NamedTuple):
    """Limits of walking and the servos that carry it out; SI units.

    Attributes:
        max_speed, max_turn, max_look, acceleration, turn_acceleration: Those of the person: `fastest_walk`,
            `turning_speed`, `looking_speed`, `walking_acceleration` and `turning_acceleration`.
        dt: Control step.
        substeps: Physics steps in it.
        mass, walk_gain, walk_force: What x and y move, the gain of their velocity servos, and their force limit.
        inertia, turn_gain, turn_force: Of the yaw's velocity servo.
        head_inertia, head_stiffness, head_damping, head_force: Of the head's position servo.
        lowest, highest: Range of the head's pitch.
        radius: Radius of the trunk.
        eye_height, eye_forward: Of the eye above the floor, and in front of the body's axis.
    """

    max_speed: float
    max_turn: float
    max_look: float
    acceleration: float
    turn_acceleration: float
    dt: float
    substeps: int
    mass: float
    walk_gain: float
    walk_force: float
    inertia: float
    turn_gain: float
    turn_force: float
    head_inertia: float
    head_stiffness: float
    head_damping: float
    head_force: float
    lowest: float
    highest: float
    radius: float
    eye_height: float
    eye_forward: float

    @classmethod
    def of(cls, scene: Scene, options: WorldOptions) -> "Gait":
        """Read a compiled scene with a person."""
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


class LocomotionState(NamedTuple):
    """Everything that walking without physics depends on, for kernels that roll it out.

    Attributes:
        body: The body now, shape (BODY_SIZE,); copy it before stepping it.
        gait: Limits and servos.
        floor: Outlines that the trunk meets.
    """

    body: NDArray[np.float64]
    gait: "Gait"
    floor: "Floor"


@kernel
def walk(
    body: NDArray[np.float64], forward: float, left: float, turn: float, look: float, gait: Gait, floor: Floor
) -> None:
    """One control step of a body, shape (BODY_SIZE,), as `Move(forward, left, turn, look)` asks, m/s and rad/s."""
    command(body, forward, left, turn, look, gait)
    advance(body, gait, floor)


@kernel
def command(
    body: NDArray[np.float64], forward: float, left: float, turn: float, look: float, gait: Gait
) -> None:
    """Slew the commands towards those of `Move(forward, left, turn, look)`, m/s and rad/s.

    `advance` carries them out. The body has the shape (BODY_SIZE,).
    """
    motion = body[FORWARD:SERVO]
    rate_limits.change_velocity(motion, forward, left, gait.max_speed, gait.acceleration * gait.dt)
    rate_limits.change_turn_rate(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)
    rate_limits.change_pitch(motion, look, gait.max_look, gait.lowest, gait.highest, gait.dt)


@kernel
def brake(body: NDArray[np.float64], turn: float, gait: Gait) -> None:
    """Slew the walk of a body, shape (BODY_SIZE,), to a stand and its yaw rate towards `turn`, rad/s."""
    motion = body[FORWARD:SERVO]
    rate_limits.change_velocity(motion, 0.0, 0.0, gait.max_speed, gait.acceleration * gait.dt)
    rate_limits.change_turn_rate(motion, turn, gait.max_turn, gait.turn_acceleration * gait.dt)


@kernel
def look_at(body: NDArray[np.float64], pitch: float, gait: Gait) -> None:
    """Command a pitch of the head, rad, kept within what a neck can do; body of shape (BODY_SIZE,)."""
    body[LOOK] = min(gait.highest, max(gait.lowest, pitch))


@kernel
def advance(body: NDArray[np.float64], gait: Gait, floor: Floor) -> None:
    """One control step of the servos, ramped from the last commands to the present ones, and of the trunk.

    The body has the shape (BODY_SIZE,).
    """
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
    # No servo overshoots what it was told before or is told now.
    reach_x = gait.radius + gait.dt * max(abs(body[VX]), abs(body[SERVO]), abs(to_x))
    reach_y = gait.radius + gait.dt * max(abs(body[VY]), abs(body[SERVO + 1]), abs(to_y))
    free = is_free(body[X], body[Y], reach_x, reach_y, gait.radius, floor)
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
    """Share of its speed that a servo keeps in a physics step, speed per force damped, and undamped."""
    return mass / (mass + h * damping), h / (mass + h * damping), h / mass


@kernel
def _driven(
    speed: float, push: float, damping: float, limit: float, servo: tuple[float, float, float]
) -> float:
    """Speed after a step under the force `push - damping * speed`, implicit in the damping unless saturated."""
    force = push - damping * speed
    if force > limit or force < -limit:
        return speed + servo[2] * min(limit, max(-limit, force))
    return servo[0] * speed + servo[1] * push
