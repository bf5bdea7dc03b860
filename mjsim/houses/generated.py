"""Houses of seeds and recipes as folders in the user's cache, each made once."""

import functools
import hashlib
import math
from collections.abc import Mapping
from importlib.metadata import version
from pathlib import Path

from mjsim.errors import HouseError
from mjsim.files import work_folder
from mjsim.houses.chance import stream
from mjsim.houses.files import STYLE, write_files
from mjsim.houses.furnish import furnish
from mjsim.houses.openings import open_up
from mjsim.houses.palette import draw_palette
from mjsim.houses.plan import draw_rooms
from mjsim.houses.recipe import RECIPE, VERSION, Recipe, parse_name, read_recipe
from mjsim.houses.values import FloorPlan, Furnishing
from mjsim.kernels import cache_base
from mjsim.sources import ROOT, digest_of

ATTEMPTS = 40  # plans
CATALOGUE = "catalogue.toml"
# Bins that every home has, and those that larger homes have besides.
_BINS = ("dish_bin", "laundry_hamper")
_MORE_BINS = ("bookshelf", "recycling_bin", "toy_box", "office_box")
POINTS_PER_M2 = 0.32  # that fit into a furnished home, with some to spare
POINTS = (8, 40)  # least and most


def generate(seed: int, rooms: int) -> tuple[Recipe, Furnishing]:
    """The house of a seed; plans that cannot be furnished are given up.

    Raises:
        HouseError: No plan was found, or none of `ATTEMPTS` could be furnished.
    """
    reason = ""
    for attempt in range(ATTEMPTS):
        try:
            programme, found = draw_rooms(seed, rooms, attempt)
            plan = open_up(seed, programme, found, attempt)
            return Recipe(VERSION, seed, plan), _furnish(seed, plan)
        except HouseError as error:
            reason = str(error)
    raise HouseError(
        f"no house of {rooms} rooms was found for seed {seed} in {ATTEMPTS} attempts, the last because {reason}"
    )


def house_files(recipe: Recipe, furnishing: Furnishing, models: Path) -> Mapping[str, bytes]:
    """Path in the folder of a house -> content, the recipe included; the same bytes in every process.

    Args:
        recipe: The house.
        furnishing: What `generate` put into it.
        models: Folder of the models that come with the package.
    """
    seed, count = recipe.seed, len(recipe.plan.rooms)
    files = write_files(
        seed=seed,
        name=f"generated_{seed}_{count}",
        label=f"House {seed}",
        plan=recipe.plan,
        furnishing=furnishing,
        points=points_of(recipe.plan),
        models=models,
    )
    return {**files, RECIPE: recipe.encoded()}


def points_of(plan: FloorPlan) -> int:
    """How many points for objects a home is meant to have."""
    return max(POINTS[0], min(POINTS[1], math.floor(POINTS_PER_M2 * plan.area)))


def generated_catalogue(house: str, models: Path) -> Path:
    """The `catalogue.toml` of a house named by its seed or by the path of its recipe, made where it is not there yet.

    Raises:
        HouseError: It is named wrongly, of another version of the generator, or cannot be made.
    """
    is_recipe = house.endswith(".json")
    named = read_recipe(Path(house)) if is_recipe else parse_name(house)
    identity = named.encoded() if isinstance(named, Recipe) else str(named).encode()
    key = hashlib.sha256(identity + _digest(models).encode()).hexdigest()[:24]
    folder = cache_base() / "houses" / key
    if not (folder / CATALOGUE).is_file():
        if isinstance(named, Recipe):
            recipe, furnishing = named, _furnish(named.seed, named.plan)
        else:
            recipe, furnishing = generate(named.seed, named.rooms)
        _write(folder, house_files(recipe, furnishing, models))
    return folder / CATALOGUE


def _furnish(seed: int, plan: FloorPlan) -> Furnishing:
    return furnish(plan, _bins(seed, plan), draw_palette(seed), seed)


def _bins(seed: int, plan: FloorPlan) -> tuple[str, ...]:
    """Three bins in a studio, and up to six."""
    count = min(4, max(1, round(plan.area / 15) - 1))
    more = stream(seed, "bins").choice(_MORE_BINS, count, replace=False)
    return (*_BINS, *sorted(str(key) for key in more))


def _write(folder: Path, files: Mapping[str, bytes]) -> None:
    """Write all files at once; where another process was quicker, its folder stays."""
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        with work_folder(folder.parent) as work:
            for name, content in files.items():
                (work / name).parent.mkdir(exist_ok=True)
                (work / name).write_bytes(content)
            try:
                work.chmod(0o755)
                work.rename(folder)
            except OSError:
                if not (folder / CATALOGUE).is_file():
                    raise
    except OSError as error:
        raise HouseError(
            f"cannot write the house to {folder}: {error.strerror}; free some space there"
        ) from error


@functools.cache
def _digest(models: Path) -> str:
    """Of all that a house follows from besides its name."""
    style = [models / STYLE / name for name in ("defaults.xml", "materials.xml", CATALOGUE)]
    return digest_of(ROOT / "mjsim" / "houses", *style) + version("ortools") + version("numpy")
