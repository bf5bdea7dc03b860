"""Generation of homes from a seed: plan, openings, furniture, and the files of all."""

import math
from collections.abc import Mapping
from pathlib import Path

from mjsim.generator.files import write_files
from mjsim.generator.furnish import furnish
from mjsim.generator.openings import open_up
from mjsim.generator.palette import draw_palette
from mjsim.generator.plan import draw_rooms
from mjsim.generator.recipe import RECIPE, Recipe
from mjsim.generator.values import FloorPlan, Furnishing
from mjsim.house.catalogue.generated_names import VERSION, stream
from mjsim.values.errors import HouseError

ATTEMPTS = 40  # plans
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
            return Recipe(VERSION, seed, plan), furnished(seed, plan)
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


def furnished(seed: int, plan: FloorPlan) -> Furnishing:
    """Furnish a floor plan; `HouseError` if a required piece finds no place."""
    return furnish(plan, _bins(seed, plan), draw_palette(seed), seed)


def _bins(seed: int, plan: FloorPlan) -> tuple[str, ...]:
    """Three bins in a studio, and up to six."""
    count = min(4, max(1, round(plan.area / 15) - 1))
    more = stream(seed, "bins").choice(_MORE_BINS, count, replace=False)
    return (*_BINS, *sorted(str(key) for key in more))
