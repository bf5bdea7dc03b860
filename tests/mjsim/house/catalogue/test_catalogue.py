"""The catalogue: what ships is complete, and every mistake in a file is reported by name."""

import shutil
from pathlib import Path

import pytest

import mjsim.house.catalogue.house_ref
from experiments.trials.trial_config import TrialConfig
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root, parse_house
from mjsim.values.errors import AssetError

SHIPPED = models_root() / "houses" / "apartment" / "catalogue.toml"


@pytest.fixture
def copy(tmp_path):
    """The shipped catalogue beside an empty house, free to be spoiled."""
    (tmp_path / "house.xml").write_text("<mujoco/>", encoding="utf-8")
    path = tmp_path / "catalogue.toml"
    path.write_text(SHIPPED.read_text(encoding="utf-8"), encoding="utf-8")
    return path


def test_the_apartment_has_the_six_categories_of_the_paper_with_distinct_models():
    catalogue = Catalogue.load()
    assert list(catalogue.categories) == ["dishes", "toys", "books", "laundry", "office", "recycling"]
    for category in catalogue.categories.values():
        assert len(category.objects) >= 4, category.key
        assert catalogue.receptacles[category.receptacle].category == category.key
        assert all(catalogue.objects[key].category == category.key for key in category.objects)
    labels = [item.label for item in (*catalogue.objects.values(), *catalogue.receptacles.values())]
    assert len(set(labels)) == len(labels)  # a participant tells things apart by label


def test_every_file_on_disk_is_in_the_catalogue():
    catalogue = Catalogue.load()
    for folder, entries in (("objects", catalogue.objects), ("receptacles", catalogue.receptacles)):
        assert {path.stem for path in (models_root() / folder).glob("*.xml")} == set(entries)


def test_a_path_gives_the_same_catalogue_as_the_name():
    named, by_path = Catalogue.load("apartment"), Catalogue.load(str(SHIPPED))
    assert (named.objects, named.receptacles, named.categories) == (
        by_path.objects,
        by_path.receptacles,
        by_path.categories,
    )
    assert named.house_path == by_path.house_path
    assert list(named.objects) == list(by_path.objects)  # sampling depends on the order


MISTAKES = {
    "missing object file": ('"objects/mug.xml"', '"objects/mugg.xml"', "mugg.xml"),
    "missing receptacle file": ('"receptacles/toy_box.xml"', '"receptacles/box.xml"', "box.xml"),
    "missing house file": ('model = "house.xml"', 'model = "villa.xml"', "villa.xml"),
    "unknown receptacle": ('receptacle = "dish_bin"', 'receptacle = "sink"', "'sink'"),
    "shared receptacle": ('receptacle = "dish_bin"', 'receptacle = "toy_box"',
        "share the receptacle 'toy_box'"),
    "unknown room": ('room = "bathroom"', 'room = "cellar"', "'cellar'"),
    "unknown object": ('objects = ["mug", ', 'objects = ["cup", ', "'cup'"),
    "object in two categories": ('objects = ["toy_car", ', 'objects = ["mug", "toy_car", ', "objects.mug"),
    "object in no category": ('objects = ["mug", ', "objects = [", "objects.mug"),
    "empty label": ('label = "Blue mug"', 'label = " "', "objects.mug"),
    "label of two lines": ('label = "Blue mug"', 'label = "Blue\\nmug"', "objects.mug"),
    "long label": ('label = "Blue mug"', f'label = "{"mug" * 2000}"', "objects.mug"),
    "label of another object": ('label = "Blue mug"', 'label = "Yellow duck"', "have the same label"),
    "label of another type": ('label = "Blue mug"', "label = 7", "objects.mug"),
    "entry that is no table": ("[categories.dishes]", "[categories]\nextra = 3\n[categories.dishes]",
        "extra"),
    "unknown table": ("[house]", "[houses]", "houses"),
    "category without objects": ('objects = ["socks", "t_shirt", "towel", "jeans", "cap"]', "objects = []",
        "[categories.laundry] Expected `array` of length >= 1 - at `$.objects`"),
    "missing table": ("[rooms]", "[house.rooms]", "missing required field `rooms`"),
    "not TOML": ("[house]", "[house", "catalogue.toml"),
}  # fmt: skip


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_is_reported_with_the_file_and_the_culprit(copy, mistake):
    old, new, culprit = MISTAKES[mistake]
    text = copy.read_text(encoding="utf-8")
    assert old in text
    copy.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(AssetError) as caught:
        Catalogue.load(str(copy))
    assert culprit in str(caught.value)
    assert str(copy) in str(caught.value)


@pytest.mark.parametrize("house", ["castle", "../houses/apartment", "", "nowhere/catalogue.toml"])
def test_an_unknown_house_is_reported_by_name(house):
    with pytest.raises(AssetError, match=r"house name|no house"):
        Catalogue.load(house)


def test_a_house_may_be_named_by_its_folder(tmp_path, monkeypatch):
    shutil.copytree(models_root() / "houses" / "apartment", tmp_path / "mine")
    monkeypatch.chdir(tmp_path)
    file = str(Path("mine", "catalogue.toml"))
    assert Catalogue.load("mine") == Catalogue.load("./mine") == Catalogue.load(file)
    assert (Catalogue.load("mine").name, parse_house("apartment").name) == (file, "apartment")
    for given in ("mine", "./mine", file):
        assert TrialConfig(house=given, objects=2, assistance="none", seed=0).house == str(tmp_path / file)
    assert Catalogue.load("mine").ref.kind == "folder"


def test_an_installed_package_prefers_the_models_it_carries(tmp_path, monkeypatch):
    package = tmp_path / "mjsim"
    (tmp_path / "models" / "houses").mkdir(parents=True)
    (package / "models" / "houses").mkdir(parents=True)
    monkeypatch.setattr(
        mjsim.house.catalogue.house_ref, "__file__", str(package / "house" / "catalogue" / "assets.py")
    )
    assert models_root() == (package / "models").resolve()


def test_a_package_without_models_says_where_it_looked(tmp_path, monkeypatch):
    monkeypatch.setattr(
        mjsim.house.catalogue.house_ref,
        "__file__",
        str(tmp_path / "mjsim" / "house" / "catalogue" / "assets.py"),
    )
    with pytest.raises(AssetError) as caught:
        models_root()
    assert str(tmp_path.resolve() / "models") in str(caught.value)


def test_a_name_that_no_file_can_have_is_refused_as_any_other(copy):
    spoiled = copy.read_text(encoding="utf-8").replace('"house.xml"', f'"{"x" * 5000}"', 1)
    copy.write_text(spoiled, encoding="utf-8")
    with pytest.raises(AssetError, match="which is neither in") as refused:
        Catalogue.load(str(copy))
    assert len(str(refused.value)) < 1000
