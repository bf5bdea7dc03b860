"""The recipe of a generated house: all that it follows from, and how it is named."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qsl, urlencode

import msgspec

from mjsim.errors import HouseError
from mjsim.files import read_bytes
from mjsim.houses.chance import stream
from mjsim.houses.values import ROOMS, FloorPlan

PREFIX = "generated:"
RECIPE = "recipe.json"
VERSION = 3  # of the generator: raised by whatever changes a house of a seed
MAX_SEED = 2**63 - 1
MAX_HOUSES = 100_000  # of a range
# How usual homes of 1 to 10 rooms are, bathrooms and halls counted, where no number is asked for.
_SHARES = (0.04, 0.06, 0.09, 0.13, 0.16, 0.16, 0.14, 0.11, 0.07, 0.04)


@dataclass(frozen=True)
class HouseName:
    """What `generated:7?rooms=5` names."""

    seed: int
    rooms: int

    def __str__(self) -> str:
        return f"{PREFIX}{self.seed}?rooms={self.rooms}&version={VERSION}"


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
        return str(HouseName(self.seed, len(self.plan.rooms)))

    def encoded(self) -> bytes:
        """JSON, the same bytes for the same recipe."""
        return msgspec.json.format(msgspec.json.encode(self), indent=1) + b"\n"


def read_recipe(path: Path) -> Recipe:
    """Read a recipe; `HouseError` where it is none, or one of another version."""
    try:
        text = read_bytes(path)
        version = msgspec.json.decode(text, type=dict).get("version")
        if isinstance(version, int):
            _check_version(version, str(path))
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


def is_generated(house: str) -> bool:
    """Whether a house is named by a seed."""
    return house.startswith(PREFIX)


def parse_name(house: str) -> HouseName:
    """What `generated:SEED`, `generated:SEED?rooms=N` or a recorded name stands for.

    Raises:
        HouseError: It is malformed, or was recorded by another version of the generator.
    """
    found = re.fullmatch(rf"{PREFIX}(\d{{1,19}})(?:\?(.*))?", house, re.ASCII)
    values = dict(parse_qsl(found[2], keep_blank_values=True)) if found and found[2] else {}
    numbers = all(re.fullmatch(r"\d{1,9}", value, re.ASCII) for value in values.values())
    if not found or int(found[1]) > MAX_SEED or not numbers or set(values) - {"rooms", "version"}:
        raise HouseError(f"{house!r:.80} names no house; write {PREFIX}7 or {PREFIX}7?rooms=5")
    seed = int(found[1])
    _check_version(int(values.get("version", VERSION)), house)
    rooms = int(values["rooms"]) if "rooms" in values else _usual_rooms(seed)
    if not ROOMS[0] <= rooms <= ROOMS[1]:
        raise HouseError(f"{house!r:.80} has {rooms} rooms; ask for {ROOMS[0]} to {ROOMS[1]}")
    return HouseName(seed, rooms)


def generated_names(houses: str) -> list[str]:
    """The houses of `generated:7`, of a range of seeds such as `generated:0:200` (the end not included), with any of
    `?rooms=5` and `?split=train`, which leaves out the seeds of the other splits.

    Raises:
        HouseError: It is malformed, or names none.
    """
    found = re.fullmatch(rf"{PREFIX}(\d{{1,18}})(?::(\d{{1,18}}))?(?:\?(.*))?", houses, re.ASCII)
    values = dict(parse_qsl(found[3] or "", keep_blank_values=True)) if found else {}
    split = values.pop("split", None)
    if not found or split not in (None, *_SPLITS):
        raise HouseError(
            f"{houses!r:.80} names no houses; write {PREFIX}0:200, {PREFIX}0:200?rooms=5 or "
            f"{PREFIX}0:200?split=train ({', '.join(_SPLITS)})"
        )
    first = int(found[1])
    seeds = range(first, int(found[2]) if found[2] else first + 1)
    if len(seeds) > MAX_HOUSES:
        raise HouseError(f"{houses!r:.80} names more than {MAX_HOUSES} houses")
    query = f"?{urlencode(values)}" if values else ""
    names = [str(parse_name(f"{PREFIX}{seed}{query}")) for seed in seeds if split in (None, split_of(seed))]
    if not names:
        raise HouseError(f"{houses!r:.80} names no house; a range's end is not included")
    return names


def split_of(seed: int) -> str:
    """`train`, `validation` or `test`: 80, 10 and 10 % of all seeds, by a hash."""
    share = stream(seed, "split").random()
    return next(name for name, end in _SPLITS.items() if share < end)


_SPLITS: Mapping[str, float] = {"train": 0.8, "validation": 0.9, "test": 1.0}


def _usual_rooms(seed: int) -> int:
    return 1 + int(stream(seed, "rooms").choice(len(_SHARES), p=_SHARES))


def _check_version(version: int, what: str) -> None:
    if version != VERSION:
        raise HouseError(
            f"{what} is of version {version} of the generator of houses, and this is version {VERSION}; "
            f"install the mjsim of then, or generate it anew without the version"
        )
