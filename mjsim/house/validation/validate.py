"""Validate a house together with its objects and receptacles."""

import contextlib
from collections.abc import Iterator, Mapping
from pathlib import Path

import mujoco
import numpy as np
from numpy.typing import NDArray

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import CompiledHouse
from mjsim.house.validation.checked_model import Compiled, compile_model
from mjsim.house.validation.findings import Finding, errors, one_line
from mjsim.house.validation.floor import WalkableFloor
from mjsim.house.validation.floor_rules import check_floor, nowhere_to_stand
from mjsim.house.validation.house_rules import check_house_file
from mjsim.house.validation.object_rules import check_compiled_object
from mjsim.house.validation.receptacle_rules import check_receptacle
from mjsim.support.files import source_digest
from mjsim.support.kernels import cache_base
from mjsim.values.errors import AssetError, MjsimError

SLOTS = 2.5  # minimum number of average-sized objects that must fit side by side into a receptacle


def require_usable(house: CompiledHouse) -> None:
    """Raise an AssetError if a house has an error. Houses that come with this package are not checked.

    A process checks each house only once. For a generated house, a file in the cache records that the current
    code has accepted it, so that later processes do not check it again.
    """
    catalogue = house.catalogue
    if catalogue.ref.kind == "shipped":
        return
    verdict = _verdict(catalogue) if catalogue.ref.kind == "generated" else None
    if verdict is not None and verdict.is_file():
        return
    if found := errors(house.cached("findings", lambda: check_house(house))):
        raise AssetError(one_line(found, catalogue.name))
    if verdict is not None:
        with contextlib.suppress(OSError):  # If the disk is full, the next process repeats the check.
            verdict.parent.mkdir(parents=True, exist_ok=True)
            verdict.touch()


def _verdict(catalogue: Catalogue) -> Path:
    by = f"{source_digest('mjsim', 'planner')}-{mujoco.__version__}"
    return cache_base() / "houses" / "usable" / f"{catalogue.content[:32]}-{by}"


def check_house(house: CompiledHouse) -> list[Finding]:
    """Check the files of a house, and then the house as a whole if no file has errors."""
    catalogue = house.catalogue
    found = check_house_file(catalogue)
    for receptacle in catalogue.receptacles.values():
        found += check_receptacle(receptacle.path, receptacle.key)
    footprints = {}
    for model in catalogue.objects.values():
        compiled = compile_model(f"object {model.key}", model.path)
        if isinstance(compiled, Compiled):
            found += check_compiled_object(compiled)
            if len(compiled.solid):
                footprints[model.key] = np.sort(np.ptp(compiled.extent(compiled.solid), axis=0)[:2])
        else:
            found += compiled
    return found if errors(found) else [*found, *_check_composed(house), *_check_sizes(house, footprints)]


def _check_composed(house: CompiledHouse) -> list[Finding]:
    try:
        compiled = Compiled.of("house", house.catalogue.house_path, house.model)
        rooms, receptacles = house.rooms, house.receptacles
    except AssetError as error:
        return [Finding("file", "house", str(error), "correct it")]
    try:
        navigable = house.navigable
    except MjsimError:
        raise
    except Exception:  # Floor builders raise their own exceptions if there is no free floor.
        return [nowhere_to_stand(compiled, rooms)]
    rooms_of = {r.key: r.room for r in house.catalogue.receptacles.values()}
    return check_floor(WalkableFloor(compiled, rooms, receptacles, rooms_of, navigable))


def _check_sizes(house: CompiledHouse, footprints: Mapping[str, NDArray[np.float64]]) -> Iterator[Finding]:
    for category in house.catalogue.categories.values():
        interior = np.sort(2 * house.receptacles[category.receptacle].half_size[:2])
        sizes = {key: footprints[key] for key in category.objects}
        for key, size in sizes.items():
            if np.any(size > interior):
                yield Finding(
                    "capacity",
                    f"object {key}",
                    f"its footprint of {size[0]:.2f} x {size[1]:.2f} m does not fit into {category.receptacle!r}, "
                    f"{interior[0]:.2f} x {interior[1]:.2f} m",
                    "enlarge the receptacle, shrink the object, or put it into another category",
                )
        room = float(np.prod(interior)) / float(np.mean([np.prod(size) for size in sizes.values()]))
        if room < SLOTS:
            yield Finding(
                "capacity",
                f"receptacle {category.receptacle}",
                f"its floor has room for {room:.1f} objects of {category.key!r} side by side",
                f"enlarge it to {SLOTS} or more: a trial may bring eight",
                "warning",
            )
