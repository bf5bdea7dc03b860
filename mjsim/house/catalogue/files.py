"""Read catalogue files and translations of labels."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any

import msgspec

from mjsim.house.catalogue.house_ref import CATALOGUE, HouseRef, models_root, parse_house
from mjsim.support.files import is_file, read_text
from mjsim.support.toml import TomlError, parse_toml, read_toml
from mjsim.values.errors import AssetError, brief

MAX_EXTENDS = 20  # maximum number of catalogues in a chain in which each extends the next
_SHOWN = r"[^\x00-\x1f\x7f-\x9f\u2028\u2029]*"
Label = Annotated[str, msgspec.Meta(pattern=rf"^{_SHOWN}\S{_SHOWN}\Z", max_length=80)]


def base_of(house: HouseRef) -> HouseRef | None:
    """Return the house that a catalogue extends. Return None if it extends no house or cannot be read."""
    if house.file is None:
        return None
    try:
        name = read_toml(house.file).get("extends")
        return parse_house(name, house.file.parent) if isinstance(name, str) else None
    except (OSError, TomlError):
        return None  # The error is reported when the catalogue is loaded.


def catalogue_file(house: HouseRef) -> Path:
    """Return the absolute path of the catalogue file of a house.

    Raises:
        AssetError: The catalogue does not exist, or the home has not been generated yet.
    """
    if house.file is None:
        raise AssetError(
            f"the home {house.name!r} has not been generated; load it with mjsim.load_catalogue, which generates it"
        )
    if is_file(house.file):
        return house.file.resolve() if house.kind == "folder" else house.file
    remedy = f"the path of a {CATALOGUE} or its folder"
    if house.kind == "folder":
        raise AssetError(f"no catalogue at {house.name}; give a house name, or {remedy}")
    known = sorted(path.parent.name for path in (models_root() / "houses").glob(f"*/{CATALOGUE}"))
    raise AssetError(f"no house {house.name!r}; there are {known}, or give {remedy}")


def read_tables(house: HouseRef, extended: tuple[Path, ...] = ()) -> tuple[dict[str, Any], str]:
    """Read the tables and the text of a catalogue, including those of the catalogues that it extends.

    An entry replaces the entry with the same key in an extended catalogue.
    """
    path = catalogue_file(house)
    try:
        text = read_text(path)
        tables = parse_toml(text)
    except (OSError, ValueError) as error:
        raise AssetError(brief(f"cannot read catalogue {path}: {error}")) from error
    if extended:
        _name_models(tables, path.parent)
    if "extends" not in tables:
        return tables, text
    name = tables.pop("extends")
    if not isinstance(name, str) or path in extended or len(extended) > MAX_EXTENDS:
        raise AssetError(f"{path}: extends = {name!r} does not lead to a complete catalogue; name a house")
    base, base_text = read_tables(house.base or parse_house(name, path.parent), (*extended, path))
    for key, table in tables.items():
        mergeable = isinstance(table, dict) and isinstance(base.get(key), dict)
        base[key] = {**base[key], **table} if mergeable else table
    return base, base_text + text


def _name_models(tables: dict[str, Any], folder: Path) -> None:
    entries = [tables.get("house")]
    for table in ("receptacles", "objects"):
        if isinstance(tables.get(table), dict):
            entries += tables[table].values()
    for entry in entries:
        if isinstance(entry, dict) and isinstance(entry.get("model"), str):
            beside = folder / entry["model"]
            if is_file(beside):
                entry["model"] = str(beside)


def read_labels(language: str, folders: Iterable[Path]) -> Mapping[str, str]:
    """Read translations of English labels from the `labels.LANGUAGE.toml` files in several folders.

    Later folders take precedence. Folders without such a file are skipped.

    Raises:
        AssetError: A label file cannot be read, or contains invalid labels.
    """
    found: dict[str, str] = {}
    for path in (folder / f"labels.{language}.toml" for folder in folders):
        if is_file(path):
            try:
                found |= msgspec.convert(read_toml(path), dict[str, Label])
            except (OSError, ValueError) as error:
                raise AssetError(brief(f"cannot read labels {path}: {error}")) from error
    return found
