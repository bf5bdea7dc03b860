"""Extend a house with imported objects. Each object has its own folder, which is written atomically."""

import json
import os
import re
import unicodedata
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from mjsim.formats.scene.source_scene import ImportDecision
from mjsim.formats.scene.surface import Floats
from mjsim.generator.home_cache import load_catalogue
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.house_ref import CATALOGUE, parse_house
from mjsim.house.compiled.house import compiled_house
from mjsim.importing.object.model_writer import MODEL
from mjsim.support.files import exchange, read_text, work_folder, write_text_atomically
from mjsim.support.toml import parse_toml, toml_tables
from mjsim.values.errors import AssetError

HELD = 4  # minimum number of identical objects that must fit into a bin
_SLOTS = 2  # number of slots along each side of a bin, as in `mjsim.world.body.slots`
MAX_LABEL = 40
_UNNAMED = ".unnamed"  # name of a file that marks an object that is not in the catalogue yet
_WALL_GAP = 0.02  # gap between an object and the walls of its bin, in metres
_HEADER = "# Objects that a house has in addition. Run in it with --house and the path of this file.\nextends = {}\n"


@dataclass(frozen=True)
class CatalogueEntry:
    """The key, the label and the category of an object in a catalogue."""

    key: str  # key in the catalogue, which is also the name of the object's folder
    label: str  # object name shown to participants
    category: str

    @classmethod
    def named(cls, name: str, category: str) -> "CatalogueEntry":
        """Create an entry from a name such as `Toy robot`. Raise an AssetError if the name is not valid."""
        label = " ".join(name.replace("_", " ").split())
        plain = unicodedata.normalize("NFKD", label.lower()).encode("ascii", "ignore").decode()
        key = re.sub(r"[^a-z0-9]+", "_", plain).strip("_")
        if not key or len(label) > MAX_LABEL or not label.isprintable():
            raise AssetError(
                f"--name {name!r:.60} must have a Latin letter or digit and at most {MAX_LABEL} characters"
            )
        return cls(key, label[0].upper() + label[1:], category)


