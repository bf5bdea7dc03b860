"""Parse names of generated homes, such as `generated:7?rooms=5`, and create random generators for them."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import parse_qsl, urlencode

from mjsim.values.errors import HouseError

if TYPE_CHECKING:
    import numpy as np


PREFIX = "generated:"
VERSION = 4  # version of the home generator; any change that alters a generated home must increase it
ROOMS = (1, 10)  # minimum and maximum number of rooms in a generated home
MAX_SEED = 2**63 - 1
MAX_HOUSES = 100_000
# Default probabilities of 1 to 10 rooms in a home. Bathrooms and halls count as rooms.
_SHARES = (0.04, 0.06, 0.09, 0.13, 0.16, 0.16, 0.14, 0.11, 0.07, 0.04)
_SPLITS: Mapping[str, float] = {"train": 0.8, "validation": 0.9, "test": 1.0}


@dataclass(frozen=True)
class GeneratedName:
    """The parsed name of a generated home. `str()` returns the full name."""

    seed: int
    rooms: int

    def __str__(self) -> str:
        return f"{PREFIX}{self.seed}?rooms={self.rooms}&version={VERSION}"


def is_generated(house: str) -> bool:
    return house.startswith(PREFIX)


def parse_name(house: str) -> GeneratedName:
    """Parse the name of a generated home, such as `generated:7`, `generated:7?rooms=5` or its full name.

    Raises:
        HouseError: The name is malformed, or belongs to another version of the generator.
    """
    found = re.fullmatch(rf"{PREFIX}(\d{{1,19}})(?:\?(.*))?", house, re.ASCII)
    values = dict(parse_qsl(found[2], keep_blank_values=True)) if found and found[2] else {}
    numbers = all(re.fullmatch(r"\d{1,9}", value, re.ASCII) for value in values.values())
    if not found or int(found[1]) > MAX_SEED or not numbers or set(values) - {"rooms", "version"}:
        raise HouseError(f"{house!r:.80} names no house; write {PREFIX}7 or {PREFIX}7?rooms=5")
    seed = int(found[1])
    check_version(int(values.get("version", VERSION)), house)
    rooms = int(values["rooms"]) if "rooms" in values else _default_rooms(seed)
    if not ROOMS[0] <= rooms <= ROOMS[1]:
        raise HouseError(f"{house!r:.80} has {rooms} rooms; ask for {ROOMS[0]} to {ROOMS[1]}")
    return GeneratedName(seed, rooms)


def generated_names(houses: str) -> list[str]:
    """Return the names of the homes for one seed (`generated:7`) or for a range of seeds (`generated:0:200`).

    The end is excluded. `?rooms=5` sets the number of rooms. `?split=train` keeps only one dataset split.

    Raises:
        HouseError: The range is malformed or empty.
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
    """Return the dataset split of a seed: `train` (80 % of seeds), `validation` (10 %) or `test` (10 %)."""
    share = stream(seed, "split").random()
    return next(name for name, end in _SPLITS.items() if share < end)


def check_version(version: int, subject: str) -> None:
    """Raise a HouseError about `subject` if `version` is not the version of this home generator."""
    if version != VERSION:
        raise HouseError(
            f"{subject} has version {version} of the house generator, but this mjsim has version {VERSION}, which "
            "makes other homes from the same seeds; install the older mjsim, or generate the home again without the "
            "version"
        )


def _default_rooms(seed: int) -> int:
    return 1 + int(stream(seed, "rooms").choice(len(_SHARES), p=_SHARES))


def stream(seed: int, *purpose: str) -> "np.random.Generator":
    """Create the random generator for a seed and a purpose, such as `stream(7, "furniture", "bedroom")`.

    The generators of different purposes are independent, so drawing from one does not change the others.
    """
    import numpy as np  # imported here because importing NumPy would slow down every command, even --help

    digest = hashlib.sha256("/".join(purpose).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))
