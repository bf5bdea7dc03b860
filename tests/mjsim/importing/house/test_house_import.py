"""`mjsim import house`: scenes of other simulators become houses that `mjsim check` accepts, or are refused."""

import json
import os
import re
import tomllib
from pathlib import Path

import house_scenes
import mujoco
import numpy as np
import pytest
import trimesh
from house_scenes import write_glb, write_habitat, write_mjcf, write_obj, write_robocasa, write_sdf

from experiments.cli import main as cli
from mjsim import load_catalogue, sample_episode
from mjsim.formats.gltf.export import export_episode
from mjsim.formats.scene.mesh_colours import surface_of
from mjsim.formats.scene.source_scene import HouseOptions, ScenePiece
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.compiled.house import compiled_house
from mjsim.house.scene.scene import assemble
from mjsim.house.validation.checked_model import Compiled
from mjsim.importing.house.house_import import import_house
from mjsim.importing.house.solids import make_solids
from mjsim.values.errors import AssetError

GROUND = (
    "<model name='ground'><static>true</static><pose>0 0 -0.06 0 0 0</pose><link name='l'><visual name='v'><geometry>"
    "<box><size>100 100 0.1</size></box></geometry></visual></link></model>"
)


def imported(tmp_path, source, **options):
    """Import a scene into a new folder: its decisions by what was decided, and its catalogue."""
    out = tmp_path / "house"
    decisions, report = import_house(source, out, HouseOptions(**options))
    assert [f for f in report.findings if f.severity == "error"] == []
    return {d.what: f"{d.choice}: {d.reason}" for d in decisions}, Catalogue.load(str(out))


def write_flat(folder):
    """Write a flat, a part of which was thrown far away."""
    box = "<visual name='v'><geometry><box><size>1 1 1</size></box></geometry></visual>"
    lost = f"<model name='lost'><pose>90 1 0.5 0 0 0</pose><link name='l'>{5 * box}</link></model>"
    return write_sdf(folder, extra=lost)


@pytest.fixture(scope="module")
def flat(tmp_path_factory):
    folder = tmp_path_factory.mktemp("flat")
    return imported(folder, write_flat(folder))


@pytest.mark.slow
def test_an_sdf_world_becomes_a_house(flat):
    decisions, catalogue = flat
    assert list(catalogue.rooms.values()) == ["Living room", "Room 1"]
    assert decisions["outline"].startswith("closed by its walls")
    assert set(catalogue.receptacles) >= {"dish_bin", "toy_box"}
    house = compiled_house(catalogue)
    assert house.rooms.room_at((1.0, 3.0)) == "living_room"
    assert house.rooms.room_at((7.0, 3.0)) == "room_1"
    assert not house.model.njnt


def test_a_door_between_rooms_stands_open(flat):
    decisions, catalogue = flat
    assert decisions["doors"] == "1 open: door_1"
    assert compiled_house(catalogue).navigable.is_navigable((4.0, 2.5))


def test_what_is_far_from_all_other_pieces_is_left_out(flat):
    decisions, _ = flat
    assert decisions["left out"] == "lost: more than 60 m away"


def test_loose_things_of_the_size_of_a_hand_are_left_out_and_named(flat):
    decisions, catalogue = flat
    assert "cup" in decisions["loose things"]
    model = compiled_house(catalogue).model
    assert not any("cup" in model.geom(g).name for g in range(model.ngeom))


def test_a_mesh_keeps_its_place_scale_and_picture(flat):
    _, catalogue = flat
    model = compiled_house(catalogue).model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    look = next(g for g in range(model.ngeom) if model.geom(g).name.startswith("table_look"))
    mesh = model.geom_dataid[look]
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    points = (
        model.mesh_vert[first : first + count] @ data.geom_xmat[look].reshape(3, 3).T + data.geom_xpos[look]
    )
    np.testing.assert_allclose(points[:, 2].max(), 0.75, atol=1e-3)
    np.testing.assert_allclose(points.mean(axis=0)[:2], (6.0, 2.0), atol=0.02)
    assert model.mat_texid[model.geom_matid[look]].max() >= 0


def test_what_one_bumps_into_is_below_a_table_only_where_its_legs_are(flat):
    _, catalogue = flat
    house = compiled_house(catalogue)
    tall = [
        g
        for g in range(house.model.ngeom)
        if house.model.geom(g).name.startswith("table_") and house.model.geom_contype[g]
    ]
    assert 3 <= len(tall) <= 40


