"""Rules of a house's floor: it is closed, level and in one piece, and a person can use every receptacle."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import mujoco
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, distance_transform_edt, label

from mjsim.model.clearance import ClearanceField
from mjsim.model.navigable import NavigableFloor
from mjsim.model.rays import SOLID, first_hit, receptacle_in_sight
from mjsim.model.receptacles import ReceptacleGeometry
from mjsim.model.rooms import RoomMap
from mjsim.model.validation.compiled import Compiled
from mjsim.model.validation.findings import Finding
from mjsim.person_parameters import PersonParameters

BODY_BAND = (0.05, 1.8)  # m, heights in which a person bumps into things
PASSAGE = 0.70  # m, width below which people squeeze through
LEAST_PASSAGE = 0.50  # m, width of the body with the planner's clearance
ROOM_AREA = 0.25  # m^2 of floor to stand on
FLOOR_GAP = 0.006  # m, between the floor and z = 0
USUAL = PersonParameters()
SNAP = 1.0  # m, from a receptacle's site `approach` to where a person can stand
MAX_TOP = 1.4  # m, of a receptacle's volume
ABOVE = 0.3  # m that an object needs on its way down into a receptacle
SUPPORT_GAP = 0.05  # m, below a receptacle
_FLOOR_RAYS = 3000
_CELLS = 2e6  # of a grid
_FINEST = 0.025  # m
_BORDER = 1.0  # m around the rooms
_WITHIN = ((0.0, 0.0), (0.6, 0.6), (0.6, -0.6), (-0.6, 0.6), (-0.6, -0.6))
_LIFT = np.array([0.0, 0.0, 0.01])
_DOWN = np.array([0.0, 0.0, -1.0])


@dataclass(frozen=True, eq=False)
class Floor:
    """A compiled house with its receptacles, and what is derived from it.

    Attributes:
        compiled: The model.
        rooms: Which room a point is in.
        receptacles: Receptacle key -> geometry.
        rooms_of: Receptacle key -> room that the catalogue gives.
        navigable: Where one can walk.
    """

    compiled: Compiled
    rooms: RoomMap
    receptacles: dict[str, ReceptacleGeometry]
    rooms_of: dict[str, str]
    navigable: NavigableFloor

    @cached_property
    def walkable(self) -> tuple[NDArray[np.float64], float]:
        """Points (k, 2), m, of the largest island, on a grid of about 5 cm, and the area that each stands for, m^2."""
        xmin, ymin, xmax, ymax = self.rooms.bounds
        islands = self.navigable.topdown_map
        size = np.array([(xmax - xmin) / islands.shape[1], (ymax - ymin) / islands.shape[0]])
        cells = np.argwhere(islands == 0)[:, ::-1]
        return np.array([xmin, ymin]) + (cells + 0.5) * size, float(np.prod(size))

    @cached_property
    def clearance(self) -> ClearanceField:
        """Distance to the nearest wall or piece of furniture, on a grid with a border around the rooms."""
        xmin, ymin, xmax, ymax = self.rooms.bounds
        area = (xmax - xmin + 2 * _BORDER) * (ymax - ymin + 2 * _BORDER)
        low, high = BODY_BAND
        return ClearanceField.from_model(
            self.compiled.model,
            low=low,
            high=high,
            resolution=max(_FINEST, math.sqrt(area / _CELLS)),
            border=_BORDER,
        )

    @cached_property
    def centres(self) -> NDArray[np.float64]:
        """Centres of the clearance's cells, m, shape (nx, ny, 2)."""
        field = self.clearance
        nx, ny = field.distance.shape
        x, y = (o + field.resolution * np.arange(n) for o, n in ((field.origin_x, nx), (field.origin_y, ny)))
        return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1)

    @cached_property
    def nearest_room(self) -> tuple[NDArray[np.intp], NDArray[np.float64]]:
        """Rectangle nearest to each cell, and its distance, m, both (nx, ny)."""
        index, nearest = np.zeros(self.centres.shape[:2], np.intp), np.full(self.centres.shape[:2], np.inf)
        for k in range(len(self.rooms.keys)):  # one at a time: all at once takes too much memory
            one = RoomMap({}, ("",), *(a[k : k + 1] for a in self.rooms.rectangles))
            distance = one.distances(self.centres)[..., 0]
            index[distance < nearest] = k
            np.minimum(nearest, distance, out=nearest)
        return index, nearest


def check_floor(floor: Floor) -> list[Finding]:
    """All that is wrong with a house as a place to walk in."""
    return [finding for rule in RULES for finding in rule(floor)]


