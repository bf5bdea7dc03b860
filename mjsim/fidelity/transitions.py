"""From walking without physics into physics, and back."""

import mujoco
import numpy as np

from mjsim.fidelity.body_state import FORWARD, HEADING, SERVO, TURN_RATE, VX, VY, X, Y
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import GRASPS, HAND_SPEEDS, HANDS
from mjsim.fidelity.kinematic_world import KinematicWorld
from mjsim.person.rig import RigState


def enter(full: Full, kinematic: KinematicWorld) -> None:
    """Set the physics to a state without physics: velocities, commands, welds and sleep included."""
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
    mujoco.mj_makeM(model, data)  # of sleeping objects, too: one may wake in the middle of a step
    mujoco.mj_factorM(model, data)
    _put_to_sleep(data, kinematic)
    mujoco.mj_forward(model, data)
    full.monitor.resume()


def _set_velocity(full: Full, kinematic: KinematicWorld, hand: int, item: int) -> None:
    """Let a held object move as its hand does."""
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
    # Angular velocities of free joints are in the body's own frame.
    data.qvel[dof + 3 : dof + 6] = data.xmat[full.scene.index.bodies[item]].reshape(3, 3)[2] * rate


def _put_to_sleep(data: mujoco.MjData, kinematic: KinematicWorld) -> None:
    """Mark everything that is at rest; takes effect with the next forward pass.

    The engine updates its list of sleeping trees only when something wakes, so the person is made to wake.
    """
    data.tree_asleep[:] = kinematic.asleep
    data.tree_awake[:] = data.tree_asleep < 0
    data.tree_asleep[kinematic.person_tree] = kinematic.person_tree
    data.tree_awake[kinematic.person_tree] = 1


def leave(full: Full, kinematic: KinematicWorld) -> None:
    """Continue without physics: held objects are put in line with their hands, all else stands still."""
    kinematic.continue_from(full.data, full.person.grips.get_state())
