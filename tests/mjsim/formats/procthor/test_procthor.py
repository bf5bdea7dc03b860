"""ProcTHOR's house JSON: a house is read with its plan, doors and furniture, and our plans come back the same."""

import json

import numpy as np
import pytest
from house_scenes import write_procthor

from experiments.cli import main as cli
from mjsim.formats.procthor.plan import read_plan
from mjsim.formats.scene.source_scene import HouseOptions
from mjsim.generator.home_cache import load_catalogue
from mjsim.generator.recipe import floor_plan_of
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import compiled_house
from mjsim.importing.house.house_import import import_house
from mjsim.values.errors import AssetError


def area(room):
    return sum((x1 - x0) * (y1 - y0) for x0, y0, x1, y1 in room.boxes)


def test_rooms_walls_and_openings_are_read(tmp_path):
    plan, things = read_plan(write_procthor(tmp_path / "house.json"))
    assert {room.key: area(room) for room in plan.rooms} == {
        "kitchen": 16, "living_room": 38, "bedroom": 20, "bathroom": 16,
    }  # fmt: skip
    doors = [opening for opening in plan.openings if opening.is_door]
    assert [door.rooms for door in doors] == [
        ("bedroom", "living_room"), ("bathroom", "living_room"), ("living_room",),
    ]  # fmt: skip
    # measured along each wall from where that begins
    assert [(door.start, door.end) for door in doors] == [
        ((1.8, 6.0), (0.8, 6.0)), ((8.5, 6.0), (7.5, 6.0)), ((9.0, 4.0), (9.0, 3.0)),
    ]  # fmt: skip
    assert not any(4 in (wall.start[0], wall.end[0]) and wall.start[0] == wall.end[0] for wall in plan.walls)
    assert len(things) == 7


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"rooms": []}, "has no rooms"),
        ({"rooms": 3}, "as a house of ProcTHOR: Expected `array`"),
        ({"rooms": [{"id": "room|1", "floorPolygon": [{"x": 1}, {"x": 2}]}]}, "'room|1' has no floor"),
        (
            {"rooms": [{"id": "room|1", "floorPolygon": [{}, {"x": 99}, {"z": 99}]}]},
            "'room|1' spans more than 60 m",
        ),
        ({"walls": [{"id": "wall|1", "polygon": []}]}, "'wall|1' has no lower edge"),
        ({"objects": [{"id": "Bed|1", "position": {"x": 1e9}}]}, "as a house of ProcTHOR: Expected `float`"),
        ({"doors": [{"id": "door|1|2", "wall0": "wall|9"}]}, "'door|1|2' has no hole in a wall"),
    ],
)
def test_what_is_no_house_is_refused_in_one_line(tmp_path, changes, problem):
    path = write_procthor(tmp_path / "house.json", **changes)
    with pytest.raises(AssetError) as error:
        import_house(path, tmp_path / "out", HouseOptions())
    assert problem in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.slow
def test_a_house_is_imported_with_furniture_of_ours_in_the_size_of_the_source(tmp_path):
    database = {"Sofa": [{"assetId": "Sofa_1", "boundingBox": {"x": 1.9, "y": 0.8, "z": 1.0}}]}
    (tmp_path / "asset-database.json").write_text(json.dumps(database))
    options = HouseOptions(models=(tmp_path,))
    decisions, report = import_house(write_procthor(tmp_path / "house.json"), tmp_path / "out", options)
    assert [f for f in report.findings if f.severity == "error"] == []
    said = {decision.what: f"{decision.choice}: {decision.reason}" for decision in decisions}
    assert said["plan"].startswith("4 rooms, 3 doors, 1 windows")
    assert said["furniture"].startswith("6 of our kinds")
    assert said["boxes"] == "1: no kind of ours is similar: 1 garbagecan"
    house = compiled_house(Catalogue.load(str(tmp_path / "out")))
    assert [house.rooms.room_at(p) for p in ((2, 2), (2, 5), (7, 3), (2, 8), (7, 8))] == [
        "kitchen", "living_room", "living_room", "bedroom", "bathroom",
    ]  # fmt: skip
    for inside in ((1.3, 6.0), (8.0, 6.0), (4.0, 2.0), (6.5, 1.3)):  # doors, the open side, before the sofa
        assert house.navigable.is_navigable(inside)
    for inside in ((4.5, 6.0), (9.0, 3.5), (2.0, 4.0), (6.5, 0.8)):  # walls, the front door, the sofa
        assert not house.navigable.is_navigable(inside)


def test_our_plans_come_back_with_the_same_rooms_and_doors(tmp_path):
    path = tmp_path / "plan.json"
    for name in ("generated:7?rooms=5", "generated:31?rooms=2"):
        assert (
            cli.main(
                ["house", "export", "--house", name, "--format", "procthor", "--out", str(path), "--force"]
            )
            == 0
        )
        ours, (again, _) = floor_plan_of(load_catalogue(name).house_path), read_plan(path)
        assert [(room.key, room.label) for room in again.rooms] == [(r.key, r.label) for r in ours.rooms]
        np.testing.assert_allclose(
            [area(room) for room in again.rooms], [r.floor.grown(0.06).area for r in ours.rooms], atol=0.01
        )
        doors = [one for one in again.openings if one.is_door]
        for door, one in zip(ours.doors, doors, strict=True):
            middle = np.add(one.start, one.end) / 2
            along = 0 if door.side in ("south", "north") else 1
            assert one.rooms == door.rooms
            assert middle[along] == pytest.approx(door.center, abs=1e-3)
            assert np.ptp((one.start, one.end), axis=0)[along] == pytest.approx(door.width, abs=1e-3)
        assert len(again.openings) == len(doors) + len(ours.windows)


@pytest.mark.slow
def test_our_plans_are_imported_with_the_same_rooms(tmp_path):
    path, name = tmp_path / "plan.json", "generated:7?rooms=5"
    cli.main(["house", "export", "--house", name, "--format", "procthor", "--out", str(path)])
    import_house(path, tmp_path / "out", HouseOptions())
    ours, house = (
        floor_plan_of(load_catalogue(name).house_path),
        compiled_house(Catalogue.load(str(tmp_path / "out"))),
    )
    for room in ours.rooms:
        inner = room.floor.grown(-0.2)
        corners = [(inner.x0, inner.y0), (inner.x0, inner.y1), (inner.x1, inner.y0), (inner.x1, inner.y1)]
        assert {house.rooms.room_at(corner) for corner in corners} == {room.key}
        assert house.rooms.contains((room.floor.x0 + 0.01, room.floor.y0 + 0.01))


def test_a_house_without_a_plan_is_refused(tmp_path, capsys):
    assert cli.main(["house", "export", "--format", "procthor", "--out", str(tmp_path / "plan.json")]) == 2
    assert "has no recipe.json" in capsys.readouterr().err