def _shell(floor: Floor) -> Iterator[Finding]:
    """Nobody and nothing gets out: free space does not reach from a room to the border."""
    free = floor.clearance.distance > 0
    components, _ = label(free)
    _, nearest = floor.nearest_room
    inside = components[(nearest <= 0) & (floor.clearance.distance > USUAL.body_radius)]
    outside = components[0, 0]
    if not len(inside) or np.bincount(inside).argmax() != outside:
        return
    outdoors, _ = label(free & (nearest > 0))
    gaps, count = label(binary_dilation(outdoors == outdoors[0, 0]) & free & (nearest <= 0), np.ones((3, 3)))
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


def _rooms(floor: Floor) -> Iterator[Finding]:
    """Every room has floor to stand on that belongs to the largest island."""
    points, area = floor.walkable
    owner = floor.rooms.distances(points).argmin(axis=1)
    keys = np.array(floor.rooms.keys)
    for key in dict.fromkeys(floor.rooms.keys):
        free = area * int(np.isin(owner, np.flatnonzero(keys == key)).sum())
        if free < ROOM_AREA:
            yield floor.compiled.error(
                "rooms",
                f"nobody can walk into room {key!r}",
                f"make the way in at least {PASSAGE} m wide ({LEAST_PASSAGE} m is the body), or take it out of [rooms]",
                (*floor.rooms.centers[int(np.flatnonzero(keys == key)[0])], 0.0),
            )


def _passages(floor: Floor) -> Iterator[Finding]:
    """Ways between rooms that are narrower than `PASSAGE`, by the rooms that a wider person could not enter."""
    field = floor.clearance
    index, nearest = floor.nearest_room
    inside = nearest <= _BORDER / 2
    radius = PASSAGE / 2 - field.resolution
    wide, _ = label(inside & (field.distance > radius))
    body, _ = label(inside & (field.distance > LEAST_PASSAGE / 2 - field.resolution))
    counts = np.bincount(wide[wide > 0])
    if len(counts) < 2:
        return
    main = int(counts.argmax())
    at_home = body[(wide == main).nonzero()][0]
    keys = np.array(floor.rooms.keys)
    for key in dict.fromkeys(floor.rooms.keys):
        room = np.isin(index, np.flatnonzero(keys == key)) & (nearest <= 0)
        if (wide[room] == main).any() or not (body[room] == at_home).any():
            continue  # wide enough, or no way at all, which is another rule
        place, width = _narrowest(field, wide, main, room & (wide > 0), body == at_home)
        at = floor.centres[place]
        yield floor.compiled.warning(
            "passages",
            f"the way into room {key!r} is about {width:.2f} m wide at ({at[0]:.2f}, {at[1]:.2f})",
            f"make it at least {PASSAGE} m (doorways 0.85 m), so that nobody brushes along",
            (*at, 0.0),
        )


def _narrowest(
    field: ClearanceField,
    wide: NDArray[np.int32],
    main: int,
    beyond: NDArray[np.bool_],
    body: NDArray[np.bool_],
) -> tuple[tuple[int, int], float]:
    """Cell and width, m, of the widest way between the wide component `main` and cells beyond it, all (nx, ny)."""
    seeds = (wide == main) | beyond
    if not beyond.any():  # a room that is narrow throughout: its edge
        seeds = wide == main
    nearest = distance_transform_edt(~seeds, return_distances=False, return_indices=True)
    near_main = (wide == main)[tuple(nearest)]
    edge = body & near_main & binary_dilation(body & ~near_main)
    where = edge if edge.any() else body & ~seeds
    cell = int(np.where(where, field.distance, -1).argmax())
    row, column = np.unravel_index(cell, where.shape)
    return (int(row), int(column)), 2 * float(field.distance[row, column])


