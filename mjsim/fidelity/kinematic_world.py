"""A household without physics: state, walking, and what a renderer or a ray needs of it."""

import math
from collections.abc import Sequence

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.actions import Move, WorldEvent
from mjsim.errors import StateError
from mjsim.fidelity.body_state import FORWARD, HEADING, LOOK, PITCH, VX, VY, X, Y
from mjsim.fidelity.episode_state import EpisodeState
from mjsim.fidelity.kinematic_steps import (
    BODY,
    HANDS,
    HOLDS,
    LIVE,
    TIME,
    KinematicModel,
    Rows,
    carry,
    state_hash,
    walk_rows,
)
from mjsim.fidelity.kinematics import Gait, LocomotionState
from mjsim.fidelity.motion_primitives import Script, play_rows
from mjsim.fidelity.trunk_contact import Floor
from mjsim.health.values import HealthSample
from mjsim.model import avatar
from mjsim.model.house import compiled_house
from mjsim.model.scene import Scene
from mjsim.observation import Observation
from mjsim.options import WorldOptions
from mjsim.person.carrying import Carrying
from mjsim.person.grips import AWAKE
from mjsim.person.postures import LOWEST, drawn_in
from mjsim.person.rig import Rig
from mjsim.rollout import Rollout

# An object that accelerates by more than this from rest is not at rest, m/s^2; gravity is 9.8, solver noise 1.
_RESTLESS = 3.0


