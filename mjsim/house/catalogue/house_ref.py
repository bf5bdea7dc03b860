"""Parse references to houses, and find the folder of packaged models."""

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mjsim.house.catalogue.generated_names import is_generated, parse_name
from mjsim.support.files import is_file
from mjsim.values.errors import AssetError

CATALOGUE = "catalogue.toml"


@dataclass(frozen=True)
class HouseRef:
    """A reference to a house, parsed from its name or path."""

    kind: Literal["shipped", "folder", "generated", "recipe"]
    name: str  # name of the house in records, or the path of a folder or recipe
    file: Path | None  # path of `catalogue.toml`, or None if `home_cache.ensured` must generate the home
    base: "HouseRef | None" = None  # generated house that the catalogue of this house extends, if any

    @property
    def is_path(self) -> bool:
        return self.kind in ("folder", "recipe")


def parse_house(house: str, folder: Path = Path()) -> HouseRef:
    """Parse a reference to a house. The files of the house need not exist.

    Args:
        house: Name of a folder under `models/houses`, seed of a generated home (`generated:7`), or path of a
            `catalogue.toml`, of a folder that contains one, or of a recipe.
        folder: Folder relative to which paths are resolved.

    Raises:
        HouseError: The name of a generated home is malformed, or belongs to another version of the generator.
    """
    if is_generated(house):
        return HouseRef("generated", str(parse_name(house)), None)
    path = folder / house
    if house.endswith(".json"):
        return HouseRef("recipe", str(path), None)
    if not house.endswith(".toml"):
        is_path, path = Path(house).name != house, path / CATALOGUE
        shipped = models_root() / "houses" / house / CATALOGUE
        if not house or not (is_path or (is_file(path) and not is_file(shipped))):
            return HouseRef("shipped", house, shipped)
    return HouseRef("folder", str(path), path)


def models_root() -> Path:
    """Return the folder of the packaged models. Raise an AssetError if it does not exist.

    It is inside an installed package, but next to the package in a source checkout.
    """
    return _models_near(__file__)


@functools.cache
def _models_near(file: str) -> Path:
    package = Path(file).resolve().parents[2]
    candidates = (package / "models", package.parent / "models")
    for candidate in candidates:
        if (candidate / "houses").is_dir():
            return candidate
    looked = " or ".join(str(c) for c in candidates)
    raise AssetError(f"no models folder at {looked}; reinstall mjsim, or run it from a full checkout")
