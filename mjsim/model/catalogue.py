"""What a house offers: its rooms, categories, receptacles and object models, read from `catalogue.toml`."""

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from mjsim.errors import AssetError
from mjsim.model.assets import models_root
from mjsim.model.library import Library


@dataclass(frozen=True)
class ObjectModel:
    """A kind of object that can be misplaced.

    Attributes:
        key: Catalogue key (`mug`).
        label: Name shown to the person (`Blue mug`).
        category: Category key it belongs to.
        path: Its MJCF file.
    """

    key: str
    label: str
    category: str
    path: Path


@dataclass(frozen=True)
class Receptacle:
    """A container that takes the objects of one category.

    Attributes:
        key: Catalogue key (`dish_bin`); the house has a site `mount:<key>`.
        label: Name shown to the person (`Dish bin`).
        place: Semantic location within the room (`on the counter, beside the sink`).
        room: Room key.
        category: Category key it takes.
        path: Its MJCF file.
    """

    key: str
    label: str
    place: str
    room: str
    category: str
    path: Path


@dataclass(frozen=True)
class Category:
    """Objects that belong into the same receptacle (PAPER section 4).

    Attributes:
        key: Catalogue key (`dishes`).
        label: Name shown to the person (`Dishes`).
        receptacle: Receptacle key.
        objects: Object model keys, in the catalogue's order.
    """

    key: str
    label: str
    receptacle: str
    objects: tuple[str, ...]


@dataclass(frozen=True)
class Catalogue:
    """Everything a house can be furnished and cluttered with; mappings keep the file's order.

    Attributes:
        name: What `Catalogue.load` was given: a name under `models/houses`, or a path.
        label: Name of the house shown to the person.
        house_path: MJCF file of the house.
        rooms: Room key -> label.
        categories: Category key -> category.
        receptacles: Receptacle key -> receptacle.
        objects: Object model key -> object model.
        library: The models, once they are read.
    """

    name: str
    label: str
    house_path: Path
    rooms: Mapping[str, str]
    categories: Mapping[str, Category]
    receptacles: Mapping[str, Receptacle]
    objects: Mapping[str, ObjectModel]
    library: Library = field(default_factory=Library, compare=False, repr=False)

    @classmethod
    def load(cls, house: str = "apartment") -> "Catalogue":
        """Read and check the catalogue of a house.

        Args:
            house: Name of a folder under `models/houses`, or the path of a `catalogue.toml`.

        Raises:
            AssetError: The catalogue or a file it names is missing, or an entry is malformed, unknown, unused
                or used twice; the message names the culprit.
        """
        path = _catalogue_path(house)
        reader = _Reader(path, _parse(path))
        owner = reader.owners()
        receptacle_category = {c.receptacle: c.key for c in reader.categories().values()}
        return cls(
            name=house,
            label=reader.text(reader.table("house"), "house", "label"),
            house_path=reader.file(reader.table("house"), "house", path.parent),
            rooms=reader.rooms(),
            categories=reader.categories(),
            receptacles=reader.receptacles(receptacle_category),
            objects=reader.objects(owner),
        )

    def receptacle_of(self, model: str) -> Receptacle:
        """Receptacle that takes the object model `model`.

        Raises:
            AssetError: No such object model.
        """
        if model not in self.objects:
            raise AssetError(
                f"object model {model!r} is not in the catalogue {self.name!r}: {sorted(self.objects)}"
            )
        return self.receptacles[self.categories[self.objects[model].category].receptacle]


def _catalogue_path(house: str) -> Path:
    if house.endswith(".toml"):
        path = Path(house)
        if not path.is_file():
            raise AssetError(f"no catalogue at {path}; give a house name or the path of a catalogue.toml")
        return path.resolve()
    houses = models_root() / "houses"
    path = houses / house / "catalogue.toml"
    # A name with a separator would leave the folder of houses: that is a path, and paths end in .toml.
    if Path(house).name != house or not path.is_file():
        known = sorted(p.parent.name for p in houses.glob("*/catalogue.toml"))
        raise AssetError(f"no house {house!r}; there are {known}, or give the path of a catalogue.toml")
    return path


def _parse(path: Path) -> dict[str, Any]:
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError) as error:
        raise AssetError(f"cannot read catalogue {path}: {error}") from error