def test_the_same_scene_gives_the_same_bytes(flat, tmp_path):
    _, again = imported(tmp_path, write_flat(tmp_path))
    written = []
    for catalogue in (flat[1], again):
        folder = catalogue.house_path.parent
        written.append({p.relative_to(folder): p.read_bytes() for p in folder.rglob("*") if p.is_file()})
    assert written[0] == written[1]


@pytest.mark.slow
def test_without_walls_the_house_is_the_rectangle_of_its_floor(tmp_path):
    decisions, catalogue = imported(tmp_path, write_sdf(tmp_path, walls=False))
    assert decisions["outline"].startswith("a rectangle")
    assert len(catalogue.rooms) == 1
    bounds = np.reshape(compiled_house(catalogue).rooms.bounds, (2, 2))
    np.testing.assert_allclose(np.ptp(bounds, axis=0), (8, 5), atol=0.4)


def gapped(folder, monkeypatch, *missing):
    """Write the flat without some of its walls, on a ground plane that extends far beyond it."""
    monkeypatch.setattr(
        house_scenes, "WALLS", {key: wall for key, wall in house_scenes.WALLS.items() if key not in missing}
    )
    return write_sdf(folder, extra="<include><uri>model://ground_plane</uri></include>" + GROUND)


@pytest.mark.slow
@pytest.mark.parametrize(("missing", "outside"), [(("north",), 0), (("north", "east"), 50)])
def test_walls_that_do_not_close_do_not_take_in_the_ground(tmp_path, monkeypatch, missing, outside):
    source = gapped(tmp_path, monkeypatch, *missing)
    decisions, report = import_house(source, tmp_path / "house", HouseOptions())
    (warning,) = report.findings
    assert warning.rule == "outline" and warning.severity == "warning"
    share = int(re.search(r"and (\d+) % of its floor is outside", warning.message)[1])
    assert abs(share - outside) <= 8
    assert next(d.choice for d in decisions if d.what == "outline") == "a rectangle"
    house = compiled_house(Catalogue.load(str(tmp_path / "house")))
    np.testing.assert_allclose(np.ptp(np.reshape(house.rooms.bounds, (2, 2)), axis=0), (8.2, 5.2), atol=0.3)
    for receptacle in house.receptacles.values():
        assert (receptacle.center[:2] > -0.2).all() and (receptacle.center[:2] < (8.2, 5.2)).all()


@pytest.mark.slow
def test_a_room_that_is_too_small_for_a_study_is_imported_with_warnings(tmp_path):
    trimesh.creation.box((2.8, 2.5, 2.6)).export(tmp_path / "room.glb")
    _, report = import_house(tmp_path / "room.glb", tmp_path / "house", HouseOptions())
    assert {f.rule for f in report.findings} == {"area", "places"}
    assert report.usable  # a warning does not refuse the house


@pytest.mark.slow
def test_the_command_imports_and_reports_and_takes_rooms_and_a_name(tmp_path, capsys):
    rooms, out = tmp_path / "rooms.toml", tmp_path / "my house"
    rooms.write_text(
        '[rooms.den]\nlabel = "Den"\nboxes = [[0, 0, 3.9, 5]]\n[rooms.hall]\nlabel = "Hall"\nboxes = [[4, 0, 8, 5]]\n'
    )
    words = ["import", "house", write_sdf(tmp_path), "--out", out, "--name", "Flat", "--rooms", rooms]
    assert cli.main([str(word) for word in words]) == 0
    assert "convex geoms" in capsys.readouterr().out
    assert tomllib.loads((out / "catalogue.toml").read_text())["house"]["label"] == "Flat"
    assert dict(Catalogue.load(str(out)).rooms) == {"den": "Den", "hall": "Hall"}
    assert json.loads((out / "report.json").read_text())[0]["what"] == "source"


def colliding(house, name):
    """Lower and upper corner of what collides under a name, m."""
    model = house.model
    geoms = [g for g in range(model.ngeom) if model.geom(g).name.startswith(name) and model.geom_contype[g]]
    points = np.concatenate([Compiled.of("house", Path(), model).points(g) for g in geoms])
    return points.min(axis=0), points.max(axis=0)


@pytest.mark.slow
def test_gltf_and_obj_give_the_same_floor_and_an_obj_tells_its_unit_and_axes(tmp_path):
    said = {}
    for name, write in (("glb", write_glb), ("obj", write_obj)):
        folder = tmp_path / name
        folder.mkdir()
        said[name], catalogue = imported(folder, write(folder / f"flat.{name}"))
        assert len(catalogue.rooms) == 2
        bounds = compiled_house(catalogue).rooms.bounds
        np.testing.assert_allclose(np.diff(np.reshape(bounds, (2, 2)), axis=0)[0], (8, 5), atol=0.35)
    assert said["glb"]["outline"] == said["obj"]["outline"]
    assert said["obj"]["up"].startswith("y")
    assert said["obj"]["unit"].startswith("cm")


