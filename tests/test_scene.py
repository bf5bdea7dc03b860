"""Composition: what the episode says is what the compiled model holds."""

from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

from mjsim.episode import Episode, PlacedObject, StartPose
from mjsim.errors import AssetError, EpisodeError
from mjsim.model import avatar
from mjsim.model.catalogue import Catalogue
from mjsim.model.house import compiled_house
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.model.rooms import RoomMap
from mjsim.model.scene import Scene, SceneIndex, compose


def small_episode(catalogue: Catalogue, *placed: tuple[str, float, float]) -> Episode:
    """Objects (model, x, y) resting on the floor of the small house."""
    objects = tuple(
        PlacedObject(
            f"object_{i:02d}",
            catalogue.objects[model].category,
            model,
            (x, y),
            (x, y, 0.0),
            (1.0, 0.0, 0.0, 0.0),
        )
        for i, (model, x, y) in enumerate(placed)
    )
    targets = {o.name: catalogue.categories[catalogue.objects[o.model].category].receptacle for o in objects}
    return Episode(
        catalogue.name, 0, StartPose(1.5, 1.5, 0.5), objects, tuple(catalogue.receptacles), targets
    )


def test_initial_state_is_the_episode(scene: Scene) -> None:
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


def test_index_agrees_with_names(scene: Scene) -> None:
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


def test_unknown_instance_is_named(scene: Scene) -> None:
    for lookup in (scene.index.position_of, scene.index.body, scene.index.geoms):
        with pytest.raises(EpisodeError, match="teapot_99"):
            lookup("teapot_99")


def test_physics_options(scene: Scene) -> None:
    option = scene.model.opt
    assert option.timestep == 0.004
    assert option.impratio == 10
    assert option.cone == mujoco.mjtCone.mjCONE_ELLIPTIC
    assert option.integrator == mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    assert option.solver == mujoco.mjtSolver.mjSOL_NEWTON
    assert option.sleep_tolerance == 0.05
    assert option.enableflags & mujoco.mjtEnableBit.mjENBL_SLEEP
    assert option.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET


def test_objects_stay_where_they_are_and_fall_asleep(episode: Episode, catalogue: Catalogue) -> None:
    resting = compose(episode, catalogue, avatar=False)
    data = mujoco.MjData(resting.model)
    mujoco.mj_step(resting.model, data, nstep=500)
    before, _ = resting.index.poses(resting.model.qpos0)
    after, _ = resting.index.poses(data.qpos)
    assert np.abs(after - before).max() < 0.003
    assert (data.tree_asleep[resting.index.trees] >= 0).all()