class _Reader:
    """Typed access to a parsed catalogue; every error names the file and the entry."""

    def __init__(self, path: Path, raw: dict[str, Any]) -> None:
        self._path = path
        self._raw = raw
        known = {"house", "rooms", "categories", "receptacles", "objects"}
        if unknown := sorted(set(raw) - known):
            raise self._error(f"unknown table [{unknown[0]}]; the tables are {sorted(known)}")

    def _error(self, message: str) -> AssetError:
        return AssetError(f"{self._path}: {message}")

    def table(self, name: str) -> dict[str, Any]:
        table = self._raw.get(name)
        if not isinstance(table, dict) or not table:
            raise self._error(f"table [{name}] is missing or empty")
        return table

    def entries(self, name: str) -> dict[str, dict[str, Any]]:
        table = self.table(name)
        for key, entry in table.items():
            if not isinstance(entry, dict):
                raise self._error(f"[{name}.{key}] must be a table, got {entry!r}")
        return table

    def text(self, entry: Mapping[str, Any], where: str, field: str) -> str:
        value = entry.get(field)
        if not isinstance(value, str) or not value.strip():
            raise self._error(f"[{where}] needs a non-empty text {field!r}, got {value!r}")
        return value

    def file(self, entry: Mapping[str, Any], where: str, folder: Path) -> Path:
        path = folder / self.text(entry, where, "model")
        if not path.is_file():
            raise self._error(f"[{where}] names the model {path}, which does not exist")
        return path

    def rooms(self) -> dict[str, str]:
        rooms = self.table("rooms")
        return {key: self.text(rooms, "rooms", key) for key in rooms}

    def owners(self) -> dict[str, str]:
        """Object model key -> category key, each object in exactly one category."""
        owner: dict[str, str] = {}
        for category in self.categories().values():
            for key in category.objects:
                if key in owner:
                    raise self._error(
                        f"object {key!r} is in the categories {owner[key]!r} and {category.key!r}; keep one"
                    )
                owner[key] = category.key
        return owner

    def categories(self) -> dict[str, Category]:
        categories: dict[str, Category] = {}
        taken: dict[str, str] = {}
        for key, entry in self.entries("categories").items():
            where = f"categories.{key}"
            receptacle = self.text(entry, where, "receptacle")
            if receptacle not in self.entries("receptacles"):
                raise self._error(
                    f"[{where}] names the receptacle {receptacle!r}, which is not in [receptacles]"
                )
            if receptacle in taken:
                raise self._error(
                    f"[{where}] and [categories.{taken[receptacle]}] share the receptacle {receptacle!r}"
                )
            taken[receptacle] = key
            categories[key] = Category(
                key, self.text(entry, where, "label"), receptacle, self._category_objects(entry, where)
            )
        return categories

    def _category_objects(self, entry: Mapping[str, Any], where: str) -> tuple[str, ...]:
        objects = entry.get("objects")
        if not isinstance(objects, list) or not objects:
            raise self._error(f"[{where}] has no object: 'objects' must list at least one key of [objects]")
        known = self.entries("objects")
        for key in objects:
            if not isinstance(key, str) or key not in known:
                raise self._error(f"[{where}] lists the object {key!r}, which is not in [objects]")
        return tuple(objects)

    def receptacles(self, category_of: Mapping[str, str]) -> dict[str, Receptacle]:
        rooms = self.rooms()
        receptacles: dict[str, Receptacle] = {}
        for key, entry in self.entries("receptacles").items():
            where = f"receptacles.{key}"
            room = self.text(entry, where, "room")
            if room not in rooms:
                raise self._error(
                    f"[{where}] is in the room {room!r}, which is not in [rooms]: {sorted(rooms)}"
                )
            if key not in category_of:
                raise self._error(f"[{where}] takes no category; name it in one of [categories] or remove it")
            label, place = self.text(entry, where, "label"), self.text(entry, where, "place")
            path = self.file(entry, where, models_root())
            receptacles[key] = Receptacle(key, label, place, room, category_of[key], path)
        return receptacles

    def objects(self, category_of: Mapping[str, str]) -> dict[str, ObjectModel]:
        objects: dict[str, ObjectModel] = {}
        for key, entry in self.entries("objects").items():
            where = f"objects.{key}"
            if key not in category_of:
                raise self._error(f"[{where}] is in no category; list it in one of [categories] or remove it")
            path = self.file(entry, where, models_root())
            objects[key] = ObjectModel(key, self.text(entry, where, "label"), category_of[key], path)
        return objects
