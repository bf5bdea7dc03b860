"""References to houses: parsed once, recorded as ever, and generated only on request."""

from pathlib import Path

import pytest

from mjsim.generator.home_cache import ensured, load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import models_root, parse_house
from mjsim.values.errors import AssetError, HouseError

# name -> kind, name in records, which must never change
RECORDED = {
    "apartment": ("shipped", "apartment"),
    "castle": ("shipped", "castle"),  # reading it fails, not naming it
    "": ("shipped", ""),
    "mine": ("folder", "mine/catalogue.toml"),
    "./mine": ("folder", "mine/catalogue.toml"),
    "nowhere/else": ("folder", "nowhere/else/catalogue.toml"),
    "mine/catalogue.toml": ("folder", "mine/catalogue.toml"),
    "other.toml": ("folder", "other.toml"),
    "/far/away.toml": ("folder", "/far/away.toml"),
    "mine/recipe.json": ("recipe", "mine/recipe.json"),
    "generated:7": ("generated", "generated:7?rooms=5&version=4"),
    "generated:7?rooms=5": ("generated", "generated:7?rooms=5&version=4"),
    "generated:7?rooms=5&version=4": ("generated", "generated:7?rooms=5&version=4"),
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a catalogue in `mine`, which is the current folder; generated homes are kept in it."""
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "catalogue.toml").touch()
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    return tmp_path


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("given", RECORDED)
def test_a_house_is_recorded_by_the_same_bytes_as_ever(given: str) -> None:
    kind, name = RECORDED[given]
    found = parse_house(given)
    assert (found.kind, found.name) == (kind, name)
    assert found.is_path == (kind in ("folder", "recipe"))
    assert parse_house(name).name == name


@pytest.mark.parametrize("given", RECORDED)
def test_a_relative_path_starts_from_the_folder_that_is_given(folder: Path, given: str) -> None:
    kind, name = RECORDED[given]
    found = parse_house(given, folder)
    assert (found.kind, found.name) == (kind, str(folder / name) if found.is_path else name)


def test_a_shipped_house_wins_over_a_folder_of_its_name(folder: Path) -> None:
    (folder / "apartment").mkdir()
    (folder / "apartment" / "catalogue.toml").touch()
    assert parse_house("apartment").file == models_root() / "houses" / "apartment" / "catalogue.toml"
    assert parse_house("./apartment").file == Path("apartment/catalogue.toml")


def test_reading_a_catalogue_generates_nothing(folder: Path) -> None:
    (folder / "mine" / "catalogue.toml").write_text('extends = "generated:11?rooms=1"\n')
    for house in ("generated:11?rooms=1", "recipe.json", "mine"):
        with pytest.raises(AssetError, match=r"has not been generated; load it with mjsim\.load_catalogue"):
            Catalogue.load(house)
    assert not (folder / "cache" / "houses").exists()


def test_a_home_is_generated_for_its_name_and_for_a_catalogue_that_extends_it(folder: Path) -> None:
    home = ensured(parse_house("generated:11?rooms=1"))
    assert home.file is not None and home.file.is_relative_to(folder / "cache")
    (folder / "mine" / "catalogue.toml").write_text(
        'extends = "generated:11?rooms=1"\nhouse.label = "Mine"\n'
    )
    (folder / "further.toml").write_text('extends = "mine"\n')
    further = load_catalogue("further.toml")
    assert (further.label, further.name) == ("Mine", "further.toml")
    assert further.rooms == Catalogue.read(home).rooms
    assert further.house_path == home.file.with_name("house.xml")


def test_catalogues_that_extend_each_other_are_refused(folder: Path) -> None:
    for name, other in (("a", "b"), ("b", "a")):
        (folder / f"{name}.toml").write_text(f'extends = "{other}.toml"\n')
    with pytest.raises(AssetError, match="does not lead to a complete catalogue"):
        load_catalogue("a.toml")


def test_an_unreadable_recipe_is_refused(folder: Path) -> None:
    (folder / "recipe.json").write_text("[]")
    with pytest.raises(HouseError, match="cannot read recipe"):
        load_catalogue("recipe.json")
