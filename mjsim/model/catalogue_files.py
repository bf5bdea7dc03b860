"""Finding and reading the files of catalogues; one may extend another."""

import tomllib
from pathlib import Path
from typing import Any

from mjsim.errors import AssetError, brief
from mjsim.files import is_file, read_text
from mjsim.model.assets import models_root

MAX_EXTENDS = 20  # catalogues, each of which extends the next


def catalogue_path(house: str, folder: Path = Path()) -> Path:
    """File of a catalogue, given the name of a house, or a path from `folder`; `AssetError` where there is none."""
    if house.endswith(".toml"):
        path = folder / house
        if not is_file(path):
            raise AssetError(f"no catalogue at {path}; give a house name or the path of a catalogue.toml")
        return path.resolve()
    houses = models_root() / "houses"
    path = houses / house / "catalogue.toml"
    # A name with a separator would leave the folder of houses: that is a path, and paths end in .toml.
    if Path(house).name != house or not is_file(path):
        known = sorted(p.parent.name for p in houses.glob("*/catalogue.toml"))
        raise AssetError(f"no house {house!r}; there are {known}, or give the path of a catalogue.toml")
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
