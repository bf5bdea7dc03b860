"""Rules that check the MJCF file of a house, except for its floor (docs/models.md, "A house")."""

import itertools
from collections.abc import Callable, Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull

from mjsim.house.catalogue.catalogue import Catalogue
from mjsim.house.compiled.house import TIMESTEP
from mjsim.house.compiled.sites import PREFIX, RoomMap
from mjsim.house.validation.checked_model import (
    Compiled,
    check_contact_bits,
    check_groups,
    check_still,
    compile_model,
)
from mjsim.house.validation.findings import Finding
from mjsim.house.validation.floor import BODY_BAND
from mjsim.values.errors import AssetError

AREA = 0.1  # maximum floor area that a mesh's convex hull may cover beyond the mesh, in m^2
_SIDE = 24  # number of grid points along each side of a hull's bounding box
_MAX_CROSSINGS = 50
SIZE = (1.5, 150.0)  # minimum and maximum side length of the rectangle around all rooms, in metres
GRAVITY = (0.0, 0.0, -9.81)  # standard gravity in m/s^2
GRAVITY_SLACK = 0.1  # maximum deviation from standard gravity in m/s^2
OVERLAP = 0.05  # maximum area in which two rooms may overlap, in m^2
MOUNT = "mount:"
RESERVED = "avatar"
DEFAULT_TIMESTEP = 0.002  # MuJoCo's timestep for a file that does not set one, in seconds


def check_hulls(compiled: Compiled) -> Iterator[Finding]:
    """Find meshes whose convex hulls block free floor. MuJoCo uses the hull of a mesh for collisions."""
    model, (low, high) = compiled.model, BODY_BAND
    meshes = compiled.solid[model.geom_type[compiled.solid] == mujoco.mjtGeom.mjGEOM_MESH]
    for geom in meshes.tolist():
        points = compiled.points(geom)
        if points[:, 2].max() < low or points[:, 2].min() > high:
            continue
        places, share = _places_within(points[:, :2])
        free = [place for place in places if _is_free(compiled, geom, place)]
        if len(free) * share > AREA:
            yield compiled.warning(
                "hulls",
                f"the mesh geom {compiled.geom_name(geom)} collides as its convex hull, which fills "
                f"{len(free) * share:.1f} m^2 of floor that the mesh leaves free",
                'add boxes or convex parts in group 3, and let the mesh only be seen: contype="0" conaffinity="0"',
                (*np.mean(free, axis=0), 0.0),
            )


