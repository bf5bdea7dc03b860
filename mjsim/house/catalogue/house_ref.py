"""References to houses: shipped, in a folder, generated from a seed, or given by a recipe."""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from mjsim.house.catalogue.generated_names import is_generated, parse_name
from mjsim.support.files import is_file
from mjsim.values.errors import AssetError

CATALOGUE = "catalogue.toml"


@dataclass(frozen=True)
class HouseRef:
    """A house as it was named, parsed once.

    Attributes:
        kind: How it was named.
        name: Its name in records: a path for a folder or a recipe.
        file: Its `catalogue.toml`; None for a home that has yet to be generated (`mjsim.generator.home_cache.ensured`).
        base: The house that its catalogue extends, if that is a generated one.
    """

    kind: Literal["shipped", "folder", "generated", "recipe"]
    name: str
    file: Path | None
    base: "HouseRef | None" = None

    @property
    def is_path(self) -> bool:
        """True if the name is the path of a catalogue or a recipe."""
        return self.kind in ("folder", "recipe")


def parse_house(house: str, folder: Path = Path()) -> HouseRef:
    """Parse the name of a house. Files need not exist.

    Args:
        house: Name of a folder under `models/houses`, seed of a generated home (`generated:7`), path of a
            `catalogue.toml`, of the folder that holds one, or of a recipe.
        folder: Folder that relative paths start from.

    Raises:
        HouseError: The name of a generated home is malformed, or of another version of the generator.
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
    """Folder that holds `houses/`, `receptacles/` and `objects/`; `AssetError` where there is none.

    An installed wheel carries it inside the package; a checkout has it beside the package.
    """
    package = Path(__file__).resolve().parents[2]
    candidates = (package / "models", package.parent / "models")
    for candidate in candidates:
        if (candidate / "houses").is_dir():
            return candidate
    looked = " or ".join(str(c) for c in candidates)
    raise AssetError(f"no models folder at {looked}; reinstall mjsim, or run it from a full checkout")
