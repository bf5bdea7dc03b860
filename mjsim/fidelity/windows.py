"""Physics while something is picked up or put away; in between the person walks without it."""

import json

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import IDLE, Action, ActionResult, Move
from mjsim.errors import StateError
from mjsim.fidelity.full import Full
from mjsim.fidelity.strides import BODY, HAND_SPEEDS, HANDS, HOLDS
from mjsim.fidelity.tier import by_steps
from mjsim.fidelity.walker import Walker
from mjsim.health import Health, HealthSample
from mjsim.kinematics import HEADING, SERVO, TURN_RATE, VX, VY, Legs, X, Y
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.recording import WorldState
from mjsim.scene import Scene
from mjsim.stretch import Stretch


class Windows:
    """The tier `windows`.

    A window opens with a pick or place that is feasible. The physics then starts from exactly the state of the
    walk: always from a reset, so that what happens in a window depends on that state alone. It closes at the first
    control step at which the motion has ended and everything that nobody holds sleeps or is slow.

    Attributes:
        ledger: Who holds what, what is put away, what happened in the latest control step.
    """

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        self._scene, self._options = scene, options
        self._full = Full(scene, options)
        self.ledger = self._full.ledger
        self._walker = Walker(scene, options, self._full.person.rig, self._full.carrying)
        self._open = False
        self._written = False

    @property
    def data(self) -> mujoco.MjData:
        """The state for rendering and rays."""
        self._write()
        return self._full.data

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._full.time if self._open else self._walker.time

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return self._full.busy

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        return self._full.health

    @property
    def health_sample(self) -> HealthSample:
        """What the physics was like in the latest control step."""
        return self._full.health_sample if self._open else self._walker.health_sample

    @property
    def legs(self) -> Legs | None:
        """What the walk depends on; None while physics moves the person."""
        return None if self._open else self._walker.legs

    def reset(self) -> None:
        """Return to the episode's beginning."""
        self._full.reset()
        self._walker.reset(self._full.data)
        self._open, self._written = False, False

    def step(self, action: Action) -> ActionResult | None:
        """Advance by one control step."""
        if self._open:
            result = self._full.step(action)
            self._close_if_calm()
            return result
        result = None
        if not isinstance(action, Move):
            self._write()
            result = self._full.resolve(action, busy=False)
        if result is None or not result.applied:
            self.ledger.events = []
            self._written = False
            self._walker.step(action if isinstance(action, Move) else IDLE)
            return result
        self._enter_physics()
        self._full.begin(result)
        self._full.advance(IDLE)
        return result

    def walk(self, moves: NDArray[np.float64]) -> Stretch:
        """One control step per row (n, 4), until a step brings events."""
        if not self._open:
            self.ledger.events = []
            self._written = self._written and not len(moves)
            return self._walker.stretch(self._walker.rows(moves), self.ledger)
        steps = iter(moves.tolist())
        physical = by_steps(self, (Move(*next(steps)) for _ in moves if self._open))
        rest = moves[len(physical) :]
        if physical.events or not len(rest):
            return physical
        return physical.then(self.walk(rest))

    def finish(self) -> Stretch:
        """Idle until no pick or place is under way, or a step brings events."""
        return by_steps(self, iter(lambda: IDLE if self.busy else None, None))

    def observation(self) -> Observation:
        """The present state."""
        return self._full.observation() if self._open else self._walker.observation(self.ledger)

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return self._full.state_hash() if self._open else self._walker.state_hash()

    def state(self) -> WorldState:
        """Everything from which `restore` goes on."""
        if self._open:
            return self._full.state()
        memory = {"health": self._full.person.monitor.memory(), **self.ledger.memory()}
        return WorldState(self._walker.pack(), json.dumps(memory))

    def restore(self, state: WorldState) -> None:
        """Go on from a state.

        Raises:
            StateError: It does not fit.
        """
        try:
            memory = json.loads(state.memory)
            self._open = "rig" in memory
            if self._open:
                self._full.restore(state)
                return
            self._full.reset()
            self._walker.unpack(state.physics)
            self.ledger.recall(memory)
            self._full.person.monitor.recall(memory["health"])
            self._written = False
        except (KeyError, TypeError, ValueError) as error:
            raise StateError(f"the state's memory does not fit this version's worlds: {error!r}") from error

    def _write(self) -> None:
        if not self._open and not self._written:
            self._walker.write(self._full.data)
            self._written = True

    def _enter_physics(self) -> None:
        """Let the physics go on from where the walk has come to."""
        enter(self._full, self._walker)
        self._open, self._written = True, False

    def _close_if_calm(self) -> None:
        full = self._full
        if full.busy:
            return
        loose = (i for i in range(len(self._scene.index.names)) if i not in self.ledger.held)
        if all(full.person.asleep(i) or full.person.speed(i) < self._options.settle_speed for i in loose):
            grips = full.person.grips.memory()
            self._walker.take_over(full.data, [None if g is None else (g[0], g[1]) for g in grips])
            self._open = False


def enter(full: Full, walker: Walker) -> None:
    """Set the physics to the state of a walk: velocities, commands, welds and sleep included."""
    model, data, person, live = full.scene.model, full.data, full.person, walker.live
    body = live[BODY:HANDS]
    mujoco.mj_resetData(model, data)
    walker.write(data)
    rig = person.rig
    rig.rates[:4], rig.rates[4:] = body[4:8], live[HAND_SPEEDS:HOLDS]
    hands = live[HANDS:HAND_SPEEDS].reshape(2, 3).tolist()
    rig.recall(
        {
            "motion": body[8:12].tolist(),
            "hand_targets": hands,
            "hand_targets_before": hands,
            "command": [*body[SERVO:].tolist(), *live[HANDS:HAND_SPEEDS].tolist()],
        }
    )
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
    person.monitor.resume()


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
