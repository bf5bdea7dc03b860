"""Physics simulation of a falling object in an otherwise kinematic world."""

from collections.abc import Sequence
from dataclasses import dataclass

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.sites import ReceptacleGeometry
from mjsim.values.actions import EventKind
from mjsim.values.options import REST_STEPS
from mjsim.world.body.rig import FORWARD, HEADING, SERVO, TURN_RATE, VX, VY, RigState, X, Y
from mjsim.world.fidelity.full import Full
from mjsim.world.fidelity.kinematic_steps import GRASPS, HAND_SPEEDS, HANDS
from mjsim.world.fidelity.kinematic_world import KinematicWorld

# Maximum time for other objects to come to rest after the released object, in seconds.
_SETTLING_TIME = 1.0


@dataclass(frozen=True, eq=False)
class Fall:
    """The result of simulating the fall of a released object."""

    # Poses (metres and wxyz) of all objects after each control step of the fall, shape (k, n, 7).
    poses: NDArray[np.float64]
    rest: NDArray[np.float64]  # final poses of all objects, shape (n, 7)
    success: bool  # True if the released object is at rest in its receptacle
    incidents: tuple[tuple[int, EventKind, int], ...]  # control step, type and object index of other events


def drop(full: Full, kinematic: KinematicWorld, hand: int, item: int, receptacle: ReceptacleGeometry) -> Fall:
    """Simulate the fall of an object that a standing person releases. Sleeping objects wake up if touched.

    Afterwards, the hand in the kinematic world is empty, and the sleep states are updated.
    """
    person = full.person
    options = person.options
    _enter(full, kinematic)
    full.monitor.check(person.held)  # records when and where the hand last held the object
    person.grips.open(hand)
    kinematic.release(hand)
    held = [None if other == item else other for other in person.held]
    poses: list[NDArray[np.float64]] = []
    incidents: list[tuple[int, EventKind, int]] = []
    still, success = 0, False
    for step in range(person.steps(options.settle_time)):
        incidents += [(step, kind, which) for kind, which in _advance(full, held)]
        poses.append(full.poses())
        quiet = person.asleep(item) or person.speed(item) < options.settle_speed
        still = still + 1 if quiet else 0
        if still >= REST_STEPS:
            success = receptacle.contains(person.center(item), options.volume_margin)
            break
    for _ in range(person.steps(_SETTLING_TIME)):
        if full.is_settled:
            break
        incidents += [(len(poses), kind, which) for kind, which in _advance(full, held)]
    kinematic.asleep[:] = full.data.tree_asleep
    return Fall(np.array(poses), full.poses(), success, tuple(incidents))


def _advance(full: Full, held: Sequence[int | None]) -> list[tuple[EventKind, int]]:
    if not full.is_settled:
        full.person.advance()
    events = list(full.monitor.check(held))
    return events + [(EventKind.DISLODGED, item) for item in full.dislodged()]


def _enter(full: Full, kinematic: KinematicWorld) -> None:
    """Copy the kinematic state to the physics, including velocities, commands, welds and sleep states."""
    model, data, person = full.scene.model, full.data, full.person
    body, vector = kinematic.body, kinematic.state.vector
    hands, hand_speeds = vector[HANDS:HAND_SPEEDS], vector[HAND_SPEEDS:GRASPS]
    mujoco.mj_resetData(model, data)
    kinematic.write(data)
    rig = person.rig
    rig.rates[:4], rig.rates[4:] = body[4:FORWARD], hand_speeds
    targets = hands.reshape(2, 3)
    rig.set_state(RigState(body[FORWARD:SERVO], targets, targets, np.concatenate((body[SERVO:], hands))))
    person.hand_velocities[:] = hand_speeds.reshape(2, 3)
    full.carrying.reset()
    person.grips.reset()
    for hand, grasp in enumerate(kinematic.grasps):
        if grasp is not None:
            person.grips.close(hand, *grasp)
            _set_velocity(full, kinematic, hand, grasp[0])
    mujoco.mj_makeM(model, data)  # includes sleeping objects, which may wake up during a step
    mujoco.mj_factorM(model, data)
    _put_to_sleep(data, kinematic)
    mujoco.mj_forward(model, data)
    full.monitor.resume()


def _set_velocity(full: Full, kinematic: KinematicWorld, hand: int, item: int) -> None:
    data, body, dof = full.data, kinematic.body, int(full.scene.index.dofs[item])
    c, s = np.cos(body[HEADING]), np.sin(body[HEADING])
    first = HAND_SPEEDS + 3 * hand
    forward, left, up = kinematic.state.vector[first : first + 3]
    address = int(full.scene.index.qpos[item])
    x, y = data.qpos[address : address + 2] - body[[X, Y]]
    rate = body[TURN_RATE]
    data.qvel[dof] = body[VX] - rate * y + c * forward - s * left
    data.qvel[dof + 1] = body[VY] + rate * x + s * forward + c * left
    data.qvel[dof + 2] = up
    # The angular velocity of a free joint is relative to the body's own frame.
    data.qvel[dof + 3 : dof + 6] = data.xmat[full.scene.index.bodies[item]].reshape(3, 3)[2] * rate


def _put_to_sleep(data: mujoco.MjData, kinematic: KinematicWorld) -> None:
    """Put all kinematic trees that are at rest to sleep. This takes effect in the next forward pass.

    MuJoCo updates its list of sleeping trees only when a tree wakes up, so the person's tree is woken.
    """
    data.tree_asleep[:] = kinematic.asleep
    data.tree_awake[:] = data.tree_asleep < 0
    data.tree_asleep[kinematic.person_tree] = kinematic.person_tree
    data.tree_awake[kinematic.person_tree] = 1
