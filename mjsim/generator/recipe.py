"""Recipe of a generated house: its seed, its floor plan, and the version of the generator."""

from pathlib import Path

import msgspec

from mjsim.generator.values import FloorPlan
from mjsim.house.catalogue.generated_names import PREFIX, GeneratedName, check_version
from mjsim.support.files import read_bytes
from mjsim.values.errors import HouseError

RECIPE = "recipe.json"


class Recipe(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A house as it is stored. The floor plan is part of it, since another solver may find another one.

    Attributes:
        version: Of the generator.
        seed: Of the house.
        plan: Its rooms, doors and windows.
    """

    version: int
    seed: int
    plan: FloorPlan

    @property
    def name(self) -> str:
        """As which it is recorded."""
        return str(GeneratedName(self.seed, len(self.plan.rooms)))

    def encoded(self) -> bytes:
        """JSON, the same bytes for the same recipe."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"


def read_recipe(path: Path) -> Recipe:
    """Read a recipe; `HouseError` where it is none, or one of another version."""
    try:
        text = read_bytes(path)
        version = msgspec.json.decode(text, type=dict).get("version")
        if isinstance(version, int):
            check_version(version, str(path))
        return msgspec.json.decode(text, type=Recipe)
    except (OSError, msgspec.DecodeError) as error:
        raise HouseError(
            f"{path} is no recipe of a house: {error}; give one of mjsim house generate"
        ) from error


def floor_plan_of(model: Path) -> FloorPlan:
    """The floor plan of a house by its MJCF file; `HouseError` where no recipe lies beside it."""
    path = model.parent / RECIPE
    if not path.is_file():
        raise HouseError(f"{model} has no floor plan beside it; only generated houses have one ({PREFIX}7)")
    return read_recipe(path).plan
