"""References to houses, and the folder of the packaged models."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mjsim.house.catalogue.generated_names import is_generated, parse_name
from mjsim.support.files import is_file
from mjsim.values.errors import AssetError

CATALOGUE = "catalogue.toml"


@dataclass(frozen=True)
class HouseRef:
    """A parsed reference to a house."""

    kind: Literal["shipped", "folder", "generated", "recipe"]
    name: str  # the house's name in records, or a path for folders and recipes
    file: Path | None  # path of `catalogue.toml`, or None for a home that `home_cache.ensured` must generate
    base: "HouseRef | None" = None  # the generated house that this house's catalogue extends, if any

    @property
    def is_path(self) -> bool:
        return self.kind in ("folder", "recipe")


def parse_house(house: str, folder: Path = Path()) -> HouseRef:
    """Parse a reference to a house. The files need not exist.

    Args:
        house: Name of a folder under `models/houses`, seed of a generated home (`generated:7`), or path of a
            `catalogue.toml`, of a folder that contains one, or of a recipe.
        folder: Folder to which relative paths refer.

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
    """Return the folder that contains `houses/`, `receptacles/` and `objects/`. Raise an AssetError if it is missing.

    The folder is inside an installed package, or next to the package in a checkout.
    """
    package = Path(__file__).resolve().parents[2]
    candidates = (package / "models", package.parent / "models")
    for candidate in candidates:
        if (candidate / "houses").is_dir():
            return candidate
    looked = " or ".join(str(c) for c in candidates)
    raise AssetError(f"no models folder at {looked}; reinstall mjsim, or run it from a full checkout")