@pytest.mark.slow
def test_a_closed_box_in_centimetres_is_a_room(tmp_path):
    trimesh.creation.box((400, 250, 500)).export(tmp_path / "room.glb")
    decisions, _ = imported(tmp_path, tmp_path / "room.glb")
    assert decisions["unit"].startswith("cm")
    assert decisions["outline"].startswith("closed by its walls")


@pytest.mark.slow
def test_a_habitat_scene_is_a_stage_with_objects_in_their_places(tmp_path):
    decisions, catalogue = imported(tmp_path, write_habitat(tmp_path / "data"))
    assert "ball" in decisions["loose things"]
    low, high = colliding(compiled_house(catalogue), "chest")
    np.testing.assert_allclose(low, (1.75, 0.6, 0.0), atol=0.02)  # 0.8 x 0.9 x 0.5 m, turned by 90 degrees
    np.testing.assert_allclose(high, (2.25, 1.4, 0.9), atol=0.02)


def test_an_mjcf_scene_stands_still_and_walls_that_were_only_seen_are_solid(tmp_path):
    decisions, catalogue = imported(tmp_path, write_mjcf(tmp_path))
    house = compiled_house(catalogue)
    assert decisions["outline"].startswith("closed by its walls")
    assert next(iter(catalogue.rooms.values())) == "Bedroom"
    assert "cup" in decisions["loose things"]
    assert (house.model.nu, house.model.njnt) == (0, 0)
    low, high = colliding(house, "cupboard")
    np.testing.assert_allclose(high - low, (0.8, 0.57, 1.0), atol=0.02)
    assert house.model.ntex >= 1  # the plaster


def test_a_kitchen_layout_stands_where_its_fixtures_say(tmp_path):
    decisions, catalogue = imported(tmp_path, write_robocasa(tmp_path))
    assert list(catalogue.rooms.values()) == ["Kitchen"]
    assert decisions["left out"].startswith("1 electric_kettle, 1 wall_accessory")
    assert catalogue.points < 40  # and no warning about it
    house = compiled_house(catalogue)
    for name, low, high in (
        ("counter_main", (3.35, -1.6, 0), (4.0, -0.4, 0.92)),  # turned to the right wall
        ("stove_main", (3.34, -2.36, 0), (4.0, -1.6, 0.92)),  # flush with it
        ("oven_tall_main", (3.4, -3.16, 0), (4.0, -2.36, 2.0)),  # its cabinet has the oven and the padding
        ("upper_main", (3.6, -1.6, 1.52), (4.0, -0.4, 1.9)),  # up to 1.3 m above the floor, and 0.6 m higher
    ):
        np.testing.assert_allclose(colliding(house, name), (low, high), atol=0.01)


@pytest.mark.slow
def test_our_apartment_imports_with_its_rooms_and_its_floor(tmp_path):
    _, catalogue = imported(tmp_path, models_root() / "houses" / "apartment" / "house.xml")
    ours, again = compiled_house(Catalogue.load()), compiled_house(catalogue)
    bins = np.array([r.center[:2] for house in (ours, again) for r in house.receptacles.values()])
    rng = np.random.default_rng(0)
    for one, other in ((ours, again), (again, ours)):
        points = np.array([one.navigable.sample(rng) for _ in range(1000)])
        points = points[np.linalg.norm(points[:, None] - bins, axis=2).min(axis=1) > 0.9]  # bins move
        same = [np.linalg.norm(other.navigable.snap(p, np.inf) - p) < 0.03 for p in points]
        assert np.mean(same) >= 0.98
        assert np.mean([one.rooms.room_at(p) == other.rooms.room_at(p) for p in points]) >= 0.98


def episode_glb(folder, name):
    """Export a house with objects as one glTF file."""
    catalogue = load_catalogue(name)
    episode = sample_episode(catalogue, objects=6, seed=3, points=10)
    (folder / "ours.glb").write_bytes(export_episode(assemble(episode, catalogue)))
    return catalogue, folder / "ours.glb"


