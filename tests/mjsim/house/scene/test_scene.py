"""Composition: what the episode says is what the compiled model holds."""

import mujoco
import numpy as np
import pytest
import shapely
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from shapely import affinity
from small_worlds import edited, scene_of

from mjsim.house.compiled.house import compiled_house
from mjsim.house.compiled.sites import ReceptacleGeometry, RoomMap
from mjsim.house.scene import avatar
from mjsim.house.scene.scene import SceneIndex, compose
from mjsim.values.errors import AssetError, EpisodeError

START = (1.5, 1.5, 0.5)
turns = st.floats(-180, 180).map(lambda turn: round(turn, 2))  # MuJoCo takes 1e-4 degrees for none


def test_initial_state_is_the_episode(scene):
    positions, quaternions = scene.index.poses(scene.model.qpos0)
    np.testing.assert_array_equal(positions, [o.position for o in scene.episode.objects])
    np.testing.assert_allclose(quaternions, [o.quaternion for o in scene.episode.objects], rtol=0, atol=1e-15)
    data = mujoco.MjData(scene.model)
    mujoco.mj_forward(scene.model, data)
    np.testing.assert_allclose(data.xpos[scene.index.bodies], positions, rtol=0, atol=1e-12)
    body = data.body("avatar/body")
    start = scene.episode.start
    np.testing.assert_allclose(body.xpos[:2], [start.x, start.y], rtol=0, atol=1e-12)
    facing = body.xmat.reshape(3, 3) @ [1, 0, 0]
    np.testing.assert_allclose(facing[:2], [np.cos(start.heading), np.sin(start.heading)], atol=1e-12)


def test_index_agrees_with_names(scene):
    model, index = scene.model, scene.index
    assert index.names == tuple(o.name for o in scene.episode.objects)
    for i, name in enumerate(index.names):
        joint = model.joint(f"{name}/free")
        assert index.body(name) == model.body(f"{name}/object").id == index.bodies[i]
        assert joint.qposadr[0] == index.qpos[i]
        assert joint.dofadr[0] == index.dofs[i]
        assert index.position_of(name) == i
        owned = {model.body_rootid[model.geom_bodyid[g]] for g in index.geoms(name)}
        assert owned == {index.body(name)}
    owned_bodies = model.body_rootid[model.geom_bodyid[index.geom_owner >= 0]]
    assert set(owned_bodies) == set(index.bodies)
    data = mujoco.MjData(model)
    assert len(set(index.trees)) == len(index.names)
    assert data.tree_asleep[index.trees].shape == (len(index.names),)


def test_unknown_instance_is_named(scene):
    for lookup in (scene.index.position_of, scene.index.body, scene.index.geoms):
        with pytest.raises(EpisodeError, match="teapot_99"):
            lookup("teapot_99")


def test_physics_options(scene):
    option = scene.model.opt
    assert option.timestep == 0.004
    assert option.impratio == 10
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.solver == mujoco.mjtSolver.mjSOL_NEWTON
    assert option.sleep_tolerance == 0.05
    assert option.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_objects_stay_where_they_are_and_fall_asleep(episode, catalogue):
    resting = compose(episode, catalogue, avatar=False)
    data = mujoco.MjData(resting.model)
    mujoco.mj_forward(resting.model, data)
    assert set(range(24)) <= set(resting.index.geom_owner[data.contact.geom].flat)  # none floats
    mujoco.mj_step(resting.model, data, nstep=500)
    before, _ = resting.index.poses(resting.model.qpos0)
    after, _ = resting.index.poses(data.qpos)
    assert np.abs(after - before).max() < 0.003
    assert (data.tree_asleep[resting.index.trees] >= 0).all()


