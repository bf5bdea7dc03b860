"""Finding and reading the files of catalogues; one may extend another."""

import tomllib
from pathlib import Path
from typing import Any

from mjsim.errors import AssetError, brief
from mjsim.files import is_file, read_text
from mjsim.houses.recipe import is_generated, parse_name
from mjsim.model.assets import models_root

CATALOGUE = "catalogue.toml"
MAX_EXTENDS = 20  # catalogues, each of which extends the next


def house_name(house: str, folder: Path = Path()) -> str:
    """A house as it is recorded: by its name if it is generated or comes with the package, else by a path.

    Args:
        house: Name of a house, path of a `catalogue.toml`, of the folder that holds one, or of a recipe.
        folder: Folder that relative paths start from.

    Raises:
        HouseError: It is generated, but named wrongly or of another version of the generator.
    """
    if is_generated(house):
        return str(parse_name(house))
    if house.endswith((".toml", ".json")):
        return str(folder / house)
    is_path = Path(house).name != house
    if house and (is_path or not is_file(models_root() / "houses" / house / CATALOGUE)):
        path = folder / house / CATALOGUE
        if is_path or is_file(path):
            return str(path)
    return house


def catalogue_path(house: str, folder: Path = Path()) -> Path:
    """File of a catalogue, given as `house_name` takes it; a generated house is made where that is needed.

    Raises:
        AssetError: There is no such house.
        HouseError: It cannot be generated.
    """
    name = house_name(house, folder)
    if is_generated(name) or name.endswith(".json"):
        from mjsim.houses.generated import generated_catalogue  # OR-Tools takes a while to load

        return generated_catalogue(name, models_root())
    if name.endswith(".toml"):
        if not is_file(Path(name)):
            raise AssetError(
                f"no catalogue at {name}; give a house name, or the path of a {CATALOGUE} or its folder"
            )
        return Path(name).resolve()
    houses = models_root() / "houses"
    path = houses / name / CATALOGUE
    if not name or not is_file(path):
        known = sorted(p.parent.name for p in houses.glob(f"*/{CATALOGUE}"))
        raise AssetError(
            f"no house {house!r}; there are {known}, or give the path of a {CATALOGUE} or its folder"
        )
    return path


def read_tables(path: Path, extended: tuple[Path, ...] = ()) -> tuple[dict[str, Any], str]:
    """Tables of a catalogue with those of the one that it extends, whose entries it replaces by key, and texts."""
    try:
        text = read_text(path)
        tables = tomllib.loads(text)
    except (OSError, UnicodeDecodeError, tomllib.TOMLDecodeError, RecursionError) as error:
        raise AssetError(brief(f"cannot read catalogue {path}: {error}")) from error
    if extended:
        _name_models(tables, path.parent)
    if "extends" not in tables:
        return tables, text
    name = tables.pop("extends")
    if not isinstance(name, str) or path in extended or len(extended) > MAX_EXTENDS:
        raise AssetError(
            f"{path}: extends = {name!r} leads to no catalogue that stands by itself; name a house"
        )
    base, base_text = read_tables(catalogue_path(name, path.parent), (*extended, path))
    for key, table in tables.items():
        mergeable = isinstance(table, dict) and isinstance(base.get(key), dict)
        base[key] = {**base[key], **table} if mergeable else table
    return base, base_text + text


def _name_models(tables: dict[str, Any], folder: Path) -> None:
    """Name the model files that lie beside a catalogue absolutely, in place, for use in another folder."""
    entries = [tables.get("house")]
    for table in ("receptacles", "objects"):
        if isinstance(tables.get(table), dict):
            entries += tables[table].values()
    for entry in entries:
        if isinstance(entry, dict) and isinstance(entry.get("model"), str):
            beside = folder / entry["model"]
            if is_file(beside):
                entry["model"] = str(beside)