def _places_within(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """Return the grid points (k, 2) inside the convex hull of points (n, 2), and the area per grid point."""
    sides = np.ptp(points, axis=0) / _SIDE
    steps = np.stack(np.meshgrid(np.arange(_SIDE), np.arange(_SIDE)), axis=-1).reshape(-1, 2)
    places = points.min(axis=0) + (steps + 0.5) * sides
    edges = ConvexHull(points).equations
    inside = np.all(places @ edges[:, :2].T + edges[:, 2] < 0, axis=1)
    return places[inside], float(np.prod(sides))


def _is_free(compiled: Compiled, geom: int, place: NDArray[np.float64]) -> bool:
    """Return True if a mesh does not occupy the space above a floor point (2,) up to chest height."""
    low, high = BODY_BAND
    at, crossings = np.array([*place, high / 2]), 0
    below = _to_mesh(compiled, geom, at, -1.0)
    while (above := _to_mesh(compiled, geom, at, 1.0)) >= 0 and crossings < _MAX_CROSSINGS:
        crossings += 1
        at[2] += above + 1e-4
    return crossings % 2 == 0 and not 0 <= below < high / 2 - low


def _to_mesh(compiled: Compiled, geom: int, start: NDArray[np.float64], up: float) -> float:
    """Return the distance from a point to a mesh above it, or below it if `up` is -1. Return -1 if there is none."""
    return float(mujoco.mj_rayMesh(compiled.model, compiled.data, geom, start, np.array([0.0, 0.0, up])))


def check_house_file(catalogue: Catalogue) -> list[Finding]:
    compiled = compile_model("house", catalogue.house_path)
    if not isinstance(compiled, Compiled):
        return compiled
    found = [finding for rule in FILE_RULES for finding in rule(compiled)]
    return found + [finding for rule in CATALOGUE_RULES for finding in rule(compiled, catalogue)]


def _options(compiled: Compiled) -> Iterator[Finding]:
    option = compiled.model.opt
    if np.abs(option.gravity - GRAVITY).max() > GRAVITY_SLACK:
        yield compiled.error(
            "options", f"its gravity is {option.gravity.tolist()} m/s^2", "leave it out of <option>, z is up"
        )
    if option.disableflags:
        bits = mujoco.mjtDisableBit.__members__.items()
        flags = [name for name, bit in bits if int(bit) & option.disableflags]
        yield compiled.error("options", f"its <flag> disables {flags}", "remove <flag>")
    if option.timestep not in (DEFAULT_TIMESTEP, TIMESTEP):
        yield compiled.warning(
            "options",
            f"its timestep of {option.timestep:g} s is not used: a step takes {TIMESTEP:g} s",
            "leave it out of <option>",
        )
    if np.any(option.wind) or option.density or option.viscosity:
        yield compiled.warning(
            "options", "its <option> has wind, density or viscosity", "remove them: they move objects"
        )


def _names(compiled: Compiled, catalogue: Catalogue) -> Iterator[Finding]:
    model = compiled.model
    taken = {RESERVED, *catalogue.receptacles}
    kinds = (("body", model.nbody), ("geom", model.ngeom), ("site", model.nsite))
    for kind, count in kinds:
        for index in range(count):
            name = getattr(model, kind)(index).name
            first = name.split("/")[0]
            if "/" in name and (first in taken or first.startswith("object_")):
                yield compiled.error(
                    "names", f"{kind} {name!r} begins like those of a scene", f"rename it: not {first}/..."
                )


def _rooms(compiled: Compiled, catalogue: Catalogue) -> Iterator[Finding]:
    try:
        rooms = RoomMap.from_model(compiled.model, catalogue.rooms)
    except AssetError as error:
        yield compiled.error("rooms", str(error), f"each room has box sites {PREFIX}<key>, each key a room")
        return
    xmin, ymin, xmax, ymax = rooms.bounds
    sides = sorted((xmax - xmin, ymax - ymin))
    if not (sides[0] >= SIZE[0] and sides[1] <= SIZE[1]):
        factor = next((f for f in (0.01, 0.001) if SIZE[0] < sides[1] * f < SIZE[1]), None)
        yield compiled.error(
            "size",
            f"its rooms span {xmax - xmin:.4g} x {ymax - ymin:.4g} m",
            f"keep both sides within {SIZE[0]} and {SIZE[1]:g} m"
            + (f" (scale by {factor:g}?)" if factor else ""),
        )
        return
    yield from _overlaps(compiled, rooms)


def _overlaps(compiled: Compiled, rooms: RoomMap) -> Iterator[Finding]:
    reach = np.einsum("kij,kj->ki", np.abs(rooms.axes), rooms.half_sizes)
    low, high = rooms.centers - reach, rooms.centers + reach
    # Rotated rooms are skipped, because their axis-aligned bounding boxes are too large.
    square = np.abs(rooms.axes).max(axis=(1, 2)) > 1 - 1e-9
    for i, j in itertools.combinations(np.flatnonzero(square), 2):
        sides = np.minimum(high[i], high[j]) - np.maximum(low[i], low[j])
        if rooms.keys[i] != rooms.keys[j] and sides.min() > 0 and np.prod(sides) > OVERLAP:
            yield compiled.warning(
                "rooms",
                f"rooms {rooms.keys[i]!r} and {rooms.keys[j]!r} overlap by {np.prod(sides):.2g} m^2",
                "end each at its walls",
                (*(np.maximum(low[i], low[j]) + sides / 2), 0.0),
            )


def _mounts(compiled: Compiled, catalogue: Catalogue) -> Iterator[Finding]:
    for key in catalogue.receptacles:
        site = compiled.site(f"{MOUNT}{key}")
        if site is None:
            yield compiled.error(
                "mounts", f"has no site '{MOUNT}{key}'", "add it where the middle of the receptacle's base is"
            )
        elif compiled.data.site_xmat[site, 8] < 1 - 1e-6:
            at = compiled.data.site_xpos[site]
            yield compiled.error("mounts", f"the site '{MOUNT}{key}' is tilted", "turn it about z only", at)
    for site in range(compiled.model.nsite):
        name = compiled.model.site(site).name
        if name.startswith(MOUNT) and name.removeprefix(MOUNT) not in catalogue.receptacles:
            yield compiled.warning(
                "mounts",
                f"the site {name!r} belongs to no receptacle of the catalogue",
                f"the catalogue has {sorted(catalogue.receptacles)}",
                compiled.data.site_xpos[site],
            )


FILE_RULES: tuple[Callable[[Compiled], Iterator[Finding]], ...] = (
    check_still,
    check_groups,
    check_contact_bits,
    _options,
    check_hulls,
)
CATALOGUE_RULES: tuple[Callable[[Compiled, Catalogue], Iterator[Finding]], ...] = (_names, _rooms, _mounts)
