"""Load catalogues, which define the rooms, categories, receptacles and object models of houses."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any, TypeVar

import msgspec

from mjsim.house.catalogue.files import Label, catalogue_file, read_labels, read_tables
from mjsim.house.catalogue.house_ref import HouseRef, models_root, parse_house
from mjsim.house.catalogue.model_files import content_hash
from mjsim.support.files import is_file
from mjsim.values.episode import POINTS
from mjsim.values.errors import AssetError, brief

T = TypeVar("T")


@dataclass(frozen=True)
class ObjectModel:
    """A model of an object that can be misplaced in an episode."""

    key: str  # key of the object model in the catalogue, such as `mug`
    label: str  # object name shown to participants, such as `Blue mug`
    category: str
    path: Path


@dataclass(frozen=True)
class Receptacle:
    """A container, such as a bin or a shelf, for the objects of one category."""

    key: str  # key in the catalogue, such as `dish_bin`; the house has a site `mount:<key>` for it
    label: str  # receptacle name shown to participants, such as `Dish bin`
    place: str  # location in the room, such as `on the counter, beside the sink`
    room: str
    category: str
    path: Path


@dataclass(frozen=True)
class Category:
    """A category of objects, all of which belong in the same receptacle (PAPER section 4)."""

    key: str  # key of the category in the catalogue, such as `dishes`
    label: str  # category name shown to participants, such as `Dishes`
    receptacle: str
    objects: tuple[str, ...]  # keys of the category's object models, in the order of the catalogue


@dataclass(frozen=True, eq=False)
class Catalogue:
    """The contents of the catalogue of a house.

    Mappings keep the order of the file. Two catalogues are equal if all their files have equal contents.

    Attributes:
        ref: Reference with which the house was loaded.
        label: Name of the house that is shown to participants.
        house_path: MJCF file of the house.
        rooms: Room key -> label.
        categories: Category key -> category.
        receptacles: Receptacle key -> receptacle.
        objects: Object model key -> object model.
        content: Hash of the catalogue and of all model, mesh and texture files that it refers to.
        folder: Folder of the catalogue.
        points: Number of object positions that the house is designed for, or None if not specified.
    """

    ref: HouseRef
    label: str
    house_path: Path
    rooms: Mapping[str, str]
    categories: Mapping[str, Category]
    receptacles: Mapping[str, Receptacle]
    objects: Mapping[str, ObjectModel]
    content: str
    folder: Path
    points: int | None = None

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Catalogue) and self.content == other.content

    def __hash__(self) -> int:
        return hash(self.content)

    @property
    def name(self) -> str:
        """The house's name, as given on the command line."""
        return self.ref.name

    def in_language(self, language: str) -> "Catalogue":
        """Return a copy with labels and locations in another language. Texts without a translation are kept.

        Raises:
            AssetError: A label file cannot be read.
        """
        labels = read_labels(language, (models_root(), self.folder))

        def translated(text: str) -> str:
            return labels.get(text, text)

        return replace(
            self,
            label=translated(self.label),
            rooms={key: translated(label) for key, label in self.rooms.items()},
            categories={k: replace(c, label=translated(c.label)) for k, c in self.categories.items()},
            receptacles={
                k: replace(r, label=translated(r.label), place=translated(r.place))
                for k, r in self.receptacles.items()
            },
            objects={k: replace(o, label=translated(o.label)) for k, o in self.objects.items()},
        )

    @classmethod
    def load(cls, house: str = "apartment") -> "Catalogue":
        """Load the catalogue of a house from disk, and check it.

        Args:
            house: Name of a folder under `models/houses`, or path of a `catalogue.toml` or its folder. Use
                `mjsim.load_catalogue` for generated houses.

        Raises:
            AssetError: The catalogue is missing or invalid.

        Example:
            >>> catalogue = Catalogue.load("apartment")
            >>> sorted(catalogue.categories)
            ['books', 'dishes', 'laundry', 'office', 'recycling', 'toys']
        """
        return cls.read(parse_house(house))

    @classmethod
    def read(cls, house: HouseRef) -> "Catalogue":
        """Load a catalogue and check it. Unlike `mjsim.load_catalogue`, this never generates a home.

        Raises:
            AssetError: The catalogue or a file that it refers to is missing, or an entry is malformed,
                unknown, unused or used twice. The message names the entry.
        """
        tables, text = read_tables(house)
        return _CatalogueReader(catalogue_file(house), tables).catalogue(house, text)


_Text = Annotated[str, msgspec.Meta(pattern=r"\S")]
_Table = Annotated[dict[str, Any], msgspec.Meta(min_length=1)]


class _Tables(msgspec.Struct, forbid_unknown_fields=True):
    house: _Table
    rooms: _Table
    categories: _Table
    receptacles: _Table
    objects: _Table


class _ModelEntry(msgspec.Struct):
    label: Label
    model: _Text


class _HouseEntry(_ModelEntry):
    points: Annotated[int, msgspec.Meta(ge=1, le=POINTS)] | None = None


class _ObjectEntry(_ModelEntry):
    category: _Text | None = None  # can be omitted if a category lists the object