def test_every_model_of_the_catalogue_composes(catalogue):
    placed = [(model, 1.0 + i % 8, 1.0 + i // 8) for i, model in enumerate(catalogue.objects)]
    composed = scene_of(catalogue, START, *placed, avatar=False)
    assert len(composed.index.names) == len(catalogue.objects)
    for name in composed.index.names:
        assert len(composed.index.geoms(name)) > 0
        for grip in ("grip_0", "grip_1"):
            composed.model.site(f"{name}/{grip}")


def test_instances_share_assets(catalogue):
    each = [(m, 1.0, 1.0) for m in catalogue.objects]
    one = scene_of(catalogue, START, *each, avatar=False).model
    many = scene_of(catalogue, START, *each * 6, avatar=False).model
    assert (many.nmesh, many.ntex) == (one.nmesh, one.ntex)
    assert many.nbody > one.nbody


def test_instances_share_meshes_of_the_model_file(small_catalogue):
    composed = scene_of(small_catalogue, START, ("wedge", 1, 1), ("wedge", 2, 1))
    names = {composed.model.mesh(i).name for i in range(composed.model.nmesh)}
    assert len(names - {avatar.TRUNK, avatar.FOOT}) == 1
    assert len(composed.index.geoms("o1")) == 1


def test_person_is_optional(small_catalogue):
    bare = scene_of(small_catalogue, START, ("cube", 1, 1), avatar=False)
    assert mujoco.mj_name2id(bare.model, mujoco.mjtObj.mjOBJ_BODY, "avatar/body") == -1
    assert bare.model.nv == 6


@pytest.mark.parametrize(
    ("name", "old", "new", "culprit"),
    [
        ("house.xml", '"mount:tray"', '"mount:trays"', "mount:tray"),
        ("house.xml", "</mujoco>", "", "house.xml"),
        ("tray.xml", '"receptacle"', '"thing"', "tray.xml.*'receptacle'"),
        ("cube.xml", 'mass="0.2"', 'mass="0"', "cube.xml.*weighs 0 kg"),
        ("house.xml", '"room:west" type="box"', '"room:west" type="box" euler="0.3 0 0"', "room:west"),
    ],
)
def test_faults_of_models_are_named(fresh_house, name, old, new, culprit):
    with pytest.raises(AssetError, match=culprit):
        scene_of(edited(fresh_house, name, old, new), START, ("cube", 1, 1))


def test_index_needs_free_bodies(house_model):
    with pytest.raises(AssetError, match="object_00"):
        SceneIndex.from_model(house_model, ("object_00",))


def test_house_spec_has_receptacles_at_their_mounts(catalogue):
    model = compiled_house(catalogue).model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for key in catalogue.receptacles:
        mount, body = data.site(f"mount:{key}"), data.body(f"{key}/receptacle")
        np.testing.assert_allclose(body.xpos, mount.xpos, atol=1e-9)
        np.testing.assert_allclose(body.xmat, mount.xmat, atol=1e-9)


def test_rooms_of_the_small_house(small_catalogue):
    rooms = compiled_house(small_catalogue).rooms
    assert [rooms.room_at(p) for p in [(1, 1), (5, 0.5), (5, 3.5), (2.9, 2), (3.1, 2)]] == [
        "west", "east", "east", "west", "east",
    ]  # fmt: skip
    assert rooms.room_at((-2, 1)) == "west"  # the nearest, outside of all
    assert rooms.contains((5, 3.5))
    assert not rooms.contains((6.5, 2))
    assert rooms.contains((6.5, 2), margin=0.6)
    assert rooms.label("east") == "East room"
    assert rooms.bounds == (0, 0, 6, 4)
    with pytest.raises(AssetError, match="attic"):
        rooms.label("attic")


@given(
    turn=turns,
    half=st.tuples(*[st.floats(0.2, 3)] * 2),
    points=st.lists(st.tuples(*[st.floats(-6, 6)] * 2), min_size=1, max_size=30),
)
@settings(deadline=None)
def test_a_turned_room_is_a_turned_rectangle(turn, half, points):
    site = f'<site name="room:a" type="box" pos="1 2 1" size="{half[0]} {half[1]} 1" euler="0 0 {turn}"/>'
    rooms = RoomMap.from_model(
        mujoco.MjModel.from_xml_string(f"<mujoco><worldbody>{site}</worldbody></mujoco>")
    )
    a, b = half
    rectangle = affinity.translate(affinity.rotate(shapely.box(-a, -b, a, b), turn, origin=(0, 0)), 1, 2)
    np.testing.assert_allclose(rooms.bounds, rectangle.bounds, atol=1e-9)
    for point in map(shapely.Point, points):
        assert rooms.distances((point.x, point.y)) == pytest.approx(rectangle.distance(point), abs=1e-9)
        if rectangle.exterior.distance(point) > 1e-9:
            assert rooms.contains((point.x, point.y)) == rectangle.contains(point)
    assert rooms.label("a") == "a"


def test_receptacles_are_in_the_rooms_that_the_catalogue_says(scene):
    for key, receptacle in scene.catalogue.receptacles.items():
        geometry = scene.receptacles[key]
        assert scene.rooms.room_at(geometry.center[:2]) == receptacle.room
        assert scene.rooms.room_at(geometry.approach) == receptacle.room


def test_receptacles_are_where_their_sites_are(scene):
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    for key, geometry in scene.receptacles.items():
        volume = data.site(f"{key}/volume")
        np.testing.assert_array_equal(geometry.center, volume.xpos)
        np.testing.assert_array_equal(geometry.rotation.ravel(), volume.xmat)
        np.testing.assert_array_equal(geometry.half_size, scene.model.site(f"{key}/volume").size)
        np.testing.assert_array_equal(geometry.approach, data.site(f"{key}/approach").xpos[:2])


@given(
    turn=turns,
    local=st.tuples(*[st.floats(-2, 2)] * 3),
    margin=st.sampled_from([{}, {"margin": 0.0}, {"margin": 0.3}]),
)
@settings(deadline=None)
def test_a_receptacle_holds_what_is_in_its_turned_box(turn, local, margin):
    c, s = np.cos(np.radians(turn)), np.sin(np.radians(turn))
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    half, center = np.array([0.9, 0.4, 0.6]), np.array([0.3, -0.2, 0.5])
    receptacle = ReceptacleGeometry("shelf", center, half, rotation, np.zeros(2))
    point, beyond = center + rotation @ local, np.abs(local) - half - margin.get("margin", 0.005)
    assume(np.abs(beyond).min() > 1e-9)
    assert receptacle.contains(point, **margin) == (beyond < 0).all()
    box = affinity.rotate(shapely.box(*(center - half)[:2], *(center + half)[:2]), turn)
    assert receptacle.distance(point[:2]) == pytest.approx(box.distance(shapely.Point(point)), abs=1e-9)
