"""Recipe of a generated house: its seed, its floor plan, and the version of the generator."""

from pathlib import Path

import msgspec

from mjsim.generator.values import HomePlan
from mjsim.house.catalogue.generated_names import PREFIX, GeneratedName, check_version
from mjsim.support.files import read_bytes
from mjsim.values.errors import HouseError

RECIPE = "recipe.json"


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A stored house. It includes the floor plan, because another solver may find a different plan for the seed."""

    version: int
    seed: int
    plan: HomePlan

    @property
    def name(self) -> str:
        """Name under which the house is recorded."""
        return str(GeneratedName(self.seed, len(self.plan.rooms)))

    def encoded(self) -> bytes:
        """The recipe as JSON, the same bytes for equal recipes."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"


def read_recipe(path: Path) -> Recipe:
    """Read a recipe. Raise `HouseError` if it is not valid or of another version."""
    try:
        text = read_bytes(path)
        version = msgspec.json.decode(text, type=dict).get("version")
        if isinstance(version, int):
            check_version(version, str(path))
        return msgspec.json.decode(text, type=Recipe)
    except (OSError, msgspec.DecodeError) as error:
        raise HouseError(f"cannot read recipe {path}: {error}; make one with mjsim house generate") from error


def floor_plan_of(model: Path) -> HomePlan:
    """Read the plan of a house from the recipe next to its MJCF file. Raise `HouseError` if there is none."""
    path = model.parent / RECIPE
    if not path.is_file():
        raise HouseError(f"{model} has no {RECIPE} next to it; only generated houses ({PREFIX}7) have one")
    return read_recipe(path).plan
