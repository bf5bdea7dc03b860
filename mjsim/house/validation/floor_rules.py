"""Rules that check whether the floor of a house is enclosed by walls, level and walkable."""

import math
from collections.abc import Callable, Iterator

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from mjsim.house.compiled.footprint import ClearanceField
from mjsim.house.compiled.rays import first_hit
from mjsim.house.compiled.sites import RoomMap
from mjsim.house.validation.bin_rules import check_bins
from mjsim.house.validation.checked_model import Compiled
from mjsim.house.validation.findings import Finding
from mjsim.house.validation.floor import BODY_BAND, BORDER, WalkableFloor
from mjsim.values.person_parameters import PersonParameters

DEFAULT = PersonParameters()
PASSAGE = 0.70  # width below which a passage counts as narrow, in metres
MIN_PASSAGE = 0.50  # minimum width of a passage: body width plus the planner's clearance, in metres
ROOM_AREA = 0.25  # minimum walkable area of each room, in m^2
FLOOR_GAP = 0.006  # maximum deviation of the floor's height from z = 0, in metres
HEADROOM = 2.0  # eye height of the tallest person, in metres
_RAYS = 3000
# Mask of the geom groups that rays can hit: colliding geoms, ceilings and lamps
_HANGING = np.array([1, 1, 0, 1, 0, 0], np.uint8)
_CHEST = 1.0  # start height of vertical rays, in metres; it is free wherever a person can stand


def check_floor(floor: WalkableFloor) -> list[Finding]:
    return [finding for rule in RULES for finding in rule(floor)]


def nowhere_to_stand(compiled: Compiled, rooms: RoomMap) -> Finding:
    """Create the finding that there is no place to stand in a house, often because the floor is too high."""
    steps = np.stack(np.meshgrid(*2 * [np.linspace(-0.9, 0.9, 7)]), axis=-1).reshape(-1, 2)
    offsets = np.einsum("kij,nkj->nki", rooms.axes, steps[:, None] * rooms.half_sizes)
    points = (rooms.centers + offsets).reshape(-1, 2)
    height = float(np.median([_CHEST - _free(compiled, point, -1.0) for point in points]))
    if math.isfinite(height) and abs(height) > FLOOR_GAP:
        remedy = f"move the house by {-height:.3f} m along z: floors lie at z = 0"
        return compiled.error("floor", f"most of the floor is at z = {height:.3f} m", remedy)
    remedy = f"leave ways of at least {PASSAGE} m between what collides"
    return compiled.error("rooms", "a person cannot stand anywhere in its rooms", remedy)


def _shell(floor: WalkableFloor) -> Iterator[Finding]:
    """Check that the outer walls have no gaps through which the rooms are connected to the outside."""
    free = floor.clearance.distance > 0
    components, _ = label(free)
    indoors = floor.rectangle_of >= 0
    inside = components[indoors & (floor.clearance.distance > DEFAULT.body_radius)]
    outside = components[0, 0]
    if not len(inside) or np.bincount(inside).argmax() != outside:
        return
    outdoors, _ = label(free & ~indoors)
    gaps, count = label(binary_dilation(outdoors == outdoors[0, 0]) & free & indoors, np.ones((3, 3)))
    if not count:
        yield floor.compiled.error("shell", "has no outer wall", "put colliding walls around all rooms")
    for gap in range(1, min(count, 20) + 1):
        cells = floor.centres[gaps == gap]
        width = float(np.ptp(cells, axis=0).max()) + floor.clearance.resolution
        middle = cells.mean(axis=0)
        yield floor.compiled.error(
            "shell",
            f"its outer wall is open over {width:.2f} m at ({middle[0]:.2f}, {middle[1]:.2f})",
            "close it with a colliding wall that reaches below 1.8 m and above 5 cm; windows and front doors too",
            (*middle, 0.0),
        )


def _rooms(floor: WalkableFloor) -> Iterator[Finding]:
    points, area = floor.walkable
    owner = floor.rectangle_of[tuple(floor.cell_of(points).T)]
    for key in dict.fromkeys(floor.rooms.keys):
        free = area * int(np.isin(owner, floor.rectangles_of(key)).sum())
        if free < ROOM_AREA:
            yield floor.compiled.error(
                "rooms",
                f"no way leads into room {key!r}",
                f"make the way in at least {PASSAGE} m wide ({MIN_PASSAGE} m is the body), or take it out of [rooms]",
                (*floor.rooms.centers[floor.rectangles_of(key)[0]], 0.0),
            )


