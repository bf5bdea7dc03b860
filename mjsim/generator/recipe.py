"""Recipe files, which store a generated house by its seed, floor plan and generator version."""

from pathlib import Path

import msgspec

from mjsim.generator.values import HomePlan
from mjsim.house.catalogue.generated_names import PREFIX, GeneratedName, check_version
from mjsim.support.files import read_bytes
from mjsim.values.errors import HouseError

RECIPE = "recipe.json"


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A generated house with its floor plan, which other versions of the solver might not find again."""

    version: int
    seed: int
    plan: HomePlan

    @property
    def name(self) -> str:
        """The name of the house in recorded data."""
        return str(GeneratedName(self.seed, len(self.plan.rooms)))

    def encoded(self) -> bytes:
        """Serialize the recipe as JSON. Equal recipes give the same bytes."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"


def read_recipe(path: Path) -> Recipe:
    """Read a recipe file. Raise `HouseError` if it is invalid or belongs to another generator version."""
    try:
        text = read_bytes(path)
        version = msgspec.json.decode(text, type=dict).get("version")
        if isinstance(version, int):
            check_version(version, str(path))
        return msgspec.json.decode(text, type=Recipe)
    except (OSError, msgspec.DecodeError) as error:
        raise HouseError(f"cannot read recipe {path}: {error}; make one with mjsim house generate") from error


def floor_plan_of(model: Path) -> HomePlan:
    """Read a floor plan from the recipe next to an MJCF file. Raise `HouseError` if there is no recipe."""
    path = model.parent / RECIPE
    if not path.is_file():
        raise HouseError(f"{model} has no {RECIPE} next to it; only generated houses ({PREFIX}7) have one")
    return read_recipe(path).plan
