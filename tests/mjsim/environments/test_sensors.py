"""Sensors against independent oracles: shapely, rays, hand-made poses and transforms written out."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest
import shapely
from dm_env import specs
from numpy.testing import assert_allclose
from small_worlds import episode_of

import mjsim
from mjsim.environments.sensors import SENSORS, Sensor, resolve_sensors, unit_spec
from mjsim.environments.sensors.base import CameraOptions
from mjsim.environments.sensors.house import MAP_SIZE
from mjsim.environments.sensors.vector_kernels import RANGE, RAYS
from mjsim.environments.sensors.vision import visible_pixels
from mjsim.values.errors import EnvironmentConfigError

# In the west room, looking at the crate in its corner. The cube is at the feet, too low to be in the picture; the
# ball is ahead; the wedge is behind the partition.
HEADING = 2.25
START = (2.3, 1.2)
THINGS = ("solids", "cube", (1.8, 1.7)), ("rounds", "ball", (0.9, 2.5)), ("solids", "wedge", (4.5, 1.0))


@pytest.fixture(scope="module")
def small_episode(small_catalogue):
    half = math.radians(150) / 2
    turn = (-math.cos(half), 0.0, 0.0, -math.sin(half))
    placed = [(model, *at, turn) for _, model, at in THINGS]
    return episode_of(small_catalogue, (*START, HEADING), *placed)


@pytest.fixture(scope="module")
def core(small_episode):
    """Every sensor there is, five slots for three objects."""
    env = mjsim.make(
        house=small_episode.house,
        episodes=[small_episode],
        observations=tuple(SENSORS),
        actions="discrete",
        slots=5,
        time_limit=40.0,
        camera=CameraOptions(width=96, height=72, far=4.0),
    )
    yield env.core
    env.close()


@pytest.fixture
def seen(core):
    return core.reset(0)[0]


@pytest.fixture
def moved(core):
    """Observation some steps and turns later."""
    core.reset(0)
    for action in (1, 1, 1, 0, 0, 2):
        taken = core.step(action)
    return taken.observation


def in_body(core, point):
    """Forward and left of the person, m, by complex numbers."""
    state = core.state
    offset = complex(*(point - state.position)) * complex(math.cos(state.heading), -math.sin(state.heading))
    return np.array([offset.real, offset.imag])


def scale(core):
    x_min, y_min, x_max, y_max = core.layout.floor.bounds
    return math.dist((x_min, y_min), (x_max, y_max))


@pytest.mark.parametrize("name", list(SENSORS))
def test_every_sensor_keeps_to_its_spec(name, core, moved):
    spec = core.observation_spec[name]
    assert spec.name == name
    start = core.reset(0)[0][name]
    spec.validate(start)
    spec.validate(moved[name])
    assert not np.shares_memory(start, core.reset(0)[0][name])


def test_what_is_seen_at_the_start(core, seen):
    """The place is the origin; the episode says -q for a rotation, agents see q; being in view needs no pixels."""
    assert_allclose(seen["gps"], [0, 0], atol=1e-7)
    assert_allclose(seen["compass"], [1, 0], atol=1e-7)
    half = math.radians(150) / 2
    assert_allclose(seen["object_rotations"][:3], [[math.cos(half), 0, 0, math.sin(half)]] * 3, atol=1e-5)
    assert seen["depth"].max() == 4.0 and 0.1 < seen["depth"].min() < 2.0
    assert seen["in_view"].tolist() == [0, 1, 0, 0, 0]
    assert seen["remaining"] == 1.0 and seen["time_left"] == 1.0
    assert core.step(1).observation["time_left"] == pytest.approx(1 - core.state.time / 40.0, abs=1e-6)


def test_gps_and_compass_are_relative_to_the_start(core):
    """Two strides ahead, then a turn of 20 degrees: 0.5 m forward in the start's own frame."""
    core.reset(0)
    for action in (0, 0, 1, 1):
        taken = core.step(action)
    assert_allclose(taken.observation["gps"] * scale(core), [0.5, 0.0], atol=0.02)
    angle = math.radians(20)
    assert_allclose(taken.observation["compass"], [math.cos(angle), math.sin(angle)], atol=0.005)


