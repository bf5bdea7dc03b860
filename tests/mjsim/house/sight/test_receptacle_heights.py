"""ReceptacleHeights against the engine's own rays."""

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of

from mjsim.house.compiled.rays import first_hit
from mjsim.house.sight.receptacle_heights import ReceptacleHeights

NOBODY = np.zeros(0, np.int32)


def agree(scene, data, key, points):
    """Check receptacle_heights of a receptacle at points (k, 2) of its volume, -1 to 1; how many meet an object."""
    receptacle = scene.receptacles[key]
    places = receptacle.center[:2] + (points * receptacle.half_size[:2]) @ receptacle.rotation[:2, :2].T
    top = float(receptacle.center[2] + receptacle.half_size[2]) + 0.2
    heights = ReceptacleHeights(scene).heights(data, receptacle, places, top, NOBODY)
    objects = 0
    for (x, y), height in zip(places, heights, strict=True):
        distance, geom = first_hit(scene.model, data, (x, y, top), (0.0, 0.0, -1.0))
        assert height == pytest.approx(top - distance, abs=1e-6)
        objects += scene.index.geom_owner[geom] >= 0
    return objects


def test_every_receptacle_is_as_deep_as_rays_find_it(scene):
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    points = np.random.default_rng(0).uniform(-1, 1, (60, 2))
    for key in scene.receptacles:
        agree(scene, data, key, points)


def test_things_of_every_shape_are_met_in_every_pose(scene):
    rng = np.random.default_rng(1)
    key = next(iter(scene.receptacles))
    receptacle, data = scene.receptacles[key], mujoco.MjData(scene.model)
    met = 0
    for item in range(0, len(scene.index.names), 2):
        mujoco.mj_resetData(scene.model, data)
        address = scene.index.qpos[item]
        data.qpos[address : address + 3] = receptacle.center
        quaternion = rng.normal(size=4)
        data.qpos[address + 3 : address + 7] = quaternion / np.linalg.norm(quaternion)
        mujoco.mj_forward(scene.model, data)
        met += agree(scene, data, key, rng.uniform(-0.5, 0.5, (25, 2)))
    assert met > 50


def test_meshes_are_met_and_what_is_ignored_is_not(small_catalogue):
    lying = ("wedge", 0.3, 3.7, (0.9239, 0.0, 0.3827, 0.0))
    scene = scene_of(small_catalogue, (1.0, 1.0, 0.0), lying, height=0.1)
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    points = np.random.default_rng(2).uniform(-0.3, 0.3, (80, 2))
    assert agree(scene, data, "crate", points) > 10
    crate = scene.receptacles["crate"]
    places, top = crate.center[:2] + points * crate.half_size[:2], 0.6
    empty = ReceptacleHeights(scene).heights(data, crate, places, top, scene.index.bodies.astype(np.int32))
    assert empty == pytest.approx(0.04)
