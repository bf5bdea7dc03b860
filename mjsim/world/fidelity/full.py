"""Fidelity `full`, in which all movements of the person and the objects are simulated by physics.

MuJoCo's timers are turned off, because they would take a twentieth of a trial's computing time.
"""

import functools
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.scene import avatar
from mjsim.house.scene.avatar import LEFT, RIGHT
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import c_function
from mjsim.values.actions import IDLE, ActionResult, Move, Pick, Place, StepAction
from mjsim.values.errors import ActionError, StateError
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.options import WorldOptions
from mjsim.world.body.carrying import Carrying
from mjsim.world.body.feasibility import resolve_pick, resolve_place
from mjsim.world.body.grips import Grips
from mjsim.world.body.hand_motions import pick, place
from mjsim.world.body.person import Motion, Person
from mjsim.world.body.rig import Rig
from mjsim.world.fidelity.tier import EpisodeState, Tier
from mjsim.world.health.monitor import Health, HealthMonitor, HealthSample
from mjsim.world.state import PersonState, StateHash, WorldState, set_physics, take_physics

# Distance in metres by which other objects may push a delivered object out of its receptacle's volume.
_DISLODGED_MARGIN = 0.03


def stop_engine_clock() -> None:
    """Stop MuJoCo's timers (`MjData.timer`) in this process, unless a custom clock is set.

    To start the timers again, call `mujoco.set_mjcb_time(None)`.
    """
    if mujoco.get_mjcb_time() is None:
        mujoco.set_mjcb_time(_no_time().ctypes)


@functools.cache
def _no_time() -> Any:
    return c_function("float64()", _zero)


def _zero() -> float:
    return 0.0


@dataclass(frozen=True, eq=False)
class _Motion:
    steps: Motion
    action: Pick | Place
    hand: int
    item: int
    receptacle: str | None


