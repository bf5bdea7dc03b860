"""From walking without physics into physics, and back."""

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.fidelity.body_state import FORWARD, HEADING, SERVO, TURN_RATE, VX, VY, X, Y
from mjsim.fidelity.full import Full
from mjsim.fidelity.kinematic_steps import BODY, HAND_SPEEDS, HANDS, HOLDS
from mjsim.fidelity.kinematic_world import Walker
from mjsim.person.rig import RigState


def enter(full: Full, walker: Walker) -> None:
    """Set the physics to the state of a walk: velocities, commands, welds and sleep included."""
    model, data, person, live = full.scene.model, full.data, full.person, walker.live
    body = live[BODY:HANDS]
    mujoco.mj_resetData(model, data)
    walker.write(data)
    rig = person.rig
    rig.rates[:4], rig.rates[4:] = body[4:8], live[HAND_SPEEDS:HOLDS]
    hands = live[HANDS:HAND_SPEEDS]
    targets = hands.reshape(2, 3)
    rig.set_state(RigState(body[FORWARD:SERVO], targets, targets, np.concatenate((body[SERVO:], hands))))
    person.hand_velocities = live[HAND_SPEEDS:HOLDS].reshape(2, 3).copy()
    full.carrying.reset()
    person.grips.reset()
    for hand, hold in enumerate(walker.holds):
        if hold is not None:
            person.grips.close(hand, *hold)
            _set_velocity(full, hand, hold[0], body, live)
    mujoco.mj_makeM(model, data)  # of what will sleep, too: something may wake it in the middle of a step
    mujoco.mj_factorM(model, data)
    _put_to_sleep(data, walker)
    mujoco.mj_forward(model, data)
    full.monitor.resume()


def _set_velocity(
    full: Full, hand: int, item: int, body: NDArray[np.float64], live: NDArray[np.float64]
) -> None:
    """Let a held object move as its hand does."""
    data, dof = full.data, int(full.scene.index.dofs[item])
    c, s = np.cos(body[HEADING]), np.sin(body[HEADING])
    forward, left, up = live[HAND_SPEEDS + 3 * hand : HAND_SPEEDS + 3 * hand + 3]
    address = int(full.scene.index.qpos[item])
    x, y = data.qpos[address : address + 2] - body[[X, Y]]
    rate = body[TURN_RATE]
    data.qvel[dof] = body[VX] - rate * y + c * forward - s * left
    data.qvel[dof + 1] = body[VY] + rate * x + s * forward + c * left
    data.qvel[dof + 2] = up
    # Angular velocities of free joints are in the body's own frame.
    data.qvel[dof + 3 : dof + 6] = data.xmat[full.scene.index.bodies[item]].reshape(3, 3)[2] * rate


def _put_to_sleep(data: mujoco.MjData, walker: Walker) -> None:
    """Mark what is at rest; takes effect with the next forward pass.

    The engine looks at its list of what sleeps only when something wakes: so the person is made to wake.
    """
    data.tree_asleep[:] = walker.asleep
    data.tree_awake[:] = data.tree_asleep < 0
    data.tree_asleep[walker.person_tree] = walker.person_tree
    data.tree_awake[walker.person_tree] = 1


def leave(full: Full, walker: Walker) -> None:
    """Let a walk go on from physics: what is held is put in line with its hand, all else stands still."""
    walker.take_over(full.data, full.person.grips.get_state())
