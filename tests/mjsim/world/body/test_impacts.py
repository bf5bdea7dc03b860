"""Impacts: falling objects do not sink into the floor, and loads that may hit something fast are detected."""

from contextlib import contextmanager

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of, world_of

from mjsim.house.compiled.footprint import ClearanceField
from mjsim.values.actions import IDLE
from mjsim.world.body.impacts import ImpactDetector

MODELS = ("jeans", "magazine", "t_shirt", "bottle", "plate", "towel", "newspaper", "comics")
HEIGHT = 1.3  # of the carrying posture, m
DEEPEST = 0.010  # m
CONTROL_TIMESTEP = 0.04  # s


@contextmanager
def deepest_contacts():
    """Depth of the deepest contact in each physics step, m."""
    found = []
    mujoco.set_mjcb_passive(
        lambda _, data: found.append(max(0.0, -float(data.contact.dist.min(initial=0.0))))
    )
    try:
        yield found
    finally:
        mujoco.set_mjcb_passive(None)


def _drop(world, rng):
    """Let all objects fall from random poses that are nearly upright, as in a hand, or anyhow."""
    world.reset()
    index, data = world.scene.index, world.data
    for item, (qpos, dof) in enumerate(zip(index.qpos, index.dofs, strict=True)):
        turn = rng.normal(size=4) * ((1.0, 0.15, 0.15, 1.0) if item % 2 else 1.0)
        data.qpos[qpos + 2] = HEIGHT + 0.1 * rng.random()
        data.qpos[qpos + 3 : qpos + 7] = turn / np.linalg.norm(turn)
        data.qvel[dof : dof + 6] = rng.normal(size=6) * (0.4, 0.4, 0.0, 1.0, 1.0, 1.0)
        data.tree_asleep[index.trees[item]] = -11
    for _ in range(25):
        world.step(IDLE)


def test_a_dropped_object_sinks_in_less_than_a_centimetre(catalogue, navmesh):
    rng = np.random.default_rng(8)
    places = [(model, *navmesh.sample(rng)) for model in MODELS]
    world = world_of(scene_of(catalogue, (*navmesh.sample(rng), 0.0), *places, height=0.01))
    timestep, softness = world.model.opt.timestep, world.model.geom_solref.copy()
    with deepest_contacts() as depths:
        for _ in range(2):
            _drop(world, rng)
    assert 0.001 < max(depths) < DEEPEST
    assert world.model.opt.timestep == timestep
    assert np.array_equal(world.model.geom_solref, softness)


@pytest.fixture
def two_objects(catalogue, navmesh):
    rng = np.random.default_rng(8)
    places = [(model, *navmesh.sample(rng)) for model in MODELS[:2]]
    world = world_of(scene_of(catalogue, (*navmesh.sample(rng), 0.0), *places, height=0.01))
    world.data.qvel[:] = 0.0
    return world


def detector_of(world, clearance):
    return ImpactDetector(world.scene, world.data, clearance, CONTROL_TIMESTEP)


def radius_of(world, item):
    geoms = np.array(world.scene.index.geoms(world.scene.index.names[item]))
    geoms = geoms[(world.model.geom_contype | world.model.geom_conaffinity)[geoms] > 0]
    return (np.linalg.norm(world.model.geom_pos[geoms], axis=1) + world.model.geom_rbound[geoms]).max()


def wall_at(x):
    """A wall that fills the half space beyond `x` metres."""
    edges = np.linspace(-30.0, 30.0, 601)
    gradient = np.zeros((601, 601, 2))
    gradient[..., 0] = -1.0
    return ClearanceField(np.repeat(x - edges[:, None], 601, 1), gradient, -30.0, -30.0, 0.1)


@pytest.mark.parametrize(
    ("velocity", "loose"),
    [
        ((0.0, 0.0, -1.2), True),
        ((0.0, 0.0, 1.2), False),
        ((1.9, 0.0, 0.0), False),  # is kicked
    ],
)
def test_only_loose_objects_fall(two_objects, velocity, loose):
    world, index = two_objects, two_objects.scene.index
    detector = detector_of(world, wall_at(30.0))
    assert not detector.detects(()) and not detector.detects((0, 1))
    world.data.qvel[index.dofs[1] : index.dofs[1] + 3] = velocity
    assert (detector.detects(()), detector.detects((0,)), detector.detects((1,))) == (loose, loose, False)


@pytest.mark.parametrize(
    ("velocity", "gap", "found"),
    [
        ((1.9, 0.0), 0.08, True),
        ((1.9, 0.0), 0.13, False),  # does not get there in one control step
        ((3.0, 0.0), 0.13, True),
        ((0.9, 3.0), 0.01, False),  # moves along the wall
        ((-1.9, 0.0), 0.01, False),  # moves away
    ],
)
def test_a_load_that_may_hit_furniture_soon_is_detected(two_objects, velocity, gap, found):
    world, index = two_objects, two_objects.scene.index
    detector = detector_of(world, wall_at(world.data.xpos[index.bodies[1], 0] + radius_of(world, 1) + gap))
    world.data.qvel[index.dofs[1] : index.dofs[1] + 2] = velocity
    assert detector.detects((1,)) == found
    assert not detector.detects((0,)) and not detector.detects(())


@pytest.mark.parametrize(
    ("velocities", "gap", "found"),
    [
        ((1.5, 1.5), 0.0, False),
        ((0.3, 0.0), 0.0, False),
        ((0.3, -0.2), 0.04, True),
        ((0.3, -0.2), 0.06, False),  # do not get there in one control step
        ((1.0, -0.5), 0.08, True),
    ],
)
def test_loads_that_may_meet_soon_are_detected(two_objects, velocities, gap, found):
    world, index = two_objects, two_objects.scene.index
    detector = detector_of(world, wall_at(30.0))
    world.data.qvel[index.dofs] = velocities
    first, second = index.bodies
    world.data.xpos[second] = world.data.xpos[first] + (
        0.0,
        radius_of(world, 0) + radius_of(world, 1) + gap,
        0.0,
    )
    assert detector.detects((0, 1)) == detector.detects((1, 0)) == found
    assert not detector.detects((0,))