class HouseExtension:
    """A folder with a catalogue that extends a house with imported objects. It is created when needed."""

    def __init__(self, folder: Path, house: str | None = None) -> None:
        """Open or prepare a folder that extends `house`. A new folder extends `apartment` by default.

        Raise an AssetError if `folder` is a file, or if its catalogue is invalid or extends another house.
        """
        self.folder = folder
        self.path = folder / CATALOGUE
        if folder.exists() and not folder.is_dir():
            raise AssetError(f"{folder} is not a folder; choose another --out")
        if self.path.exists():
            self.catalogue = load_catalogue(str(self.path))
            self._text = read_text(self.path)
            extended = parse_toml(self._text).get("extends")
            if house is not None and extended != _reference(house, folder):
                owner = extended or self.catalogue.label
                raise AssetError(f"{self.path} belongs to {owner!r}, not to {house!r}; choose another --out")
        else:
            self.catalogue = load_catalogue(house or "apartment")
            self._text = _HEADER.format(json.dumps(_reference(house or "apartment", folder)))

    def check(self, entry: CatalogueEntry, *, force: bool) -> None:
        """Check that an object can be added. Call this before computing its model.

        Raises:
            AssetError: The category is unknown, or the key is in use.
        """
        if entry.category not in self.catalogue.categories:
            raise AssetError(
                f"no category {entry.category!r}; there are {', '.join(self.catalogue.categories)}"
            )
        mine = self.folder / entry.key
        known = self.catalogue.objects.get(entry.key)
        if known is not None and known.path.resolve().parent != mine.resolve():
            raise AssetError(
                f"the house already has an object {entry.key!r} ({known.label}); choose another --name"
            )
        abandoned = known is None and (mine / _UNNAMED).exists()  # left by an interrupted import
        if (known is not None or mine.exists()) and not (force or abandoned):
            raise AssetError(f"{mine} is already there; choose another --name, or use --force to replace it")
        if mine.exists() and not (mine / MODEL).is_file():
            raise AssetError(f"{mine} is not an imported object and is not replaced; choose another --name")

    def fit(self, entry: CatalogueEntry, size: Floats) -> ImportDecision:
        """Check that an object of size (3,), in metres, fits into its bin, and return a line for the report.

        Raise an AssetError if so few objects of this size fit into the bin that a task could be impossible.
        """
        receptacle = self.catalogue.receptacles[self.catalogue.categories[entry.category].receptacle]
        room = 2 * compiled_house(self.catalogue).receptacles[receptacle.key].half_size
        sides = " x ".join(f"{side:.2f}" for side in size)
        inside = " x ".join(f"{side:.2f}" for side in room)
        if held_in(room, size) < HELD:
            factor = next(f for f in np.arange(0.99, 0.0, -0.01) if held_in(room, f * size) >= HELD)
            raise AssetError(
                f"it measures {sides} m, and {HELD} of these do not fit into {receptacle.label!r} ({inside} m); "
                f"use --scale {factor:.2f} times the present one, or choose another category"
            )
        return ImportDecision("size", f"{sides} m", f"{receptacle.label} has {inside} m")

    def add(self, entry: CatalogueEntry, write: Callable[[Path], None], *, force: bool = False) -> Catalogue:
        """Add an object, or replace it if `force` is True. If this fails, the folder is unchanged.

        `write` writes the object's files into a folder. Raises an AssetError for the same reasons as `check`.
        """
        self.check(entry, force=force)
        created = not self.folder.exists()
        self.folder.mkdir(parents=True, exist_ok=True)
        try:
            with work_folder(self.folder) as work:
                new = work / "new"
                new.mkdir()
                write(new)
                return self._install(entry, new)
        finally:
            if created and not any(self.folder.iterdir()):
                self.folder.rmdir()

    def _install(self, entry: CatalogueEntry, new: Path) -> Catalogue:
        """Move an object's folder into place and add the object to the catalogue. Undo both on failure."""
        place = self.folder / entry.key
        before = self._text if self.path.exists() else None
        swap = exchange if place.exists() else Path.rename
        (new / _UNNAMED).touch()
        swap(new, place)
        try:
            write_text_atomically(self.path, self._with(entry))
            catalogue = load_catalogue(str(self.path))
        except BaseException:
            swap(place, new)
            if before is None:
                self.path.unlink(missing_ok=True)
            else:
                write_text_atomically(self.path, before)
            raise
        (place / _UNNAMED).unlink()
        return catalogue

    def _with(self, entry: CatalogueEntry) -> str:
        values = {"label": entry.label, "category": entry.category, "model": f"{entry.key}/{MODEL}"}
        table = rf"^\[objects\.{entry.key}\][^\n]*\n(?:(?!\[).*\n?)*"
        kept = re.sub(table, "", self._text, flags=re.MULTILINE)
        return kept.rstrip("\n") + "\n\n" + toml_tables({f"objects.{entry.key}": values})


def held_in(room: Floats, size: Floats) -> int:
    """Return the number of objects of size (3,) that fit into a bin with an interior of size (3,).

    The objects stand upright in layers, in the slots that people use, with their centres inside the bin. The
    number is valid for all sides from which a person may fill the bin.
    """
    layers = int(room[2] / size[2] + 0.5)
    turned = (size[:2], size[1::-1])  # A person may turn an object by 90 degrees.
    beside = [np.minimum((room[:2] - 2 * _WALL_GAP) // across, _SLOTS).prod() for across in turned]
    return int(min(beside)) * layers


def _reference(house: str, folder: Path) -> str:
    """Return the name of a house. If `house` is a path, return the path relative to the folder."""
    named = parse_house(house)
    return os.path.relpath(Path(named.name).resolve(), folder.resolve()) if named.is_path else named.name