class Full(Tier):
    """A physics simulation of the person and all objects. `Event` reuses parts of it."""

    def __init__(self, scene: Scene, options: WorldOptions) -> None:
        stop_engine_clock()
        self.scene = scene
        self.data = mujoco.MjData(scene.model)
        self.episode_state = EpisodeState(scene)
        rig = Rig(scene, self.data, options.control_timestep)
        grips = Grips(scene, self.data, rig)
        self.person = Person(scene, options, self.data, rig, grips, held=self.episode_state.held)
        self.monitor = HealthMonitor(scene, options, rig, grips)
        self.carrying = Carrying(self.person)
        self._motion: _Motion | None = None
        self._hash = StateHash(scene.model)

    @property
    def time(self) -> float:
        return float(self.data.time)

    @property
    def busy(self) -> bool:
        return self._motion is not None

    @property
    def body(self) -> NDArray[np.float64]:
        return self.person.rig.body_state

    @property
    def hands(self) -> NDArray[np.float64]:
        return self.person.rig.pose[4:].reshape(2, 3).copy()

    @property
    def health(self) -> Health:
        return self.monitor.snapshot()

    @property
    def health_sample(self) -> HealthSample:
        return self.monitor.sample

    def reset(self) -> None:
        mujoco.mj_resetData(self.scene.model, self.data)
        mujoco.mj_forward(self.scene.model, self.data)
        person = self.person
        person.rig.reset()
        person.grips.reset()
        self.monitor.reset()
        self.carrying.reset()
        self._end_motion()
        self.episode_state.reset()

    def step(self, action: StepAction) -> ActionResult | None:
        result = self.resolve(action, busy=self.busy)
        if result is not None and result.applied:
            self._begin(result)
        self.advance(action if isinstance(action, Move) else IDLE)
        return result

    def answer(self, action: Pick | Place) -> ActionResult:
        result = self.resolve(action, busy=self.busy)
        if result is None:
            raise ActionError(f"expected a Pick or Place, got {action!r}")
        return result

    def resolve(self, action: StepAction, *, busy: bool) -> ActionResult | None:
        """Return the result of a pick or place in the current state of the physics, or None for a move."""
        if isinstance(action, Move):
            return None
        if isinstance(action, Pick):
            return resolve_pick(self.person, action, self.episode_state.status, busy=busy)
        if isinstance(action, Place):
            return resolve_place(self.person, action, busy=busy)
        raise ActionError(f"expected a Move, Pick or Place, got {action!r}")

    def hand_for(self, result: ActionResult) -> tuple[int, int]:
        """Return the hand and the object of an action. If both hands are free, a pick uses the nearer one."""
        item = self.scene.index.position_of(str(result.object))
        if isinstance(result.action, Place):
            return self.episode_state.held.index(item), item
        free = self.person.free_hands
        if len(free) == 1:
            return free[0], item
        return LEFT if self.person.rig.to_body(self.person.center(item))[1] > 0.0 else RIGHT, item

    def _begin(self, result: ActionResult) -> None:
        hand, item = self.hand_for(result)
        pitch = self.person.rig.pitch_target
        if isinstance(result.action, Pick):
            steps = pick(self.person, hand, item, self.carrying.carry_position, pitch)
        else:
            steps = place(self.person, hand, item, self.scene.receptacles[str(result.receptacle)], pitch)
        self._motion = _Motion(steps, result.action, hand, item, result.receptacle)

    def advance(self, move: Move) -> None:
        """Simulate one control step of a walk or motion. Raise a PhysicsError if the simulation fails."""
        self.episode_state.events = []
        if self._motion is None:
            self.person.walk(move)
        else:
            self._run_motion(self._motion)
        self.carrying.update(self._held_posture())
        self.person.advance()
        for kind, item in self.monitor.check(self.person.held):
            self.episode_state.report(self.time, kind, item)
        self._release_slipped()
        for item in self.dislodged():
            self.episode_state.dislodged(self.time, item)

    def observation(self) -> Observation:
        rig, objects = self.person.rig, self.scene.index.poses(self.data.qpos)
        return self.episode_state.observation(self.time, rig.pose[:4], rig.rates[:2], objects, busy=self.busy)

    def state_hash(self) -> int:
        return self._hash.of(self.data)

    def state(self) -> WorldState:
        person = self.person
        commands = PersonState(
            rig=person.rig.get_state(),
            grips=person.grips.get_state(),
            carrying=self.carrying.get_state(),
            hand_velocities=person.hand_velocities.copy(),
        )
        details = self.episode_state.details(self.monitor.get_state(), commands)
        return WorldState(take_physics(self.scene.model, self.data), details)

    def restore(self, state: WorldState) -> None:
        person, commands = self.person, state.details.person
        if commands is None:
            raise StateError(
                "a state without physics does not fit the tier `full`; a state fits its own tier"
            )
        set_physics(self.scene.model, self.data, state.physics)
        self._end_motion()
        self.episode_state.restore(state.details)
        self.monitor.set_state(state.details.health)
        person.rig.set_state(commands.rig)
        person.grips.set_state(commands.grips)
        person.hand_velocities[:] = commands.hand_velocities
        self.carrying.set_state(commands.carrying)

    def dislodged(self) -> list[int]:
        if self.is_settled:
            return []
        return [
            item
            for item, status in enumerate(self.episode_state.status)
            if status is ObjectStatus.DELIVERED and not self.person.asleep(item) and not self._in_place(item)
        ]

    @property
    def is_settled(self) -> bool:
        """True if all objects except the held ones are asleep."""
        return bool(self.data.ntree_awake == 1 + len(self.person.grips.gripped))

    def poses(self) -> NDArray[np.float64]:
        """Return the poses of all objects (metres and wxyz), shape (n, 7)."""
        return np.array(self.data.qpos[self.scene.index.qpos[:, None] + np.arange(7)])

    def _in_place(self, item: int) -> bool:
        key = self.scene.episode.targets[self.scene.index.names[item]]
        return self.scene.receptacles[key].contains(self.person.center(item), _DISLODGED_MARGIN)

    def _run_motion(self, motion: _Motion) -> None:
        try:
            next(motion.steps)
            return
        except StopIteration as finished:
            success = bool(finished.value)
        self._end_motion()
        if isinstance(motion.action, Pick):
            self.episode_state.picked(self.time, motion.hand, motion.item, success)
        else:
            self.episode_state.placed(self.time, motion.item, motion.receptacle, success)

    def _end_motion(self) -> None:
        self.person.hand_velocities[:] = 0.0
        self._motion = None
        self.person.moving_hand = None

    def _held_posture(self) -> tuple[float, float, float]:
        """Return the posture of loaded hands while the person walks, turns or reaches with the other hand."""
        if self._motion is None:
            return avatar.CARRY
        return avatar.TUCKED if self.person.moving_hand is None else avatar.ASIDE

    def _release_slipped(self) -> None:
        motion = self._motion
        for hand in self.carrying.slipped():
            item = self.person.held[hand]
            if item is None:
                continue
            self.person.grips.open(hand)
            self.episode_state.lost(self.time, item)
            if motion is not None and motion.hand == hand:
                motion.steps.close()
                self._end_motion()
