"""Generated houses: the same in every process, found by their names, and usable."""

import multiprocessing
from pathlib import Path

import mujoco
import pytest

from experiments.cli.main import main
from experiments.errors import ConfigError
from experiments.trials.design import read_design
from mjsim.generator.files import house_files
from mjsim.generator.generated import generate
from mjsim.generator.home_cache import load_catalogue
from mjsim.generator.recipe import read_recipe
from mjsim.generator.views import landscapes
from mjsim.house.catalogue.generated_names import VERSION, generated_names, parse_name, split_of
from mjsim.house.catalogue.house_ref import models_root
from mjsim.house.check import check_path
from mjsim.house.scene.sampling import sample_episode
from mjsim.values.errors import HouseError


def files_of(seed: int, rooms: int) -> dict[str, bytes]:
    return dict(house_files(*generate(seed, rooms), models_root()))


@pytest.mark.slow
def test_another_process_makes_the_same_bytes() -> None:
    here = [files_of(3, 1), files_of(4, 3)]
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        there = pool.starmap(files_of, [(4, 3), (3, 1)])
    assert here == there[::-1]


def test_a_door_mat_is_not_on_the_rug_of_a_living_room() -> None:
    report = check_path("generated:872047?rooms=3", load=load_catalogue)
    assert report.facts["drawn overlaps"] == report.facts["flickering faces"] == "none"


@pytest.mark.parametrize("rooms", [1, 3, 6])
def test_a_house_can_be_used_and_holds_as_many_objects_as_it_says(rooms: int) -> None:
    report = check_path(f"generated:11?rooms={rooms}", load=load_catalogue)
    assert not report.findings
    assert report.facts["drawn overlaps"] == report.facts["flickering faces"] == "none"
    catalogue = load_catalogue(f"generated:11?rooms={rooms}")
    assert len(catalogue.rooms) == rooms
    assert (catalogue.points or 0) >= (24 if rooms >= 4 else 14)
    assert len(sample_episode(catalogue, objects=8, seed=5).objects) == 8


def test_the_windows_of_a_house_have_different_views() -> None:
    images = {asset.name: asset.image for asset in landscapes(11) if asset.image}
    assert len(images) == len(set(images.values())) == 4
    assert images == {asset.name: asset.image for asset in landscapes(11) if asset.image}
    assert not set(images.values()) & {asset.image for asset in landscapes(12)}
    house = load_catalogue("generated:11?rooms=3").house_path
    for side in ("north", "east", "south", "west"):
        assert f'name="outside/{side}"' in house.read_text()
        assert (house.parent / "textures" / f"view_{side}_image.png").read_bytes() == images[
            f"view_{side}_image"
        ]


def test_a_house_is_recorded_with_its_rooms_and_the_version() -> None:
    catalogue = load_catalogue("generated:11?rooms=3")
    assert catalogue.name == f"generated:11?rooms=3&version={VERSION}"
    assert load_catalogue(catalogue.name) == catalogue
    assert catalogue.ref.kind == "generated"


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "rooms", "seats"), [(991001, 2, {"sofa"}), (991010, 1, {"armchair"})])
def test_a_studio_has_seats_and_a_television_or_stove(seed: int, rooms: int, seats: set[str]) -> None:
    _, furnishing = generate(seed, rooms)
    kinds = {placement.name for placement in furnishing.placements if placement.room == "studio"}
    assert kinds >= seats
    assert kinds & {"tv_stand", "stove"}


def test_a_recipe_gives_the_same_house(tmp_path: Path) -> None:
    recipe, _ = generate(11, 3)
    path = tmp_path / "house.json"
    path.write_bytes(recipe.encoded())
    assert read_recipe(path) == recipe
    assert load_catalogue(str(path)) == load_catalogue("generated:11?rooms=3")


def test_a_recipe_of_another_version_is_refused(tmp_path: Path) -> None:
    recipe, _ = generate(11, 1)
    path = tmp_path / "house.json"
    path.write_bytes(recipe.encoded().replace(f'"version": {VERSION}'.encode(), b'"version": 99'))
    with pytest.raises(HouseError, match=r"version 99 .* this mjsim has version"):
        load_catalogue(str(path))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("generated:", "names no house; write generated:7"),
        ("generated:x", "names no house"),
        ("generated:7?rooms=11", "has 11 rooms; ask for 1 to 10"),
        ("generated:7?size=3", "names no house"),
        ("generated:7?rooms=5&version=99", "version 99"),
        ("generated:7?rooms=5&version=3", "makes other homes from the same seeds"),
    ],
)
def test_malformed_names_are_refused(name: str, message: str) -> None:
    with pytest.raises(HouseError, match=message):
        load_catalogue(name)


def test_the_number_of_rooms_follows_from_the_seed() -> None:
    assert {parse_name(f"generated:{seed}").rooms for seed in range(200)} == set(range(1, 11))
    assert parse_name("generated:7") == parse_name("generated:7")


def test_most_seeds_are_for_training() -> None:
    splits = [split_of(seed) for seed in range(1000)]
    assert 760 < splits.count("train") < 840
    assert 70 < splits.count("test") < 130


def test_a_range_of_seeds_names_houses_and_a_split_some_of_them() -> None:
    assert generated_names("generated:3:5?rooms=4") == [
        f"generated:{seed}?rooms=4&version={VERSION}" for seed in (3, 4)
    ]
    parts = [generated_names(f"generated:0:40?split={name}") for name in ("train", "validation", "test")]
    assert sorted(name for part in parts for name in part) == sorted(generated_names("generated:0:40"))


@pytest.mark.parametrize("houses", ["generated:5:5", "generated:1:x", "generated:0:9?split=mine"])
def test_a_malformed_range_is_refused(houses: str) -> None:
    with pytest.raises(HouseError, match="names no house"):
        generated_names(houses)


def test_the_command_writes_a_house_that_stock_mujoco_loads(tmp_path: Path) -> None:
    out = tmp_path / "house"
    assert (
        main(["house", "generate", "--rooms", "2", "--seed", "11", "--no-pictures", "--out", str(out)]) == 0
    )
    assert mujoco.MjModel.from_xml_path(str(out / "house.xml")).ngeom > 100
    assert len(load_catalogue(str(out)).rooms) == 2
    assert load_catalogue(str(out / "recipe.json")) == load_catalogue("generated:11?rooms=2")


def test_people_of_a_design_get_a_house_each(tmp_path: Path) -> None:
    path = tmp_path / "design.toml"
    cell = 'objects = 4\nassistance = "none"\nhouses = "generated:5:8?rooms=3"\n'
    path.write_text(f"[[cells]]\n{cell}")
    assert [trial.house for trial in read_design(path).trials] == generated_names("generated:5:8?rooms=3")
    path.write_text(f'[[cells]]\n{cell}house = "apartment"\n')
    with pytest.raises(ConfigError, match="leave out house and episode"):
        read_design(path)
