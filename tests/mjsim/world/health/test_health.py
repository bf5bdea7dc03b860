"""Health of the physics: what is counted, by worlds in which it is made to happen."""

import math

import mujoco
import numpy as np
import pytest
from small_worlds import do, scene_of, world_of

from experiments.record.metrics import summarise_health
from mjsim.house.compiled.rays import first_hit, moving_geoms
from mjsim.values.actions import IDLE, EventKind, Pick
from mjsim.world.health.scan import is_path_clear, static_boxes


@pytest.fixture
def world(small_catalogue):
    """A cube and a ball in the west room of the small house, in reach of the person."""
    placed = ("cube", 2.0, 2.3), ("ball", 2.0, 1.6)
    return world_of(scene_of(small_catalogue, (1.5, 2.0, 0.0), *placed, names="{model}", height=0.001))


def kinds(world, steps):
    return [event.kind for _ in range(steps) for event in world.step(IDLE).events]


def put(world, name, *position):
    address = int(world.scene.index.qpos[world.scene.index.position_of(name)])
    world.data.qpos[address : address + 3] = position


def push(world, name, *velocity):
    dof = int(world.scene.index.dofs[world.scene.index.position_of(name)])
    world.data.qvel[dof : dof + 3] = velocity


def picked(world, name):
    do(world, Pick(name))
    assert name in world.observation().carried


def lose(world):
    """Let whatever is held drop, as a grip that gives way does."""
    world.data.eq_active[:] = 0
    world._tier.person.grips.open(0)
    world._tier.person.grips.open(1)


def test_a_quiet_world_is_well(world):
    assert kinds(world, 25) == []
    health = world.health
    assert (health.ejections, health.tunnellings, health.warnings, health.settle_times) == (0, 0, 0, ())
    assert math.isnan(world.health_sample.weld_error_m[0])
    assert health.max_penetration_m < 0.002


def test_through_a_wall_is_tunnelling_and_through_the_doorway_is_not(world):
    put(world, "cube", 4.0, 2.0, 0.0)  # the doorway lies in between
    assert kinds(world, 2) == []
    put(world, "cube", 4.0, 3.4, 0.0)
    assert kinds(world, 2) == []
    put(world, "cube", 2.0, 3.4, 0.0)  # now the partition does
    assert kinds(world, 2) == [EventKind.TUNNELLED]
    assert world.health.tunnellings == 1


def test_boxes_call_no_path_clear_on_which_a_ray_meets_the_house(scene):
    model, data = scene.model, mujoco.MjData(scene.model)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(0)
    low, high = scene.rooms.bounds[:2], scene.rooms.bounds[2:]
    boxes, clear = static_boxes(scene), 0
    for _ in range(1500):
        start = np.array([*rng.uniform(low, high), rng.uniform(0.0, 2.2)])
        end = start + rng.normal(0.0, 0.05, 3)
        if is_path_clear(start, end, boxes):
            clear += 1
            distance, geom = first_hit(
                model, data, start, end - start, through=moving_geoms(model), reach=1.0
            )
            assert distance >= 1.0 or not (model.geom_contype[geom] or model.geom_conaffinity[geom])
    assert 750 < clear < 1500  # of both kinds


def test_outside_the_house_is_ejected_once(world):
    put(world, "ball", 9.0, 1.6, 0.5)
    assert kinds(world, 10) == [EventKind.TUNNELLED, EventKind.EJECTED]
    assert world.health.ejections == 1


def test_faster_than_any_fall_or_kick_is_ejected(world):
    push(world, "ball", 0.0, 0.0, 6.0)
    assert EventKind.EJECTED not in kinds(world, 1)
    push(world, "ball", 0.0, 0.0, 12.0)
    assert EventKind.EJECTED in kinds(world, 1)


def test_a_dropped_thing_settles_and_one_that_flies_off_is_ejected(world):
    picked(world, "cube")
    height = float(world.observation().object_positions[0, 2])
    lose(world)
    assert EventKind.EJECTED not in kinds(world, 60)
    (time,) = world.health.settle_times
    assert math.sqrt(2 * height / 9.81) <= time < 1.5  # no sooner than it can fall
    world.reset()
    picked(world, "cube")
    lose(world)
    push(world, "cube", -3.5, 0.0, 2.0)  # off the hand at a slant, slower than a fall
    assert kinds(world, 60) == [EventKind.EJECTED]


def test_weld_errors_are_distances_and_angles_of_what_is_held(world):
    picked(world, "cube")
    hand = world.observation().hands.index("cube")
    for _ in range(20):
        world.step(IDLE)
    sample = world.health_sample
    assert math.isnan(sample.weld_error_m[1 - hand])
    assert 0.0 < sample.weld_error_m[hand] < 0.001
    assert sample.weld_error_rad[hand] < math.radians(1.0)
    body = int(world.scene.index.bodies[0])
    world.data.xfrc_applied[body, 3:] = (0.0, 0.0, 6.0)  # a twist
    for _ in range(5):
        world.step(IDLE)
    data, side = world.data, ("left", "right")[hand]
    held = data.site(f"avatar/{side}_grip").xmat.reshape(3, 3)
    grips = [data.site(f"cube/grip_{k}").xmat.reshape(3, 3) for k in (0, 1)]
    # An oracle apart from the trace: the angle between the x axes, since the twist is about the vertical.
    angle = min(math.acos(float(np.clip(held[:, 0] @ g[:, 0], -1, 1))) for g in grips)
    assert angle > 1e-4
    assert world.health_sample.weld_error_rad[hand] == pytest.approx(angle, rel=0.05, abs=1e-4)
    assert world.health.max_weld_error_rad >= world.health_sample.weld_error_rad[hand]


def test_a_state_carries_releases_under_way(world):
    picked(world, "cube")
    lose(world)
    kinds(world, 3)  # it is falling
    state = world.state()
    kinds(world, 60)
    expected = world.health
    world.restore(state)
    kinds(world, 60)
    assert world.health.settle_times == pytest.approx(expected.settle_times, abs=0.041)
    assert len(world.health.settle_times) == 1


def test_the_summary_leaves_out_what_was_not_there():
    nan = math.nan
    arrays = {
        "penetration_m": np.array([0.0, 0.001, 0.003, 0.0]),
        "trunk_penetration_m": np.zeros(4),
        "weld_error_m": np.array([[nan, 0.001], [nan, 0.003], [nan, nan], [0.002, nan]]),
        "weld_error_rad": np.full((4, 2), nan),
        "settle_s": np.array([nan, 0.2, nan, 0.4]),
    }
    events = [{"event": "ejected"}, {"event": "placed"}, {"event": "tunnelled"}, {"event": "ejected"}]
    summary = summarise_health(events, arrays)
    assert summary["max_penetration_m"] == 0.003 and summary["mean_penetration_m"] == pytest.approx(0.001)
    assert summary["mean_weld_error_m"] == pytest.approx(0.002) and summary["max_weld_error_rad"] == 0.0
    assert summary["releases_settled"] == 2 and summary["max_settle_s"] == 0.4
    assert (summary["ejections"], summary["tunnellings"], summary["grips_lost"]) == (2, 1, 0)
