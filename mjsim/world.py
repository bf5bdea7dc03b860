"""The world: one person, one house, stepped at a fixed control rate with contact physics."""

import json
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np
from numpy.typing import ArrayLike

from mjsim import avatar
from mjsim.actions import IDLE, Action, ActionResult, EventKind, Move, Pick, Place, WorldEvent
from mjsim.carrying import Carrying
from mjsim.errors import ActionError, PhysicsError, StateError
from mjsim.grips import Grips
from mjsim.health import Health, HealthSample
from mjsim.inventory import LEFT, RIGHT, Inventory
from mjsim.monitoring import HealthMonitor
from mjsim.observation import ObjectStatus, Observation
from mjsim.options import WorldOptions
from mjsim.person import Motion, Person
from mjsim.picking import pick
from mjsim.placing import place
from mjsim.recording import StateHash, WorldState, set_physics, take_physics
from mjsim.rig import Rig
from mjsim.rules import resolve_pick, resolve_place
from mjsim.scene import Scene
from mjsim.stretch import Stretch

# A delivered object may be shoved a little by the next one; farther out than this it is out.
_DISLODGED_MARGIN = 0.03


@dataclass(frozen=True, eq=False)
class StepResult:
    """What one control step brought.

    Attributes:
        observation: State after the step.
        result: Answer to a pick or place, None for a move.
        events: What happened in the physics during the step.
    """

    observation: Observation
    result: ActionResult | None
    events: tuple[WorldEvent, ...]


@dataclass(frozen=True, eq=False)
class _Motion:
    """A pick or place under way."""

    steps: Motion
    action: Pick | Place
    hand: int
    item: int
    receptacle: str | None


