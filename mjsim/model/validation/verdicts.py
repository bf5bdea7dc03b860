"""Whether a house can be used: judged at its first load, and remembered on disk for as long as no file changes."""

import hashlib
import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import mujoco

from mjsim.errors import AssetError
from mjsim.kernels import cache_base
from mjsim.model.catalogue import Catalogue
from mjsim.model.validation.findings import errors, one_line
from mjsim.model.validation.validate import check_house

if TYPE_CHECKING:
    from mjsim.model.house import CompiledHouse

RULES = Path(__file__).parents[1]  # the sources on which a verdict depends


def require_usable(house: "CompiledHouse") -> None:
    """Check a house, unless files of the same content were found usable before.

    Raises:
        AssetError: It cannot be used; the message gives the first error and what to change.
    """
    if (_folder() / house.catalogue.content).exists():
        return
    if found := errors(check_house(house)):
        raise AssetError(one_line(found, house.catalogue.name))
    remember_usable(house.catalogue)


def remember_usable(catalogue: Catalogue) -> None:
    """Note on disk that the house of a catalogue was checked and can be used."""
    mark = _folder() / catalogue.content
    try:
        mark.parent.mkdir(parents=True, exist_ok=True)
        mark.touch()
        os.utime(mark.parent)  # in use
    except OSError:  # no home, a full disk: the next process checks again
        pass


@cache
def _folder() -> Path:
    digest = hashlib.sha256(mujoco.__version__.encode())
    for path in sorted(RULES.rglob("*.py")):
        digest.update(path.read_bytes())
    return cache_base() / f"mjsim-houses-{digest.hexdigest()[:16]}"