class Walker:
    """One person and all objects, moved by `mjsim.fidelity.kinematic_steps`.

    Attributes:
        live: What changes from step to step, shape (LIVE,).
        poses: Poses of the objects, m and wxyz, shape (n, 7).
        asleep: Sleep state of each kinematic tree, as in `MjData.tree_asleep`: of what physics has left at rest.
        house: What does not change.
    """

    def __init__(self, scene: Scene, options: WorldOptions, rig: Rig, carrying: Carrying) -> None:
        self._model, self._index, self._rig = scene.model, scene.index, rig
        self._qpos = (scene.index.qpos[:, None] + np.arange(7)).ravel()
        self.person_tree = int(scene.model.body_treeid[rig.body])
        self.live = np.zeros(LIVE)
        self.poses = np.zeros((len(scene.index.names), 7))
        self.asleep = np.zeros(scene.model.ntree, np.int32)
        self.carry_posture = np.array(avatar.CARRY)
        distance, gradient, frame = carrying.field
        self.house = KinematicModel(
            gait=Gait.of(scene.model, options),
            floor=compiled_house(scene.catalogue).once(("floor",), lambda: Floor.of(scene.model)),
            grips=_grip_poses(scene),
            loads=carrying.loads,
            rest=np.array(avatar.REST),
            distance=distance,
            gradient=gradient,
            frame=frame,
            timestep=float(scene.model.opt.timestep),
            yields=np.zeros((2, 2)),
            goals=np.zeros((2, 3)),
        )

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return float(self.live[TIME])

    @property
    def pitch_target(self) -> float:
        """Where the head is told to look, rad."""
        return float(self.live[BODY + LOOK])

    @property
    def locomotion(self) -> LocomotionState:
        """What the walk depends on."""
        return LocomotionState(self.live[BODY:HANDS], self.house.gait, self.house.floor)

    @property
    def holds(self) -> list[tuple[int, int] | None]:
        """Object and grip that each hand holds."""
        return [None if hold < 0 else divmod(int(hold), 2) for hold in self.live[HOLDS:]]

    def hold(self, hand: int, item: int, grip: int) -> None:
        """Put an object into a hand, in line with it."""
        self.wake(item)
        self.live[HOLDS + hand] = 2 * item + grip
        carry(self.live, self.poses, self.house)

    def wake(self, item: int) -> None:
        """Wake an object and all that came to rest together with it."""
        tree = int(self._index.trees[item])
        while self.asleep[tree] >= 0:
            self.asleep[tree], tree = AWAKE, int(self.asleep[tree])

    def reset(self, data: mujoco.MjData) -> None:
        """Start from physics that was just reset and looked at once (`mj_forward`)."""
        self.take_over(data, [None, None])
        self.live[HANDS : HANDS + 6] = self._rig.hand_targets.ravel()
        push = np.abs(data.qacc) * self._model.dof_length
        trees = self._model.body_treeid[self._model.dof_bodyid]
        restless = np.zeros(self._model.ntree)
        np.maximum.at(restless, trees, push)
        calm = (restless < _RESTLESS) & (np.arange(len(restless)) != self.person_tree)
        self.asleep[calm] = np.flatnonzero(calm)

    def take_over(self, data: mujoco.MjData, holds: Sequence[tuple[int, int] | None]) -> None:
        """Go on from physics; what is held is put in line with its hand, all else stands still."""
        rig, body = self._rig, self.live[BODY:HANDS]
        self.live[TIME] = data.time
        body[:4], body[4:8] = rig.pose[:4], rig.rates[:4]
        body[8:12], body[12:16] = rig.motion, rig.get_state().command[:4]
        self.live[HANDS : HANDS + 6] = rig.hand_targets.ravel()
        self.live[HANDS + 6 : HOLDS] = 0.0
        self.live[HOLDS:] = [-1 if hold is None else 2 * hold[0] + hold[1] for hold in holds]
        self.poses[:] = data.qpos[self._qpos].reshape(-1, 7)
        carry(self.live, self.poses, self.house)
        self.asleep[:] = data.tree_asleep

    def write(self, data: mujoco.MjData) -> None:
        """Bring poses of bodies, geoms, sites and cameras in step, for rendering and rays."""
        model = self._model
        if data.ntree_awake < model.ntree:
            mujoco.mj_resetData(model, data)  # what sleeps does not follow its coordinates
        data.time = self.live[TIME]
        data.qpos[self._qpos] = self.poses.ravel()
        self._rig.pose[:4] = self.live[BODY : BODY + 4]
        self._rig.pose[4:] = self.live[HANDS : HANDS + 6]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)

    def place_for(self, hand: int, item: int) -> NDArray[np.float64]:
        """Where a hand best carries object `item`, clear of the house: body frame, m, (3,)."""
        forward, left, up = avatar.posture(hand, avatar.CARRY)
        body, house = self.live[BODY:HANDS], self.house
        radius, height = house.loads[item].tolist()
        place = drawn_in(
            forward, left, radius, body, body[FORWARD:], house.distance, house.gradient, house.frame
        )
        return np.array([*place, max(up, LOWEST + height)])

    def step(self, move: Move) -> None:
        """One control step."""
        self.rows(np.array([[move.forward, move.left, move.turn, move.look]]))

    def rows(self, moves: NDArray[np.float64]) -> Rows:
        """One control step per row (n, 4)."""
        rows = Rows.empty(len(moves), len(self.poses))
        walk_rows(moves, self.live, self.poses, self.carry_posture, self.house, rows)
        return rows

    def play(self, script: Script, start: int, end: int) -> Rows:
        """Go through control steps of a motion that was worked out before."""
        rows = Rows.empty(end - start, len(self.poses))
        play_rows(script, start, end, self.live, self.poses, rows)
        return rows

    def stretch(
        self,
        rows: Rows,
        episode_state: EpisodeState,
        *,
        busy: bool = False,
        events: Sequence[WorldEvent] = (),
    ) -> Rollout:
        """What rows that end in the present state amount to."""
        return Rollout(*rows, self.observation(episode_state, busy=busy), tuple(events))

    def observation(self, episode_state: EpisodeState, *, busy: bool = False) -> Observation:
        """The present state."""
        body = self.live[BODY:HANDS]
        x, y, heading, pitch = body[[X, Y, HEADING, PITCH]].tolist()
        poses = self.poses.copy()
        return Observation(
            time=self.time,
            position=np.array([x, y]),
            heading=heading,
            pitch=pitch,
            eye=np.array(avatar.eye_position(x, y, heading, pitch)),
            velocity=body[[VX, VY]],
            object_names=self._index.names,
            object_positions=poses[:, :3],
            object_quaternions=poses[:, 3:],
            object_status=tuple(episode_state.status),
            hands=episode_state.inventory.hands,
            busy=busy,
        )

    @property
    def health_sample(self) -> HealthSample:
        """What is held is in line with its hand, and nothing else touches anything."""
        left, right = (math.nan if hold < 0 else 0.0 for hold in self.live[HOLDS:].tolist())
        return HealthSample(weld_error_m=(left, right), weld_error_rad=(left, right))

    def state_hash(self) -> int:
        """64 bits that differ whenever the state differs (up to chance)."""
        return int(state_hash(self.live, self.poses))

    def pack(self) -> NDArray[np.float64]:
        """The whole state, shape (LIVE + 7 n + trees,)."""
        return np.concatenate((self.live, self.poses.ravel(), self.asleep))

    def unpack(self, values: NDArray[np.float64]) -> None:
        """Go on from what `pack` gave.

        Raises:
            StateError: It does not fit.
        """
        sizes = (LIVE, self.poses.size, len(self.asleep))
        if values.shape != (sum(sizes),) or not np.isfinite(values).all():
            raise StateError(
                f"a state of {values.size} numbers does not fit, {sum(sizes)} finite ones do; take it from a world of "
                "the same house, objects and fidelity"
            )
        live, poses, asleep = np.split(values, np.cumsum(sizes)[:2])
        sleepers = np.flatnonzero(asleep >= 0)
        if not np.array_equal(np.sort(asleep[sleepers]), sleepers):
            raise StateError("the state's sleeping objects do not form rings; take it from a world's `state`")
        self.live[:], self.poses[:], self.asleep[:] = live, poses.reshape(-1, 7), asleep


def _grip_poses(scene: Scene) -> NDArray[np.float64]:
    """Pose of each object in the frame of a hand that is in line with its grip 0 or 1, shape (n, 2, 7)."""
    model, names = scene.model, scene.index.names
    poses = np.zeros((len(names), 2, 7))
    for item, name in enumerate(names):
        for grip in avatar.GRIPS:
            site = model.site(f"{name}/grip_{grip}")
            pose = poses[item, grip]
            mujoco.mju_negPose(pose[:3], pose[3:], site.pos, site.quat)
    return poses