def _passages(floor: WalkableFloor) -> Iterator[Finding]:
    """Find rooms that a person could not enter with a body as wide as `PASSAGE`."""
    field = floor.clearance
    inside = distance_transform_edt(floor.rectangle_of < 0) * field.resolution <= BORDER / 2
    radius = PASSAGE / 2 - field.resolution
    wide, _ = label(inside & (field.distance > radius))
    body, _ = label(inside & (field.distance > MIN_PASSAGE / 2 - field.resolution))
    counts = np.bincount(wide[wide > 0])
    if len(counts) < 2:
        return
    main = int(counts.argmax())
    at_home = body[(wide == main).nonzero()][0]
    for key in dict.fromkeys(floor.rooms.keys):
        room = np.isin(floor.rectangle_of, floor.rectangles_of(key))
        if (wide[room] == main).any() or not (body[room] == at_home).any():
            continue  # Either the passage is wide enough, or there is no passage, which another rule reports.
        place, width = _narrowest(field, wide, main, room & (wide > 0), body == at_home)
        at = floor.centres[place]
        yield floor.compiled.warning(
            "passages",
            f"the way into room {key!r} is about {width:.2f} m wide at ({at[0]:.2f}, {at[1]:.2f})",
            f"make it at least {PASSAGE} m (doorways 0.85 m), so that people do not touch the frame",
            (*at, 0.0),
        )


def _narrowest(
    field: ClearanceField,
    wide: NDArray[np.int32],
    main: int,
    beyond: NDArray[np.bool_],
    body: NDArray[np.bool_],
) -> tuple[tuple[int, int], float]:
    """Return the narrowest cell between the component `main` and the cells `beyond`, and the width there."""
    seeds = (wide == main) | beyond
    if not beyond.any():  # The whole room is narrow, so use the edge of the main component.
        seeds = wide == main
    nearest = distance_transform_edt(~seeds, return_distances=False, return_indices=True)
    near_main = (wide == main)[tuple(nearest)]
    edge = body & near_main & binary_dilation(body & ~near_main)
    where = edge if edge.any() else body & ~seeds
    cell = int(np.where(where, field.distance, -1).argmax())
    row, column = np.unravel_index(cell, where.shape)
    return (int(row), int(column)), 2 * float(field.distance[row, column])


def _level(floor: WalkableFloor) -> Iterator[Finding]:
    points = np.vstack([_places(floor), _low_things(floor)])
    heights = np.array([_CHEST - _free(floor.compiled, p, -1.0) for p in points])
    wrong = np.flatnonzero(~(np.abs(heights) <= FLOOR_GAP))
    if len(wrong):
        worst = wrong[np.abs(np.where(np.isfinite(heights), heights, -1e9))[wrong].argmax()]
        height, at = heights[worst], points[worst]
        what = f"is at z = {height:.3f} m" if math.isfinite(height) else "is missing"
        yield floor.compiled.error(
            "floor",
            f"the floor {what} at ({at[0]:.2f}, {at[1]:.2f}) and {len(wrong) - 1} more of {len(points)} places",
            "put a colliding floor at z = 0 under all rooms; rugs end 5 mm above it or are only seen",
            (*at, 0.0),
        )


def _headroom(floor: WalkableFloor) -> Iterator[Finding]:
    """Check that nothing hangs lower than the eyes of tall people wherever they can walk."""
    points = _places(floor)
    heights = np.array([_CHEST + _free(floor.compiled, p, 1.0) for p in points])
    low = int(heights.argmin())
    if heights[low] < HEADROOM - 1e-3:
        yield floor.compiled.warning(
            "headroom",
            f"something hangs down to {heights[low]:.2f} m at ({points[low, 0]:.2f}, {points[low, 1]:.2f})",
            f"raise it to {HEADROOM:g} m: tall people would look through it",
            (*points[low], heights[low]),
        )


def _places(floor: WalkableFloor) -> NDArray[np.float64]:
    points, _ = floor.walkable
    return points[:: max(1, len(points) // _RAYS)]


def _low_things(floor: WalkableFloor) -> NDArray[np.float64]:
    compiled, found = floor.compiled, [np.empty((0, 2))]
    points, area = floor.walkable
    for geom in compiled.solid:
        if compiled.model.geom_type[geom] != mujoco.mjtGeom.mjGEOM_PLANE:
            low, high = compiled.extent(np.array([geom]))
            middle = (low + high)[None, :2] / 2
            if FLOOR_GAP < high[2] <= BODY_BAND[0] and np.abs(points - middle).max(axis=1).min() < math.sqrt(
                area
            ):
                found.append(middle)
    return np.vstack(found)


def _free(compiled: Compiled, point: NDArray[np.float64], up: float) -> float:
    start, along = (*point, _CHEST), (0.0, 0.0, up)
    return first_hit(compiled.model, compiled.data, start, along, groups=_HANGING)[0]


RULES: tuple[Callable[[WalkableFloor], Iterator[Finding]], ...] = (
    _shell,
    _rooms,
    _passages,
    _level,
    _headroom,
    check_bins,
)