@pytest.mark.slow
def test_an_exported_house_comes_back_with_its_rooms_bins_and_floor(tmp_path):
    catalogue, path = episode_glb(tmp_path, "generated:7?rooms=2")
    decisions, back = imported(tmp_path, path)
    ours, again = compiled_house(catalogue), compiled_house(back)
    assert dict(back.rooms) == dict(catalogue.rooms)
    assert decisions["collision"].endswith("boxes of 5 cm voxels")
    for key, receptacle in ours.receptacles.items():
        np.testing.assert_allclose(again.receptacles[key].center, receptacle.center, atol=2e-3)
        assert back.receptacles[key].room == catalogue.receptacles[key].room
    rng = np.random.default_rng(0)
    points = np.array([ours.navigable.sample(rng) for _ in range(1000)])
    same = [np.linalg.norm(again.navigable.snap(p, np.inf) - p) < 0.03 for p in points]
    assert np.mean(same) >= 0.98  # the six objects on the floor were left out
    assert np.mean([ours.rooms.room_at(p) == again.rooms.room_at(p) for p in points]) >= 0.98
    assert decisions["loose things"].startswith("6 left out")


@pytest.mark.parametrize(
    ("marks", "reason"),
    [
        ({"parts": [{"key": "../x", "label": "X", "polygon": [[0, 0], [1, 0], [1, 1]]}]}, "damaged"),
        ({"parts": [{"key": "x", "label": "X", "polygon": [[0, 0], [1, 0]]}]}, "has no floor"),
        ({"bins": [{"key": "dish_bin"}]}, "damaged"),
        ([], "damaged"),
    ],
)
def test_damaged_marks_of_an_exported_house_are_refused(tmp_path, marks, reason):
    whole = house_scenes.scene()
    whole.graph.update("floor", metadata={"mjsim_house": marks})
    whole.export(tmp_path / "flat.glb")
    with pytest.raises(AssetError, match=reason):
        import_house(tmp_path / "flat.glb", tmp_path / "out", HouseOptions())


def test_boxes_that_touch_are_separate_bodies():
    """Two stacked boxes share four edges, and a wall continues in a lower one."""
    boxes = [
        trimesh.creation.box((2, 0.2, h)).apply_translation((x, 0, h / 2))
        for x, h in ((0, 2), (2, 2), (4, 1))
    ]
    boxes.append(trimesh.creation.box((2, 0.2, 0.5)).apply_translation((4, 0, 1.25)))
    surface = surface_of(trimesh.util.concatenate(boxes), linear=False)
    found = make_solids([ScenePiece("walls", surface)])
    assert (found.boxes, found.hulls, found.voxels) == (4, 0, 0)


PUBLIC = os.environ.get("MJSIM_PUBLIC_HOUSES", "")


@pytest.mark.skipif(not PUBLIC, reason="MJSIM_PUBLIC_HOUSES names no folder with houses of others")
def test_public_houses_import_without_editing_or_are_refused_in_one_line(tmp_path):
    """Return every world and scene below the folder."""
    files = [
        p
        for end in ("*.world", "libero_*.xml", "*.scene_instance.json", "layout*.yaml")
        for p in sorted(Path(PUBLIC).rglob(end))
    ]
    assert files
    usable = 0
    for number, source in enumerate(files):
        try:
            _, report = import_house(source, tmp_path / str(number), HouseOptions(skip_missing=True))
        except AssetError as error:
            assert "\n" not in str(error)
            print(f"refused: {error}")
        else:
            usable += report.usable
    print(f"{usable} of {len(files)} can be used")


INCLUDE = "<include><uri>model://chair</uri></include>"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "cannot read"),
        ("<sdf version='1.6'><world name='a'", "cannot read"),
        ("<mujoco/>", "not SDF"),
        ("<sdf version='1.6'><world name='a'/></sdf>", "no model"),
        (
            f"<sdf version='1.6'><world name='a'>{INCLUDE}</world></sdf>",
            "'model://chair', which is not there",
        ),
        (
            "<sdf version='1.6'><model name='a'><link name='l'><pose>1 2 x</pose><visual name='v'><geometry><sphere>"
            "<radius>1</radius></sphere></geometry></visual></link></model></sdf>",
            "6 numbers",
        ),
    ],
)
def test_a_damaged_world_is_refused_by_its_cause_and_nothing_is_written(tmp_path, text, reason):
    source = tmp_path / "bad.world"
    source.write_text(text)
    with pytest.raises(AssetError, match=reason) as caught:
        import_house(source, tmp_path / "out", HouseOptions())
    assert str(source) in str(caught.value)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_what_is_missing_is_left_out_if_the_user_says_so(tmp_path):
    source, table = write_sdf(tmp_path, extra=INCLUDE), tmp_path / "models" / "table" / "meshes" / "table.obj"
    with pytest.raises(AssetError, match="--skip-missing"):
        import_house(source, tmp_path / "house", HouseOptions())
    table.write_text("v 0 0 0")
    with pytest.raises(AssetError, match="no triangles"):
        import_house(source, tmp_path / "house", HouseOptions())
    decisions, _ = imported(tmp_path, source, skip_missing=True)
    assert "table.obj" in decisions["left out"] and "model://chair" in decisions["left out"]