def test_every_model_of_the_catalogue_composes(catalogue: Catalogue) -> None:
    placed = [(model, 1.0 + i % 8, 1.0 + i // 8) for i, model in enumerate(catalogue.objects)]
    composed = compose(small_episode(catalogue, *placed), catalogue, avatar=False)
    assert len(composed.index.names) == len(catalogue.objects)
    for name in composed.index.names:
        assert len(composed.index.geoms(name)) > 0
        for grip in ("grip_0", "grip_1"):
            composed.model.site(f"{name}/{grip}")


def test_instances_share_assets(catalogue: Catalogue) -> None:
    """Six of each model need no more meshes and textures than one of each."""
    each = [(m, 1.0, 1.0) for m in catalogue.objects]
    one = compose(small_episode(catalogue, *each), catalogue, avatar=False).model
    many = compose(small_episode(catalogue, *each * 6), catalogue, avatar=False).model
    assert (many.nmesh, many.ntex) == (one.nmesh, one.ntex)
    assert many.nbody > one.nbody


def test_instances_share_meshes_of_the_model_file(small_catalogue: Catalogue) -> None:
    composed = compose(small_episode(small_catalogue, ("wedge", 1, 1), ("wedge", 2, 1)), small_catalogue)
    names = {composed.model.mesh(i).name for i in range(composed.model.nmesh)}
    assert len(names - {avatar.TRUNK, avatar.FOOT}) == 1
    assert len(composed.index.geoms("object_01")) == 1


def test_person_is_optional(small_catalogue: Catalogue) -> None:
    bare = compose(small_episode(small_catalogue, ("cube", 1, 1)), small_catalogue, avatar=False)
    assert mujoco.mj_name2id(bare.model, mujoco.mjtObj.mjOBJ_BODY, "avatar/body") == -1
    assert bare.model.nv == 6


def test_unknown_model_is_named(small_catalogue: Catalogue) -> None:
    episode = small_episode(small_catalogue, ("cube", 1, 1))
    foreign = replace(episode, objects=(replace(episode.objects[0], model="harp"),))
    with pytest.raises(EpisodeError, match="harp"):
        compose(foreign, small_catalogue)


def test_unknown_receptacle_is_named(small_catalogue: Catalogue) -> None:
    episode = small_episode(small_catalogue)
    with pytest.raises(EpisodeError, match="well"):
        compose(replace(episode, receptacles=("crate", "well")), small_catalogue)


def _broken(small_house: Path, folder: Path, name: str, old: str, new: str) -> Catalogue:
    """A copy of the small house with one text replaced."""
    for file in small_house.iterdir():
        text = file.read_text(encoding="utf-8").replace(str(small_house), str(folder))
        if file.name == name:
            assert old in text
            text = text.replace(old, new)
        (folder / file.name).write_text(text, encoding="utf-8")
    return Catalogue.load(str(folder / "catalogue.toml"))


@pytest.mark.parametrize(
    ("name", "old", "new", "culprit"),
    [
        ("house.xml", '"mount:tray"', '"mount:trays"', "mount:tray"),
        ("house.xml", "</mujoco>", "", "house.xml"),
        ("tray.xml", '"receptacle"', '"thing"', "tray.xml.*'receptacle'"),
        ("cube.xml", '"object"', '"thing"', "cube.xml.*object"),
        ("cube.xml", 'mass="0.2"', 'mass="0"', "cube.xml.*weighs 0 kg"),
        ("tray.xml", '"volume"', '"space"', "tray.*volume"),
        ("tray.xml", '"approach"', '"spot"', "tray.*approach"),
        ("tray.xml", '"volume" type="box"', '"volume" type="sphere"', "tray.*box"),
        ("house.xml", '"room:west"', '"room:attic"', "attic"),
        ("house.xml", '"room:west"', '"west"', "west"),
        ("house.xml", '"room:west" type="box"', '"room:west" type="sphere"', "room:west"),
        ("house.xml", '"room:west" type="box"', '"room:west" type="box" euler="0.3 0 0"', "room:west"),
    ],
)
def test_faults_of_models_are_named(
    small_house: Path, tmp_path: Path, name: str, old: str, new: str, culprit: str
) -> None:
    broken = _broken(small_house, tmp_path, name, old, new)
    with pytest.raises(AssetError, match=culprit):
        compose(small_episode(broken, ("cube", 1, 1)), broken)


def test_index_needs_free_bodies(house_model: mujoco.MjModel) -> None:
    with pytest.raises(AssetError, match="object_00"):
        SceneIndex.from_model(house_model, ("object_00",))


def test_house_spec_has_receptacles_at_their_mounts(catalogue: Catalogue) -> None:
    model = compiled_house(catalogue).model
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    for key in catalogue.receptacles:
        mount, body = data.site(f"mount:{key}"), data.body(f"{key}/receptacle")
        np.testing.assert_allclose(body.xpos, mount.xpos, atol=1e-9)
        np.testing.assert_allclose(body.xmat, mount.xmat, atol=1e-9)


def test_rooms_of_the_small_house(small_catalogue: Catalogue) -> None:
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


def test_turned_rooms() -> None:
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><site name="room:a" type="box" pos="1 1 1" size="2 1 1" euler="0 0 90"/>'
        '<site name="room:b" type="box" pos="9 1 1" size="1 1 1" euler="0 0 45"/></worldbody></mujoco>'
    )
    rooms = RoomMap.from_model(model)
    assert rooms.contains((1, 2.9))
    assert not rooms.contains((2.9, 1))
    assert rooms.contains((9 + 1.4, 1))
    assert not rooms.contains((9.9, 1.9))
    np.testing.assert_allclose(rooms.bounds, (0, -1, 9 + 2**0.5, 3), atol=1e-12)
    assert rooms.label("b") == "b"


def test_room_turned_by_an_odd_angle() -> None:
    """A long room along the direction of 30 degrees, known by points on its axis and beside it."""
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><site name="room:a" type="box" size="3 0.5 1" euler="0 0 30"/></worldbody></mujoco>'
    )
    rooms = RoomMap.from_model(model)
    along, beside = np.array([np.cos(np.pi / 6), 0.5]), np.array([-0.5, np.cos(np.pi / 6)])
    assert rooms.contains(2.9 * along)
    assert not rooms.contains(2.9 * beside)
    np.testing.assert_allclose(rooms.distances(5 * along), [2.0])
    np.testing.assert_allclose(rooms.distances(-2 * beside), [1.5])


def test_receptacles_are_in_the_rooms_that_the_catalogue_says(scene: Scene) -> None:
    for key, receptacle in scene.catalogue.receptacles.items():
        geometry = scene.receptacles[key]
        assert scene.rooms.room_at(geometry.center[:2]) == receptacle.room
        assert scene.rooms.room_at(geometry.approach) == receptacle.room


def test_receptacle_contains_its_volume_only(scene: Scene) -> None:
    """Against MuJoCo's own transformation of points that are given in the site's frame."""
    data = mujoco.MjData(scene.model)
    mujoco.mj_kinematics(scene.model, data)
    rng = np.random.default_rng(1)
    for key, geometry in scene.receptacles.items():
        site = data.site(f"{key}/volume")
        half = scene.model.site(f"{key}/volume").size
        for share in rng.uniform(-1.8, 1.8, (400, 3)):
            point = site.xpos + site.xmat.reshape(3, 3) @ (share * half)
            assert geometry.contains(point) == bool((np.abs(share * half) <= half + 0.005).all())


def test_turned_receptacle() -> None:
    turn = np.array([[np.cos(0.5), -np.sin(0.5), 0], [np.sin(0.5), np.cos(0.5), 0], [0, 0, 1]])
    shelf = ReceptacleGeometry(
        "shelf", np.array([1.0, 2.0, 0.5]), np.array([0.4, 0.1, 0.2]), turn, np.zeros(2)
    )
    assert shelf.contains(shelf.center + 0.39 * turn[:, 0])
    assert not shelf.contains(shelf.center + 0.39 * turn[:, 1])
    assert not shelf.contains(shelf.center + 0.39 * turn[0])


def test_receptacle_margin(small_catalogue: Catalogue) -> None:
    tray = compiled_house(small_catalogue).receptacles["tray"]
    # The tray is turned by -90 degrees, so its local -y is the house's -x.
    np.testing.assert_allclose(tray.approach, [5.7 - 0.6, 3.6], atol=1e-6)
    x, y, z = tray.center
    assert tray.contains((x, y, z - 0.164))
    assert not tray.contains((x, y, z - 0.166))
    assert not tray.contains((x, y, z - 0.164), margin=0.0)
    assert tray.contains((x, y, z + 0.164))
    assert not tray.contains((x, y, z + 0.166))
