"""Simulate dropped objects until they rest on the floor of a house."""

from dataclasses import dataclass, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.scene.scene import Scene, compose
from mjsim.values.episode import Episode, PlacedObject
from mjsim.values.errors import PhysicsError

REST_SPEED = 0.01  # speed below which an object is at rest, in m/s
MAX_TIME = 6.0  # maximum simulated time, in seconds
MAX_DRIFT = 0.3  # maximum distance of a settled object from its drop point, in metres
MAX_SINK = 0.02  # maximum depth of a settled object below the floor, in metres


@dataclass(frozen=True, eq=False)
class Settled:
    """The poses of objects that were dropped and simulated until they came to rest."""

    objects: tuple[PlacedObject, ...]  # objects in their final poses, in the order of the episode
    faults: dict[str, str]  # object name -> reason why its final pose cannot be used


def settle(episode: Episode, catalogue: Catalogue) -> Settled:
    """Simulate the objects of an episode until all of them are at rest, for at most 6 s.

    The result reports a fault for each object that still moves faster than 1 cm/s, is more than 0.3 m from
    its drop point, or is outside the house.

    Raises:
        PhysicsError: MuJoCo reported a warning.
    """
    scene = compose(episode, catalogue, avatar=False, visuals=False)
    data = mujoco.MjData(scene.model)
    steps = round(0.1 / scene.model.opt.timestep)
    while data.time < MAX_TIME and _awake(scene, data).any():
        mujoco.mj_step(scene.model, data, nstep=steps)
    moving = _awake(scene, data) & (_speeds(scene, data) >= REST_SPEED)
    _check_warnings(data, episode)
    positions, quaternions = scene.index.poses(data.qpos)
    quaternions /= np.linalg.norm(quaternions, axis=1, keepdims=True)
    objects, faults = [], {}
    for placed, position, quaternion, moves in zip(
        episode.objects, positions, quaternions, moving, strict=True
    ):
        x, y, z = position.tolist()
        w, i, j, k = quaternion.tolist()
        objects.append(replace(placed, position=(x, y, z), quaternion=(w, i, j, k)))
        if fault := _fault(scene, placed, position, moves):
            faults[placed.name] = fault
    return Settled(tuple(objects), faults)


def _awake(scene: Scene, data: mujoco.MjData) -> NDArray[np.bool_]:
    return np.asarray(data.tree_asleep[scene.index.trees] < 0)


def _speeds(scene: Scene, data: mujoco.MjData) -> NDArray[np.float64]:
    return np.asarray(np.linalg.norm(data.qvel[scene.index.dofs[:, None] + np.arange(3)], axis=1))


def _fault(scene: Scene, placed: PlacedObject, position: NDArray[np.float64], moving: bool) -> str | None:
    drift = float(np.hypot(*(position[:2] - placed.point)))
    if not np.isfinite(position).all() or not scene.rooms.contains(position[:2]) or position[2] < -MAX_SINK:
        return f"left the house for {position.round(2).tolist()}"
    if drift > MAX_DRIFT:
        return f"rolled {drift:.2f} m"
    return f"still moves after {MAX_TIME} s" if moving else None


def _check_warnings(data: mujoco.MjData, episode: Episode) -> None:
    raised = [w for w in range(int(mujoco.mjtWarning.mjNWARNING)) if data.warning[w].number]
    if raised:
        names = ", ".join(mujoco.mjtWarning(w).name for w in raised)
        raise PhysicsError(f"settling episode {episode.seed} of house {episode.house!r} raised {names}")