class _ReceptacleEntry(_ModelEntry):
    place: Label
    room: _Text


class _CategoryEntry(msgspec.Struct):
    label: Label
    receptacle: _Text
    objects: Annotated[tuple[str, ...], msgspec.Meta(min_length=1)]


class _CatalogueReader:
    def __init__(self, path: Path, raw: dict[str, Any]) -> None:
        self._path = path
        tables = self._convert(raw, _Tables, "catalogue")
        self._house = self._convert(tables.house, _HouseEntry, "house")
        self._rooms = {k: self._convert(v, Label, f"rooms.{k}") for k, v in tables.rooms.items()}
        self._categories = self._entries(tables.categories, _CategoryEntry, "categories")
        self._receptacles = self._entries(tables.receptacles, _ReceptacleEntry, "receptacles")
        self._objects = self._entries(tables.objects, _ObjectEntry, "objects")

    def catalogue(self, house: HouseRef, text: str) -> Catalogue:
        categories = self._checked_categories()
        receptacles = self._checked_receptacles()
        objects = self._checked_objects()
        house_path = self._file(self._house, "house")
        models = [house_path, *(r.path for r in receptacles.values()), *(o.path for o in objects.values())]
        return Catalogue(
            ref=house,
            label=self._house.label,
            house_path=house_path,
            rooms=self._rooms,
            categories=categories,
            receptacles=receptacles,
            objects=objects,
            content=content_hash(text, models),
            folder=self._path.parent,
            points=self._house.points,
        )

    def _error(self, where: str, message: str) -> AssetError:
        return AssetError(brief(f"{self._path}: [{where}] {message}"))

    def _convert(self, value: Any, kind: type[T], where: str) -> T:
        try:
            return msgspec.convert(value, kind)
        except msgspec.ValidationError as error:
            if kind is _Tables:
                remedy = f"the tables are {', '.join(_Tables.__struct_fields__)}, and none is empty"
            else:
                remedy = (
                    f"got {value!r:.80}; labels are one line of at most 80 characters; see docs/models.md"
                )
            raise self._error(where, f"{error}; {remedy}") from error

    def _entries(self, table: dict[str, Any], kind: type[T], name: str) -> dict[str, T]:
        return {key: self._convert(entry, kind, f"{name}.{key}") for key, entry in table.items()}

    def _file(self, entry: _ModelEntry, where: str) -> Path:
        for folder in (self._path.parent, models_root()):
            if is_file(folder / entry.model):
                return folder / entry.model
        raise self._error(
            where,
            f"names the model {entry.model:.200}, which is neither in {self._path.parent} nor in {models_root()}",
        )

    def _checked_categories(self) -> dict[str, Category]:
        taken: dict[str, str] = {}
        for key, entry in self._categories.items():
            where = f"categories.{key}"
            if entry.receptacle not in self._receptacles:
                raise self._error(
                    where, f"names the receptacle {entry.receptacle!r}, which is not in [receptacles]"
                )
            if (other := taken.setdefault(entry.receptacle, key)) != key:
                raise self._error(
                    where, f"and [categories.{other}] share the receptacle {entry.receptacle!r}"
                )
            for model in entry.objects:
                if model not in self._objects:
                    raise self._error(where, f"lists the object {model!r}, which is not in [objects]")
        return {k: Category(k, e.label, e.receptacle, self._members(k)) for k, e in self._categories.items()}

    def _members(self, category: str) -> tuple[str, ...]:
        listed = self._categories[category].objects
        return (
            *listed,
            *(k for k, o in self._objects.items() if o.category == category and k not in listed),
        )

    def _checked_receptacles(self) -> dict[str, Receptacle]:
        category_of = {entry.receptacle: key for key, entry in self._categories.items()}
        receptacles = {}
        for key, entry in self._receptacles.items():
            where = f"receptacles.{key}"
            if entry.room not in self._rooms:
                raise self._error(
                    where, f"is in the room {entry.room!r}, which is not in [rooms]: {sorted(self._rooms)}"
                )
            if key not in category_of:
                raise self._error(where, "takes no category; name it in one of [categories] or remove it")
            path = self._file(entry, where)
            receptacles[key] = Receptacle(key, entry.label, entry.place, entry.room, category_of[key], path)
        return receptacles

    def _checked_objects(self) -> dict[str, ObjectModel]:
        category_of: dict[str, str] = {}
        for category in self._categories:
            for key in self._members(category):
                if key in category_of:
                    raise self._error(
                        f"objects.{key}",
                        f"is in the categories {category_of[key]!r} and {category!r}; keep one",
                    )
                category_of[key] = category
        objects: dict[str, ObjectModel] = {}
        for key, entry in self._objects.items():
            where = f"objects.{key}"
            if key not in category_of:
                known = f"one of [categories], {sorted(self._categories)},"
                raise self._error(where, f"is in no category; list it in {known} or remove it")
            if other := next((k for k, o in objects.items() if o.label == entry.label), None):
                raise self._error(
                    where, f"and [objects.{other}] have the same label {entry.label!r}; change one"
                )
            objects[key] = ObjectModel(key, entry.label, category_of[key], self._file(entry, where))
        return objects
