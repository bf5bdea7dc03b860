"""A disk cache of generated homes, with one folder per home."""

import dataclasses
import functools
import hashlib
from importlib.metadata import version
from pathlib import Path

from mjsim.generator.files import STYLE, house_files
from mjsim.generator.recipe import Recipe, read_recipe
from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.catalogue.files import MAX_EXTENDS, base_of
from mjsim.house.catalogue.generated_names import parse_name
from mjsim.house.catalogue.house_ref import CATALOGUE, HouseRef, models_root, parse_house
from mjsim.support.files import digest_of, write_folder
from mjsim.support.kernels import cache_base
from mjsim.values.errors import HouseError


def load_catalogue(house: str = "apartment") -> Catalogue:
    """Load and validate the catalogue of a house. If necessary, generate the house first.

    Args:
        house: Name of a folder under `models/houses`, path of a `catalogue.toml` file or its folder, seed of
            a generated house (`generated:7`, `generated:7?rooms=5`), or path of a recipe.

    Raises:
        AssetError: The catalogue or a file to which it refers is missing or invalid.
        HouseError: The house cannot be generated.

    Example:
        >>> len(load_catalogue("generated:11?rooms=2").rooms)
        2
    """
    return Catalogue.read(ensured(parse_house(house)))


def ensured(house: HouseRef, _depth: int = 0) -> HouseRef:
    """Generate a home unless it is cached. Return a reference that contains the path of its files.

    If the house extends a generated home, that home is generated.

    Raises:
        HouseError: The recipe is invalid, or the home cannot be generated or written.
    """
    if house.kind in ("generated", "recipe"):
        return dataclasses.replace(house, file=_generated_catalogue(house, models_root()))
    base = None if house.kind == "shipped" or _depth > MAX_EXTENDS else base_of(house)
    return house if base is None else dataclasses.replace(house, base=ensured(base, _depth + 1))


def _generated_catalogue(house: HouseRef, models: Path) -> Path:
    made_of = read_recipe(Path(house.name)) if house.kind == "recipe" else parse_name(house.name)
    identity = made_of.encoded() if isinstance(made_of, Recipe) else house.name.encode()
    key = hashlib.sha256(identity + _digest(models).encode()).hexdigest()[:24]
    folder = cache_base() / "houses" / key
    if not (folder / CATALOGUE).is_file():
        # Imported only when needed, because OR-Tools loads slowly.
        from mjsim.generator.generated import furnish_plan, generate

        if isinstance(made_of, Recipe):
            recipe, furnishing = made_of, furnish_plan(made_of.seed, made_of.plan)
        else:
            recipe, furnishing = generate(made_of.seed, made_of.rooms)
        files = house_files(recipe, furnishing, models)
        try:
            write_folder(folder, files)
        except OSError as error:
            raise HouseError(
                f"cannot write the house to {folder}: {error.strerror}; free some space there"
            ) from error
    return folder / CATALOGUE


@functools.cache
def _digest(models: Path) -> str:
    """Return a hash of the code, styles and library versions that determine generated homes."""
    random_streams = Path(__file__).parents[1] / "house" / "catalogue" / "generated_names.py"
    style = [models / STYLE / name for name in ("defaults.xml", "materials.xml", CATALOGUE)]
    code = digest_of(Path(__file__).parent, random_streams, *style)
    return code + version("ortools") + version("numpy")
