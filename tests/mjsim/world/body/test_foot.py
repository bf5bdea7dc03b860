"""Trunk and foot: what they meet pushes back straight, and what is pinched under a runner is stepped over."""

import math

import mujoco
import numpy as np
import pytest
from small_worlds import scene_of, world_of

from mjsim.house.scene import avatar
from mjsim.values.actions import IDLE, EventKind, Move
from mjsim.values.person_parameters import PersonParameters

HALF = np.array([0.30, 0.10])  # of the box, m
SQUEEZE = 60.0  # weights
WALL = 4.0  # y of the north wall's face in the small house, m


@pytest.mark.parametrize("geom", [avatar.TRUNK, avatar.FOOT])
@pytest.mark.parametrize("shape", ["box", "mesh"])
def test_edges_push_back_straight(geom, shape):
    """Against a box, contacts are those of a disc: their normal leads from its nearest point to the axis."""
    spec = mujoco.MjSpec()
    corners = [(x, y, z) for x in (-HALF[0], HALF[0]) for y in (-HALF[1], HALF[1]) for z in (-0.2, 0.2)]
    spec.add_mesh(name="box", uservert=np.ravel(corners))
    kind = {"type": mujoco.mjtGeom.mjGEOM_BOX, "size": [*HALF, 0.2]}
    if shape == "mesh":
        kind = {"type": mujoco.mjtGeom.mjGEOM_MESH, "meshname": "box"}
    bit = avatar.STATIC_BIT if geom == avatar.TRUNK else avatar.OBJECT_BIT
    spec.worldbody.add_geom(name="box", pos=[0, 0, 0.3], contype=bit, conaffinity=bit, **kind)
    avatar.attach_avatar(spec, (), start=(0.0, 0.0, 0.0), person=PersonParameters())
    model = spec.compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(5)
    for _ in range(300):
        nearest = HALF * rng.choice((-1, 1), 2)
        angle = rng.uniform(0.0, math.pi / 2)
        away = np.sign(nearest) * (math.cos(angle), math.sin(angle))
        depth = rng.uniform(0.002, 0.03)
        place = nearest + (PersonParameters().body_radius - depth) * away
        data.qpos[[model.joint(f"avatar/{axis}").qposadr[0] for axis in "xy"]] = place
        mujoco.mj_forward(model, data)
        assert data.ncon
        for contact in data.contact:
            flip = 1.0 if contact.geom[0] == model.geom("box").id else -1.0
            assert flip * contact.frame[:2] @ away > math.cos(math.radians(8.0)), (place, contact.frame[:3])
        assert -data.contact.dist.min() == pytest.approx(depth, abs=1.5e-3)


def _runner(catalogue, model, speed, aside):
    """Somebody 1.3 m in front of the north wall, and a thing that stands against it."""
    thing = (model, 1.5 + aside, WALL - 0.09)
    person = PersonParameters(walking_speed=speed * 13 / 14, walking_acceleration=12.0)
    return world_of(scene_of(catalogue, (1.5, WALL - 1.3, math.pi / 2), thing, height=0.002, person=person))


def _squeeze(world):
    """Force of the wall on the thing, N."""
    wall, total, wrench = world.model.geom("north").id, 0.0, np.zeros(6)
    for i, geoms in enumerate(world.data.contact.geom):
        if wall in geoms and world.model.geom(avatar.TRUNK).id not in geoms:
            mujoco.mj_contactForce(world.model, world.data, i, wrench)
            total += float(wrench[0])
    return total


@pytest.mark.parametrize("aside", [0.0, 0.07, 0.13])
@pytest.mark.parametrize("model", ["cube", "wedge", "ball"])
def test_a_runner_steps_over_what_lies_against_a_wall(small_catalogue, model, aside):
    """What is pinched is squeezed by some of its weights, not by the runner's momentum, and goes nowhere."""
    world = _runner(small_catalogue, model, 7.0, aside)
    weight = 9.81 * float(world.model.body_mass[world.scene.index.bodies[0]])
    dofs = world.scene.index.dofs[0] + np.arange(3)
    hardest = fastest = 0.0
    for _ in range(50):
        result = world.step(Move(7.0))
        assert not {e.kind for e in result.events} & {EventKind.EJECTED, EventKind.TUNNELLED}
        hardest = max(hardest, _squeeze(world))
        fastest = max(fastest, float(np.linalg.norm(world.data.qvel[dofs])))
    assert world.health.max_trunk_penetration_m > 0.0  # the runner did arrive
    assert hardest < SQUEEZE * weight
    assert fastest < 7.0
    for _ in range(25):
        world.step(IDLE)
    before = world.observation().position
    for _ in range(25):
        world.step(IDLE)
    assert np.linalg.norm(world.observation().position - before) < 1e-3