def test_places_are_those_of_the_house_seen_from_the_body(core, moved):
    """The small house is 6 m x 4 m with its corner at the origin."""
    x, y, c, s = moved["pose"]
    state = core.state
    assert_allclose([x * 3 + 3, y * 2 + 2], state.position, atol=1e-5)
    assert_allclose([c, s], [math.cos(state.heading), math.sin(state.heading)], atol=1e-6)
    for slot, position in enumerate(state.object_positions):
        row = moved["object_positions"][slot] * scale(core)
        assert_allclose(row, [*in_body(core, position[:2]), position[2]], atol=1e-5)
    receptacles = [in_body(core, np.array(at)) for at in ((0.3, 3.7), (5.7, 3.6))]
    assert_allclose(moved["receptacles"] * scale(core), receptacles, atol=1e-5)


def test_motion_is_in_the_body_frame(core):
    """Cut a walk short by the time limit of its action: only forward velocity, as a share of the fastest."""
    core.reset(0)
    speeds = []
    core.on_control_step = lambda _: speeds.append(
        next(s for s in core.sensors if s.name == "motion").read(core._sensor_input(core.state))
    )
    core.step(0)
    core.on_control_step = None
    fastest = np.array(speeds)[np.argmax([s[0] for s in speeds])]
    assert 0.3 < fastest[0] <= 1.0
    assert abs(fastest[1]) < 0.01
    assert fastest[3] == 0.0


def test_empty_slots_are_masked(seen):
    assert seen["object_mask"].tolist() == [1, 1, 1, 0, 0]
    for name in ("object_positions", "object_rotations", "object_status", "object_categories", "goals"):
        assert not seen[name][3:].any(), name
        assert seen[name][:3].any(axis=1).all(), name


def test_categories_are_those_of_the_catalogue(small_catalogue, seen):
    keys = list(small_catalogue.categories)
    named = [keys[i] for i in seen["object_categories"][:3].argmax(axis=1)]
    assert named == [category for category, *_ in THINGS]
    assert (seen["object_categories"][:3].sum(axis=1) == 1).all()


def test_carrying_changes_what_is_told(core):
    core.reset(0)
    before = core.step(3)
    assert before.info["picked"] == 1
    after = before.observation
    assert after["inventory"].sum() == 1 and after["inventory"][:, 0].sum() == 1
    hand = int(after["inventory"][:, 0].argmax())
    assert core.state.hands[hand] == "o0"
    assert after["object_status"][0].tolist() == [0, 1, 0]
    assert_allclose(after["goals"][0] * scale(core), in_body(core, np.array([0.3, 3.7])), atol=1e-5)
    assert_allclose(after["goals"][1:3], after["object_positions"][1:3, :2], atol=1e-6)


def test_rangefinder_agrees_with_shapely(navmesh):
    """Exact distances to the union of the outlines, from places all over the apartment."""
    env = mjsim.make(objects=1, seed=0, observations=("rangefinder",))
    env.reset()
    solid = shapely.union_all([shapely.Polygon(o) for o in env.core.layout.floor.obstacles])
    rng = np.random.default_rng(3)
    for _ in range(12):
        position, heading = navmesh.sample(rng), rng.uniform(-math.pi, math.pi)
        state = _at(env.core, position, heading)
        found = env.core.sensors[0].read(state) * RANGE
        for k in range(RAYS):
            angle = heading + 2 * math.pi * k / RAYS
            ray = shapely.LineString(
                [position, position + RANGE * np.array([math.cos(angle), math.sin(angle)])]
            )
            hit = ray.intersection(solid)
            distance = RANGE if hit.is_empty else shapely.Point(position).distance(hit)
            assert found[k] == pytest.approx(distance, abs=1e-5)
    env.close()


def _at(core, position, heading):
    return core._sensor_input(dataclasses.replace(core.state, position=position, heading=heading))


def test_map_agrees_with_shapely():
    """Cells whose middle is in an obstacle are taken, those farther than a cell's diagonal from one are free."""
    env = mjsim.make(objects=1, seed=0, observations=("map",))
    raster = env.reset().observation["map"]
    x_min, y_min, x_max, y_max = env.core.layout.floor.bounds
    solid = shapely.union_all([shapely.Polygon(o) for o in env.core.layout.floor.obstacles])
    size = np.array([(x_max - x_min) / MAP_SIZE, (y_max - y_min) / MAP_SIZE])
    rows, columns = np.mgrid[:MAP_SIZE, :MAP_SIZE]
    middles = np.stack([columns, rows], axis=-1) * size + size / 2 + (x_min, y_min)
    distance = shapely.distance(shapely.points(middles), solid)
    assert (raster[distance == 0.0] == 1).all()
    assert (raster[distance > np.hypot(*size)] == 0).all()
    assert 0.1 < raster.mean() < 0.9
    env.close()