class World:
    """A running episode.

    While a pick or place is under way (`Observation.busy`) the person's body belongs to it: a `Move` is ignored,
    another `Pick` or `Place` is refused. A refused action leaves the world exactly as `IDLE` would.

    Attributes:
        scene: What runs; its model is never modified.
        options: The rules.
        data: The state, for rendering; treat it as read-only.
    """

    def __init__(self, scene: Scene, options: WorldOptions | None = None) -> None:
        """Start at the episode's beginning.

        Raises:
            AssetError: The scene has no person, or an object lacks a grip site.
            PhysicsError: The control step is not a multiple of the model's timestep.
        """
        self.scene = scene
        self.options = options or WorldOptions()
        _check_timestep(scene.model, self.options.control_timestep)
        self.data = mujoco.MjData(scene.model)
        rig = Rig(scene, self.data, self.options.control_timestep)
        grips = Grips(scene, self.data, rig)
        monitor = HealthMonitor(scene, self.options, rig, grips)
        self._person = Person(scene, self.options, self.data, rig, grips, monitor)
        self._carrying = Carrying(self._person)
        self._motion: _Motion | None = None
        self._hash = StateHash(scene.model)
        self.reset()

    @property
    def model(self) -> mujoco.MjModel:
        """The compiled model."""
        return self.scene.model

    @property
    def control_timestep(self) -> float:
        """Simulated time of one `step`, s."""
        return self.options.control_timestep

    @property
    def health(self) -> Health:
        """Extremes of the physics since the last reset."""
        return self._person.monitor.snapshot()

    @property
    def health_sample(self) -> HealthSample:
        """What the physics was like in the latest control step."""
        return self._person.monitor.sample

    @property
    def busy(self) -> bool:
        """Whether a pick or place is under way."""
        return self._motion is not None

    def reset(self) -> Observation:
        """Return to the episode's beginning; the same actions then lead to bit-identical states."""
        mujoco.mj_resetData(self.model, self.data)
        mujoco.mj_forward(self.model, self.data)
        person = self._person
        person.rig.reset()
        person.grips.reset()
        person.monitor.reset()
        person.hand_velocities = np.zeros((2, 3))
        self._carrying.reset()
        self._end_motion()
        self._events: list[WorldEvent] = []
        self._set_inventory(Inventory())
        self._status = [ObjectStatus.LOOSE] * len(self.scene.index.names)
        return self.observation()

    def state_hash(self) -> int:
        """64 bits that differ whenever the state of the physics differs (up to chance)."""
        return self._hash.of(self.data)

    def state(self) -> WorldState:
        """Everything from which `restore` goes on, as a value.

        Raises:
            StateError: A pick or place is under way.
        """
        if self.busy:
            raise StateError(
                f"the world is busy at t = {self.data.time:.2f} s; take its state between motions"
            )
        person = self._person
        memory: dict[str, Any] = {
            "rig": person.rig.memory(),
            "grips": person.grips.memory(),
            "carrying": self._carrying.memory(),
            "health": person.monitor.memory(),
            "hand_velocities": person.hand_velocities.tolist(),
            "hands": list(self._inventory.hands),
            "status": [status.value for status in self._status],
        }
        return WorldState(take_physics(self.model, self.data), json.dumps(memory))

    def restore(self, state: WorldState) -> Observation:
        """Go on from a state, of this world or of another one of the same scene and options.

        The physics is reset on the way, so the world that the state was taken from goes on in the very same
        way only if it is restored, too (`mjsim.recording`).

        Raises:
            StateError: The state does not fit the scene.
        """
        person = self._person
        set_physics(self.model, self.data, state.physics)
        self._end_motion()
        self._events = []
        try:
            memory = json.loads(state.memory)
            person.monitor.recall(memory["health"])
            person.rig.recall(memory["rig"])
            person.grips.recall(memory["grips"])
            person.hand_velocities = np.array(memory["hand_velocities"])
            self._carrying.recall(memory["carrying"])
            self._set_inventory(Inventory(*memory["hands"]))
            self._status = [ObjectStatus(value) for value in memory["status"]]
        except (KeyError, TypeError, ValueError) as error:
            raise StateError(f"the state's memory does not fit this version's worlds: {error!r}") from error
        return self.observation()

    def step(self, action: Action) -> StepResult:
        """Advance by one control step.

        Raises:
            ActionError: `action` is not an action.
            PhysicsError: MuJoCo warned or the state is not finite; call `reset` before stepping on.
        """
        result = self._answer(action)
        move = action if isinstance(action, Move) else IDLE
        self._events = []
        if self._motion is None:
            self._person.walk(move)
        else:
            self._run_motion(self._motion)
        self._carrying.update(self._held_posture())
        self._person.rig.advance()
        for kind, item in self._person.monitor.check(self._person.held):
            self._report(kind, item)
        self._watch_grips()
        self._watch_deliveries()
        return StepResult(self.observation(), result, tuple(self._events))

    def walk(self, moves: ArrayLike) -> Stretch:
        """Take one control step per row, as `step(Move(*row))` would; stops early after a step with events.

        Args:
            moves: Columns forward, left (m/s), turn and look (rad/s), shape (n, 4).

        Raises:
            ActionError: A pick or place is under way, or the moves have another shape or are not finite.
            PhysicsError: As in `step`.
        """
        rows = np.asarray(moves, dtype=np.float64)
        if self.busy:
            raise ActionError("a pick or place is under way; `finish` it before walking")
        if rows.ndim != 2 or rows.shape[1] != 4 or not np.isfinite(rows).all():
            raise ActionError(f"moves must be finite numbers of shape (n, 4), got shape {rows.shape}")
        return self._stretch(Move(*row) for row in rows.tolist())

    def finish(self) -> Stretch:
        """Step with `IDLE` until no pick or place is under way; no step at all when none is.

        As `walk`, it stops early after a step with events; where one happened besides, the world is busy still.

        Raises:
            PhysicsError: As in `step`.
        """
        return self._stretch(iter(lambda: IDLE if self.busy else None, None))

    def _stretch(self, actions: Iterable[Action]) -> Stretch:
        observations: list[Observation] = []
        hashes: list[int] = []
        health: list[tuple[float, ...]] = []
        events: tuple[WorldEvent, ...] = ()
        for action in actions:
            result = self.step(action)
            observations.append(result.observation)
            hashes.append(self.state_hash())
            health.append(self.health_sample.row)
            events = result.events
            if events:
                break
        last = observations[-1] if observations else self.observation()
        return Stretch.of(observations, hashes, last, events, health)

    def observation(self) -> Observation:
        """The present state."""
        rig, index = self._person.rig, self.scene.index
        positions, quaternions = index.poses(self.data.qpos)
        return Observation(
            time=float(self.data.time),
            position=rig.position,
            heading=rig.heading,
            pitch=rig.pitch,
            eye=rig.eye,
            velocity=rig.planar_velocity,
            object_names=index.names,
            object_positions=positions,
            object_quaternions=quaternions,
            object_status=tuple(self._status),
            hands=self._inventory.hands,
            busy=self.busy,
        )

    def _answer(self, action: Action) -> ActionResult | None:
        """Answer a pick or place and begin its motion if it is feasible."""
        person = self._person
        if isinstance(action, Move):
            return None
        if isinstance(action, Pick):
            result = resolve_pick(person, action, self._inventory, self._status, busy=self.busy)
        elif isinstance(action, Place):
            result = resolve_place(person, action, self._inventory, busy=self.busy)
        else:
            raise ActionError(f"expected a Move, Pick or Place, got {action!r}")
        if result.applied and result.object is not None:
            item = self.scene.index.position_of(result.object)
            self._motion = self._begin(action, item, result)
        return result

    def _begin(self, action: Pick | Place, item: int, result: ActionResult) -> _Motion:
        person = self._person
        if isinstance(action, Pick):
            hand = self._hand_for(item)
            return _Motion(
                pick(person, hand, item, self._carrying.place_for), action, hand, item, result.receptacle
            )
        hand = person.held.index(item)
        receptacle = self.scene.receptacles[str(result.receptacle)]
        return _Motion(place(person, hand, item, receptacle), action, hand, item, receptacle.key)

    def _hand_for(self, item: int) -> int:
        """The free hand, or of two the one on the object's side."""
        free = self._inventory.free_hands
        if len(free) == 1:
            return free[0]
        return LEFT if self._person.rig.to_body(self._person.center(item))[1] > 0.0 else RIGHT

    def _run_motion(self, motion: _Motion) -> None:
        try:
            next(motion.steps)
            return
        except StopIteration as finished:
            success = bool(finished.value)
        self._end_motion()
        name = self.scene.index.names[motion.item]
        if isinstance(motion.action, Pick):
            if success:
                self._set_inventory(self._inventory.take(motion.hand, name))
                self._status[motion.item] = ObjectStatus.CARRIED
            self._report(EventKind.PICKED if success else EventKind.PICK_FAILED, motion.item)
            return
        if name in self._inventory.carried:
            self._set_inventory(self._inventory.release(name))
        self._status[motion.item] = ObjectStatus.DELIVERED if success else ObjectStatus.LOOSE
        kind = EventKind.PLACED if success else EventKind.PLACE_FAILED
        self._report(kind, motion.item, motion.receptacle)

    def _end_motion(self) -> None:
        self._person.hand_velocities[:] = 0.0
        self._motion = None
        self._person.moving_hand = None

    def _held_posture(self) -> tuple[float, float, float]:
        """Held things are drawn in to turn, and kept out of the way of a reaching hand."""
        if self._motion is None:
            return avatar.CARRY
        return avatar.TUCKED if self._person.moving_hand is None else avatar.ASIDE

    def _watch_grips(self) -> None:
        motion = self._motion
        for hand, item in enumerate(self._person.held):
            if item is None or not self._carrying.slipped(hand):
                continue
            self._person.grips.open(hand)
            self._set_inventory(self._inventory.release(self.scene.index.names[item]))
            self._status[item] = ObjectStatus.LOOSE
            self._report(EventKind.GRIP_LOST, item)
            if motion is not None and motion.hand == hand:
                motion.steps.close()
                self._end_motion()

    def _watch_deliveries(self) -> None:
        for item, status in enumerate(self._status):
            if status is not ObjectStatus.DELIVERED or self._person.asleep(item):
                continue
            key = self.scene.episode.targets[self.scene.index.names[item]]
            if not self.scene.receptacles[key].contains(self._person.center(item), _DISLODGED_MARGIN):
                self._status[item] = ObjectStatus.LOOSE
                self._report(EventKind.DISLODGED, item, key)

    def _report(self, kind: EventKind, item: int, receptacle: str | None = None) -> None:
        name = self.scene.index.names[item]
        self._events.append(WorldEvent(float(self.data.time), kind, name, receptacle))

    def _set_inventory(self, inventory: Inventory) -> None:
        self._inventory = inventory
        position = self.scene.index.position_of
        self._person.held = [None if name is None else position(name) for name in inventory.hands]


def _check_timestep(model: mujoco.MjModel, control_timestep: float) -> None:
    ratio = control_timestep / model.opt.timestep
    if round(ratio) < 1 or not np.isclose(ratio, round(ratio), rtol=0, atol=1e-9):
        raise PhysicsError(
            f"control step {control_timestep} s is not a whole multiple of the model's timestep "
            f"{model.opt.timestep} s; choose one that is"
        )
