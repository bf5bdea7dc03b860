"""Generate the floor plan, doors, windows and furniture of a home from a seed."""

from mjsim.generator.furnish import furnish
from mjsim.generator.openings import add_openings
from mjsim.generator.palette import draw_palette
from mjsim.generator.plan import draw_rooms
from mjsim.generator.recipe import Recipe
from mjsim.generator.values import Furnishing, HomePlan
from mjsim.house.catalogue.generated_names import VERSION, stream
from mjsim.values.errors import HouseError

ATTEMPTS = 40  # maximum number of floor plans that are tried
_BINS = ("dish_bin", "laundry_hamper")  # bins in every home
# Additional bins, from which each home gets a random selection.
_MORE_BINS = ("bookshelf", "recycling_bin", "toy_box", "office_box")


def generate(seed: int, rooms: int) -> tuple[Recipe, Furnishing]:
    """Generate the house for a seed. Floor plans that cannot be furnished are discarded.

    Raises:
        HouseError: No floor plan was found, or none of the `ATTEMPTS` plans could be furnished.
    """
    reason = ""
    for attempt in range(ATTEMPTS):
        try:
            programme, found = draw_rooms(seed, rooms, attempt)
            plan = add_openings(seed, programme, found, attempt)
            return Recipe(VERSION, seed, plan), furnish_plan(seed, plan)
        except HouseError as error:
            reason = str(error)
    raise HouseError(
        f"no house of {rooms} rooms was found for seed {seed} in {ATTEMPTS} attempts; the last failed because {reason}"
    )


def furnish_plan(seed: int, plan: HomePlan) -> Furnishing:
    """Furnish a floor plan. Raise `HouseError` if a required piece of furniture does not fit."""
    count = min(4, max(1, round(plan.area / 15) - 1))
    more = stream(seed, "bins").choice(_MORE_BINS, count, replace=False)
    return furnish(plan, (*_BINS, *sorted(str(key) for key in more)), draw_palette(seed), seed).furnishing()