def _level(floor: Floor) -> Iterator[Finding]:
    """Wherever one can walk, the floor is at z = 0."""
    points, _ = floor.walkable
    points = points[:: max(1, len(points) // _FLOOR_RAYS)]
    heights = np.array([1.0 - _ray_down(floor.compiled, (*p, 1.0)) for p in points.tolist()])
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


def _bins(floor: Floor) -> Iterator[Finding]:
    for receptacle in floor.receptacles.values():
        for rule in (_bin_height, _bin_surroundings, _bin_use):
            yield from rule(floor, receptacle)


def _bin_height(floor: Floor, receptacle: ReceptacleGeometry) -> Iterator[Finding]:
    subject = _about(floor, receptacle)
    bottom, top = receptacle.center[2] + receptacle.half_size[2] * np.array([-1.0, 1.0])
    if top > MAX_TOP:
        yield subject.error(
            "reach",
            f"its top is {top:.2f} m above the floor",
            f"lower the site 'mount:{receptacle.key}' by {top - MAX_TOP:.2f} m: hands reach to {MAX_TOP} m",
            receptacle.center,
        )
    if bottom < 0:
        yield subject.error(
            "reach",
            f"its volume begins {-bottom:.2f} m below the floor",
            f"raise the site 'mount:{receptacle.key}'",
            receptacle.center,
        )
    room = floor.rooms.room_at(receptacle.center[:2])
    said = floor.rooms_of[receptacle.key]
    if not floor.rooms.contains(receptacle.center[:2], margin=0.01):
        yield subject.error(
            "rooms", "stands in no room", f"move the site 'mount:{receptacle.key}'", receptacle.center
        )
    elif room != said:
        yield subject.error(
            "rooms",
            f"stands in room {room!r}, but the catalogue says {said!r}",
            f"correct its room in the catalogue, or move the site 'mount:{receptacle.key}'",
            receptacle.center,
        )


def _bin_surroundings(floor: Floor, receptacle: ReceptacleGeometry) -> Iterator[Finding]:
    """Nothing of the house stands in the volume or just above it, and something bears the receptacle."""
    compiled, subject = floor.compiled, _about(floor, receptacle)
    names = [compiled.model.body(b).name for b in range(compiled.model.nbody)]
    own = [b for b, name in enumerate(names) if name.startswith(f"{receptacle.key}/")]
    half = receptacle.half_size
    for x, y in _WITHIN:
        start = receptacle.center + receptacle.rotation @ (half * [x, y, 1.0]) + [0.0, 0.0, ABOVE]
        distance, geom = first_hit(compiled.model, compiled.data, start, _DOWN, ignore=own)
        height = start[2] - distance
        if height > receptacle.center[2] - half[2] + FLOOR_GAP:
            yield subject.error(
                "reach",
                f"geom {compiled.geom_name(geom)} of the house is over it or in it, at z = {height:.2f} m",
                f"leave {ABOVE} m free above it, so that a hand can lower an object",
                (*start[:2], height),
            )
            return
    mount = compiled.data.site_xpos[compiled.site(f"mount:{receptacle.key}")]
    gap, _ = first_hit(compiled.model, compiled.data, mount + _LIFT, _DOWN, ignore=own)
    if gap > SUPPORT_GAP:
        yield subject.warning(
            "reach",
            f"hangs {gap - _LIFT[2]:.2f} m above what is below it",
            f"put the site 'mount:{receptacle.key}' onto the floor or a piece of furniture",
            mount,
        )


def _bin_use(floor: Floor, receptacle: ReceptacleGeometry) -> Iterator[Finding]:
    """From where a person can stand, its volume is within reach and its top in sight."""
    compiled = floor.compiled
    subject = _about(floor, receptacle)
    stand = floor.navigable.snap(receptacle.approach, math.inf)
    away, gap = float(np.hypot(*(stand - receptacle.approach))), receptacle.distance(stand)
    if away > SNAP or gap > USUAL.reach:
        yield subject.error(
            "reach",
            f"the nearest place to stand, ({stand[0]:.2f}, {stand[1]:.2f}), is {away:.2f} m from its site "
            f"'approach' and {gap:.2f} m from its volume",
            f"leave free floor in front of it: at most {SNAP} m from the site, {USUAL.reach} m from the volume",
            (*receptacle.approach, 0.0),
        )
    elif not receptacle_in_sight(
        compiled.model, compiled.data, np.array([*stand, USUAL.eye_height]), receptacle
    ):
        yield subject.error(
            "reach",
            f"cannot be seen from ({stand[0]:.2f}, {stand[1]:.2f}), where a person stands to use it",
            "remove what is in between, or turn its mount so that local -y faces free floor",
            (*stand, 0.0),
        )


def _about(floor: Floor, receptacle: ReceptacleGeometry) -> Compiled:
    """The house, with findings about a receptacle."""
    return replace(floor.compiled, subject=f"receptacle {receptacle.key}")


def _ray_down(compiled: Compiled, start: tuple[float, float, float]) -> float:
    """Distance to the first solid geom below a point, m; infinite where there is none."""
    geom = np.zeros(1, np.int32)
    distance = mujoco.mj_ray(compiled.model, compiled.data, np.array(start), _DOWN, SOLID, 1, -1, geom)
    return distance if distance >= 0 else math.inf


RULES: tuple[Callable[[Floor], Iterator[Finding]], ...] = (_shell, _rooms, _passages, _level, _bins)