def test_what_is_missing_is_the_first_cause_of_a_refusal(tmp_path):
    shape = "<visual name='v'><geometry><box><size>1 1 .01</size></box></geometry></visual>"
    box = f"<model name='b'><link name='l'>{shape}</link></model>"
    source = tmp_path / "bare.world"
    source.write_text(f"<sdf version='1.6'><world name='a'>{INCLUDE}{box}</world></sdf>")
    with pytest.raises(AssetError, match=r"1 missing \(model://chair\), and what is left has no walls"):
        import_house(source, tmp_path / "out", HouseOptions(skip_missing=True))


def test_a_folder_that_is_there_is_kept(tmp_path):
    source, out = write_sdf(tmp_path), tmp_path / "mine"
    out.mkdir()
    (out / "letter.txt").write_text("dear")
    for force in (False, True):
        with pytest.raises(AssetError, match="choose another --out"):
            import_house(source, out, HouseOptions(), force=force)
    assert [p.name for p in out.iterdir()] == ["letter.txt"]


@pytest.mark.parametrize(
    ("write", "damage", "reason"),
    [
        (write_mjcf, lambda text: text.replace("<worldbody>", '<worldbody><geom type="ball"/>'), "invalid"),
        (write_mjcf, lambda text: text[: len(text) // 2], "cannot read model"),
        (write_habitat, lambda text: text.replace("stages/flat", "stages/none"), "stage 'none'"),
        (write_habitat, lambda text: text.replace("[2, 0.45, -1]", "[2, -1]"), "3 numbers"),
        (write_habitat, lambda text: text[:-5], "cannot read"),
        (write_habitat, lambda _: "[]", "not a JSON object"),
        (write_robocasa, lambda _: "room: [", "cannot read"),
        (write_robocasa, lambda _: "kitchen: 1", "without a room"),
        (write_robocasa, lambda text: text.replace("type: oven", "type: forge"), "'oven': its type 'forge'"),
        (
            write_robocasa,
            lambda text: text.replace("align_to: stove", "align_to: none"),
            "'tall': KeyError: 'none'",
        ),
        (write_robocasa, lambda text: text.replace("[1.2, 0.65,", "[-1.2, 0.65,"), "'counter': its size"),
    ],
)
def test_a_damaged_scene_is_refused_by_its_cause(tmp_path, write, damage, reason):
    source = write(tmp_path)
    source.write_text(damage(source.read_text()))
    with pytest.raises(AssetError, match=reason) as caught:
        import_house(source, tmp_path / "out", HouseOptions())
    assert str(tmp_path) in str(caught.value)
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("mesh", "options", "reason"),
    [
        (trimesh.creation.box((0.5, 0.5, 0.9)), {}, "nowhere to walk on 0.5 x 0.9 m.*--scale"),
        (trimesh.creation.box((9, 0.02, 9)), {}, "no walls and no furniture"),
        (trimesh.creation.box((900, 700, 3)), {"units": "m"}, "spans 900 x 3 m.*--units cm"),
        (trimesh.creation.box((8, 0.01, 5)), {"up": "z"}, "nowhere|level"),
    ],
)
def test_what_is_no_house_is_refused(tmp_path, mesh, options, reason):
    mesh.export(tmp_path / "it.glb")
    with pytest.raises(AssetError, match=reason):
        import_house(tmp_path / "it.glb", tmp_path / "out", HouseOptions(**options))
    assert not (tmp_path / "out").exists()


def test_a_file_of_another_kind_is_refused_with_the_kinds_that_are_read(tmp_path):
    (tmp_path / "house.usd").write_text("x")
    with pytest.raises(AssetError, match=r"\.world, \.sdf, \.xml"):
        import_house(tmp_path / "house.usd", tmp_path / "out", HouseOptions())


@pytest.mark.parametrize("name", ["there_is_none.world", "."])
def test_a_source_that_is_not_there_is_refused(tmp_path, name):
    with pytest.raises(AssetError, match="is not a file; check the path"):
        import_house(tmp_path / Path(name), tmp_path / "out", HouseOptions())
