"""A simulation that moves the person and the objects without physics, and copies their poses to MuJoCo."""

import functools
from collections.abc import Callable

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.compiled.footprint import Floor
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene import avatar
from mjsim.house.scene.avatar import LEFT
from mjsim.house.scene.scene import Scene
from mjsim.support.kernels import specialized
from mjsim.values.errors import StateError
from mjsim.values.observation import StepStates
from mjsim.values.options import WorldOptions
from mjsim.world.body.grips import AWAKE
from mjsim.world.body.rig import LOOK
from mjsim.world.fidelity.full import Full
from mjsim.world.fidelity.kinematic_steps import (
    BODY,
    GRASPS,
    HAND_SPEEDS,
    HANDS,
    STATE_SIZE,
    TIME,
    KinematicModel,
    KinematicState,
    carry,
    follow_rows,
    state_hash,
    walk_rows,
)
from mjsim.world.fidelity.kinematics import Gait
from mjsim.world.fidelity.motion_primitives import MotionTrajectory, play_rows
from mjsim.world.walking.path_following import Walk

# Acceleration in m/s^2 above which a motionless object is not at rest. Solver noise is about 1, gravity 9.8.
_REST_ACCELERATION = 3.0
MAX_ROWS = 256  # maximum number of control steps per call


class KinematicWorld:
    """A simulation that moves the person and the objects without physics.

    Attributes:
        state: Current state of the person and the objects.
        model: Constants of the simulation.
        asleep: Sleep state of each kinematic tree, as in `MjData.tree_asleep`.
    """

    def __init__(self, full: Full, options: WorldOptions) -> None:
        scene, carrying = full.scene, full.carrying
        self._model, self._index, self._rig = scene.model, scene.index, full.person.rig
        self._qpos = (scene.index.qpos[:, None] + np.arange(7)).ravel()
        self.person_tree = int(scene.model.body_treeid[self._rig.body])
        self.state = KinematicState(np.zeros(STATE_SIZE), np.zeros((len(scene.index.names), 7)))
        self.asleep = np.zeros(scene.model.ntree, np.int32)
        self.model = KinematicModel(
            gait=Gait.of(scene, options),
            floor=_floor(scene),
            grips=_grip_poses(scene),
            loads=carrying.loads,
            posture_pace=full.person.posture_pace,
            carrying=scene.person.carrying,
            postures=np.array(
                [
                    avatar.posture(LEFT, place, scene.person.eye_height)
                    for place in (avatar.REST, avatar.CARRY, avatar.TUCKED, avatar.ASIDE)
                ]
            ),
            clearance=full.person.clearance,
            timestep=float(scene.model.opt.timestep),
            compliance=np.zeros((2, 2)),
            goals=np.zeros((2, 3)),
        )
        self._body = self.state.vector[BODY:HANDS]
        self._rows = StepStates.empty(MAX_ROWS, len(scene.index.names))

    @property
    def time(self) -> float:
        return float(self.state.vector[TIME])

    @property
    def body(self) -> NDArray[np.float64]:
        """A view of the person's body state, shape (BODY_SIZE,)."""
        return self._body

    @property
    def hands(self) -> NDArray[np.float64]:
        """A view of the positions (2, 3) of the hands in the body frame, in metres."""
        return self.state.vector[HANDS:HAND_SPEEDS].reshape(2, 3)

    @property
    def pitch_target(self) -> float:
        return float(self._body[LOOK])

    @property
    def grasps(self) -> list[tuple[int, int] | None]:
        return [None if grasp < 0 else divmod(int(grasp), 2) for grasp in self.state.vector[GRASPS:]]

    def grasp(self, hand: int, item: int, grip: int) -> None:
        """Put an object into a hand, and align it with the hand."""
        self.wake(item)
        self.state.vector[GRASPS + hand] = 2 * item + grip
        carry(self.state, self.model)

    def release(self, hand: int) -> None:
        self.state.vector[GRASPS + hand] = -1

    def wake(self, item: int) -> None:
        """Wake an object and all objects that came to rest together with it."""
        tree = int(self._index.trees[item])
        while self.asleep[tree] >= 0:
            self.asleep[tree], tree = AWAKE, int(self.asleep[tree])

    def reset(self, data: mujoco.MjData) -> None:
        """Start from the state in `data`, for which `mj_forward` has been called after a reset."""
        rig, vector = self._rig, self.state.vector
        vector[TIME] = data.time
        self._body[:] = rig.body_state
        vector[HANDS:HAND_SPEEDS] = rig.hand_targets.ravel()
        vector[HAND_SPEEDS:GRASPS], vector[GRASPS:] = 0.0, -1.0
        self.state.poses[:] = data.qpos[self._qpos].reshape(-1, 7)
        self.asleep[:] = data.tree_asleep
        acceleration = np.abs(data.qacc) * self._model.dof_length
        trees = self._model.body_treeid[self._model.dof_bodyid]
        fastest = np.zeros(self._model.ntree)
        np.maximum.at(fastest, trees, acceleration)
        at_rest = (fastest < _REST_ACCELERATION) & (np.arange(len(fastest)) != self.person_tree)
        self.asleep[at_rest] = np.flatnonzero(at_rest)

    def write(self, data: mujoco.MjData) -> None:
        """Write the poses of all bodies, geoms, sites and cameras to `data`, for rendering and ray casts."""
        model, vector = self._model, self.state.vector
        if data.ntree_awake < model.ntree:
            # Without a reset, MuJoCo would not update the poses of sleeping bodies.
            mujoco.mj_resetData(model, data)
        data.time = vector[TIME]
        data.qpos[self._qpos] = self.state.poses.ravel()
        self._rig.pose[:4] = vector[BODY : BODY + 4]
        self._rig.pose[4:] = vector[HANDS:HAND_SPEEDS]
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_camlight(model, data)

    def walk(self, moves: NDArray[np.float64]) -> StepStates | None:
        """Execute one control step per row of `moves` (n, 4). Return the states between the steps."""
        self._walk_rows(moves, self.state, self.model, self._rows)
        return self._passed(len(moves))

    @functools.cached_property
    def _walk_rows(self) -> Callable[[NDArray[np.float64], KinematicState, KinematicModel, StepStates], None]:
        return specialized(walk_rows, np.empty((1, 4)), self.state, self.model, self._rows)

    def follow(
        self, walk: Walk, progress: NDArray[np.float64], limit: int
    ) -> tuple[int, NDArray[np.float64], StepStates | None]:
        """Walk along a path. Return the latest phase, the moves (n, 4), and the states between the moves."""
        moves = np.empty((min(limit, MAX_ROWS), 4))
        count, phase = follow_rows(walk, progress, self.state, self.model, moves, self._rows)
        return phase, moves[:count], self._passed(count)

    def play(self, trajectory: MotionTrajectory, start: int, end: int) -> StepStates | None:
        """Play the control steps `start` to `end` of a trajectory. Return the states between the steps."""
        play_rows(trajectory, start, end, self.state, self._rows)
        return self._passed(end - start)

    def _passed(self, count: int) -> StepStates | None:
        return None if count < 2 else StepStates._make(column[: count - 1].copy() for column in self._rows)

    def state_hash(self) -> int:
        return int(state_hash(self.state))

    def pack(self) -> NDArray[np.float64]:
        return np.concatenate((self.state.vector, self.state.poses.ravel(), self.asleep))

    def unpack(self, values: NDArray[np.float64]) -> None:
        """Restore a state that `pack` returned. Raise a StateError if the state does not fit this world."""
        vector, poses = self.state
        sizes = (STATE_SIZE, poses.size, len(self.asleep))
        if values.shape != (sum(sizes),) or not np.isfinite(values).all():
            raise StateError(
                f"a state of {values.size} numbers does not fit, {sum(sizes)} finite ones do; take it from a world of "
                "the same house, objects and fidelity"
            )
        new_vector, new_poses, asleep = np.split(values, np.cumsum(sizes)[:2])
        sleepers = np.flatnonzero(asleep >= 0)
        if not np.array_equal(np.sort(asleep[sleepers]), sleepers):
            raise StateError("the state's sleeping objects do not form rings; take it from a world's `state`")
        vector[:], poses[:], self.asleep[:] = new_vector, new_poses.reshape(-1, 7), asleep


def _floor(scene: Scene) -> Floor:
    radius = scene.person.body_radius
    house = compiled_house(scene.catalogue)
    return house.cached(("floor", radius), lambda: Floor.of(scene.model, radius))


def _grip_poses(scene: Scene) -> NDArray[np.float64]:
    model, names = scene.model, scene.index.names
    poses = np.zeros((len(names), 2, 7))
    for item, name in enumerate(names):
        for grip in avatar.GRIPS:
            site = model.site(f"{name}/grip_{grip}")
            pose = poses[item, grip]
            mujoco.mju_negPose(pose[:3], pose[3:], site.pos, site.quat)
    return poses