def test_segmentation_names_slots_and_receptacles(core, seen):
    """Every pixel's label is the owner of what a ray through it meets, edges aside."""
    world = core.world
    labels = seen["segmentation"]
    assert labels.shape == (72, 96)
    camera = world.model.camera("avatar/eye").id
    origin, axes = world.data.cam_xpos[camera], world.data.cam_xmat[camera].reshape(3, 3)
    focal = 36 / math.tan(math.radians(world.model.cam_fovy[camera]) / 2)
    groups = np.array([1, 1, 1, 0, 0, 0], np.uint8)
    wrong = checked = 0
    for row, column in np.ndindex(72, 96):
        if row % 3 or column % 3:
            continue
        ray = axes @ np.array([(column + 0.5 - 48) / focal, (36 - row - 0.5) / focal, -1.0])
        geom = np.array([-1], np.int32)
        mujoco.mj_ray(world.model, world.data, origin, ray, groups, 1, -1, geom)
        checked += 1
        wrong += _owner(world.model, int(geom[0])) != labels[row, column]
    assert wrong <= 0.02 * checked
    assert {0, 2, 5} <= set(np.unique(labels)) <= set(range(-1, 9))


def _owner(model, geom):
    """Number of what a geom belongs to; the crate is what is static within 0.3 m of its mount."""
    if geom < 0:
        return -1
    body = int(model.geom_bodyid[geom])
    name = model.body(body).name.split("/")[0]
    if name == "avatar":
        return 1
    near = np.abs(model.geom_pos[geom, :2] - (0.3, 3.7)).max() < 0.3 and model.geom_pos[geom, 2] < 0.4
    if body == 0 and near and model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX:
        return 2
    return {"o0": 4, "o1": 5, "o2": 6}.get(name, 0)


def test_pixel_counts_are_those_of_the_segmentation(core, seen):
    counts = [int((seen["segmentation"] == 4 + slot).sum()) for slot in range(5)]
    assert seen["visible_pixels"].tolist() == counts
    assert counts[0] == counts[2] == 0 < counts[1]
    inputs = core._sensor_input(core.state)
    assert visible_pixels(inputs) == {"o1": counts[1]} == core.reset(0)[1]["visible"]


def test_depth_is_metric(core, seen):
    world = core.world
    camera = world.model.camera("avatar/eye").id
    ahead = -world.data.cam_xmat[camera].reshape(3, 3)[:, 2]
    along = (core.state.object_positions[1] + (0, 0, 0.06) - world.data.cam_xpos[camera]) @ ahead
    pixels = seen["depth"][seen["segmentation"] == 5]
    assert along - 0.07 < pixels.min() <= pixels.max() < along + 0.01


def test_a_sensor_of_your_own_joins_in(small_episode):
    clock = Sensor(
        "clock", lambda _: unit_spec(1, low=0.0), lambda m: np.array([m.state.time / 9], np.float32)
    )
    env = mjsim.make(house=small_episode.house, episodes=[small_episode], observations=("gps", clock))
    env.reset()
    step = env.step(np.zeros(4, np.float32))
    assert list(step.observation) == ["gps", "clock"]
    assert step.observation["clock"] == pytest.approx(0.04 / 9)
    env.close()


@pytest.mark.parametrize("value", [np.full(1, np.nan, np.float32), np.zeros(2, np.float32), None, "x"])
def test_a_sensor_that_does_not_keep_to_its_spec_is_named(value, small_episode):
    own = Sensor("own", lambda _: specs.Array((1,), np.float32), lambda _: value)
    env = mjsim.make(house=small_episode.house, episodes=[small_episode], observations=(own,))
    with pytest.raises(EnvironmentConfigError, match=r"sensor 'own': .*test_sensors.py, line"):
        env.reset()
    env.close()


def test_two_sensors_of_one_name_are_refused():
    other = Sensor("gps", lambda _: specs.Array((1,), np.float32), lambda _: np.zeros(1))
    with pytest.raises(EnvironmentConfigError, match="gps"):
        resolve_sensors(("state", other))
    assert len(resolve_sensors(("state", "gps", "state"))) == len(resolve_sensors("state"))


def test_images_must_be_asked_for(small_episode):
    silent = Sensor("quiet", SENSORS["depth"].declare, SENSORS["depth"].read)
    env = mjsim.make(house=small_episode.house, episodes=[small_episode], observations=(silent,))
    with pytest.raises(EnvironmentConfigError, match="images"):
        env.reset()
    env.close()


@pytest.mark.parametrize("given", [{"width": 0}, {"height": -1}, {"far": 0.0}, {"far": math.inf}])
def test_unusable_cameras_are_refused(given):
    with pytest.raises(EnvironmentConfigError):
        CameraOptions(**given)
