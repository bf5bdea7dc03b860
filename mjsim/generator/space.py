"""A room that is being furnished: where a piece can stand so that doors, windows and ways stay free."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mjsim.generator.furniture.piece import Piece, Spot, moved
from mjsim.generator.values import BACK, SIDES, FloorPlan, Room, Side

BODY = 0.36  # m, radius of what has to come through: ways are twice as wide
WIDTHS = (
    0.25,
    0.265,
    0.28,
    0.29,
    0.3,
)  # m, the same of people with the planner's clearance: no floor is shut off from
# somebody whom others get past
POCKET = 0.005  # m^2 of floor that do not count
STEP = 0.1  # m, between the places that are tried along a wall
BESIDE = 0.6  # m beside a door where no bin stands if there is another place
DOORWAY = 1.0  # m in front of a door that stay free
SNUG, APART = 0.09, 0.62  # m: gaps are at most, or at least, so wide, for nobody to be caught in them
BEFORE_LEAF = 0.45  # m in front of a door leaf that stand free: it looks as if it could be closed
WALL_GAP = 0.01  # m, behind furniture
BEFORE_WINDOW = 0.6  # m, depth in which nothing is higher than the sill
CURTAIN = 0.3  # m beside a window, the same
LEAVES = 0.1  # m, the same where no curtains hang: leaves of plants reach over their parts
BLINDS = ("kitchen", "bathroom", "shower_room", "utility")  # rooms without curtains
AROUND = 0.76  # m around what stands free
NEAR = BODY + 0.15  # m from the middle of a body to a piece that somebody uses
UNUSED = ("radiator", "floor_lamp", "bush", "tree", "snake_plant", "palm", "cactus", "fern_stand")
TRIES = 14  # places of a piece that are tried for free ways
_CELL, _FINE = 0.05, 0.0125  # m, of the grids on which ways, and floor that is shut off, are looked for

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """Where a piece stands in the house."""

    x: float  # of the piece's origin, m
    y: float
    turns: int  # quarter turns
    side: Side | None  # the wall behind it
    along: float = 0.0  # of its middle along this wall, m

    @property
    def yaw(self) -> float:
        """Its rotation."""
        return self.turns * math.pi / 2


@dataclass
class Space:
    """A room with what stands in it so far. Rectangles are x0, y0, x1, y1; solids have their height as the fifth."""

    room: Room
    rng: np.random.Generator
    solids: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    hit: list[Spot] = field(default_factory=list)  # what people bump into: less than the solids, under leaves
    keep: list[Spot] = field(default_factory=list)  # no piece may stand there
    use: list[Spot] = field(default_factory=list)  # as `keep`; somebody must be able to go there
    near: list[Spot] = field(default_factory=list)  # solids that somebody must be able to come near to
    corners: list[Spot] = field(
        default_factory=list
    )  # beside doors: who stands in one would reach around its frame
    doors: list[tuple[float, float]] = field(default_factory=list)  # points within them
    windows: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    hung: list[tuple[Side, float, float, float]] = field(default_factory=list)  # side, from, to, lowest point
    stood: list[tuple[Piece, Place]] = field(default_factory=list)
    area: float = 0.0  # m^2 that furniture covers

    @classmethod
    def of(cls, plan: FloorPlan, room: Room, rng: np.random.Generator) -> "Space":
        """An empty room."""
        space, floor = cls(room, rng), room.floor
        for door in plan.doors_of(room.key):
            side, half = door.side_in(room.key), door.width / 2
            across = floor.depth if side in ("south", "north") else floor.width
            deep = min(DOORWAY, max(0.75, across - 0.3))
            zone = floor.along(side, door.center - half - 0.06, door.center + half + 0.06, 0, deep)
            space.keep.append((zone.x0, zone.y0, zone.x1, zone.y1))
            zone = floor.along(side, door.center - half - BESIDE, door.center + half + BESIDE, 0, BESIDE)
            space.corners.append((zone.x0, zone.y0, zone.x1, zone.y1))
            space.doors.append(floor.along(side, door.center, door.center, 0.42, 0.42).center)
            space.hung.append((side, door.center - half - 0.12, door.center + half + 0.12, 0.0))
            if door.leaf is not None and door.leaf.room == room.key:
                leaf = door.leaf.floor
                space.solids.append((leaf.x0, leaf.y0, leaf.x1, leaf.y1, door.height))
                space.hit.append(space.solids[-1][:4])
                low, high = (leaf.x0, leaf.x1) if door.leaf.side in ("south", "north") else (leaf.y0, leaf.y1)
                space.hung.append((door.leaf.side, low, high, 0.0))
                zone = floor.along(door.leaf.side, low, high, 0, BEFORE_LEAF)
                space.keep.append((zone.x0, zone.y0, zone.x1, zone.y1))
        for window in plan.windows_of(room.key):
            half = window.width / 2 + (LEAVES if room.use in BLINDS else CURTAIN)
            zone = floor.along(window.side, window.center - half, window.center + half, 0, BEFORE_WINDOW)
            space.windows.append((zone.x0, zone.y0, zone.x1, zone.y1, window.sill))
            space.hung.append((window.side, window.center - half - 0.05, window.center + half + 0.05, 0.0))
        return space

    @property
    def share(self) -> float:
        """Share of the floor that is furnished."""
        return self.area / self.room.floor.area

    def depth(self, side: Side) -> float:
        """From a wall to the one across, m."""
        return self.room.floor.depth if side in ("south", "north") else self.room.floor.width

    def put(
        self,
        piece: Piece,
        sides: Sequence[Side] = SIDES,
        near: tuple[float, float] | None = None,
        avoid: Sequence[Spot] = (),
    ) -> Place | None:
        """Put a piece at the best place; None where there is none.

        Args:
            piece: What shall stand.
            sides: Walls that it may stand at.
            near: A point, m, that it shall be near to.
            avoid: Where it shall not stand.
        """
        free = piece.stands == "free"
        places = self._free_places() if free else self._wall_places(piece, sides)
        if not len(places):
            return None
        boxes, hits, uses = (
            _moved(spots, places)
            for spots in ([part.spot for part in piece.parts], [part.hit for part in piece.parts], piece.use)
        )
        tops = np.array([part.top for part in piece.parts])
        ok = self._fits(boxes, tops, uses, free) & ~_overlap(boxes, np.array(avoid).reshape(-1, 4))
        fits = np.flatnonzero(ok)
        scores = self._scores(boxes[fits], places[fits], near, free)
        best: list[int] = fits[np.argsort(-scores, kind="stable")[:TRIES]].tolist()
        for k in best:
            spots, hit, zones = ([_spot(box) for box in of[k].tolist()] for of in (boxes, hits, uses))
            used = [] if piece.kind in UNUSED else spots
            if self.connected(hit, zones, used):
                self.near += used
                x, y, turns, along = places[k].tolist()
                place = Place(x, y, int(turns), None if free else SIDES[int(turns)], along)
                self.stand(piece, place, spots, zones, hit)
                return place
        return None

    def stand(
        self, piece: Piece, place: Place, spots: Iterable[Spot], zones: Iterable[Spot], hit: Iterable[Spot]
    ) -> None:
        """Note a piece that stands."""
        for spot, low, part in zip(spots, hit, piece.parts, strict=True):
            self.solids.append((*spot, part.top))
            self.hit.append(low)
            self.area += (low[2] - low[0]) * (low[3] - low[1])
        self.use.extend(zones)
        self.stood.append((piece, place))

    def _wall_places(self, piece: Piece, sides: Sequence[Side]) -> Floats:
        """All places along walls: x, y, m, quarter turns, and where along the wall, m, shape (n, 4)."""
        floor, half = self.room.floor, piece.size[0] / 2
        found = [np.empty((0, 4))]
        for side in sides:
            low, high = floor.wall(side)
            first, last = low + half + WALL_GAP, high - half - WALL_GAP
            if last < first:
                continue
            turns = BACK[side]
            if piece.stands in ("left", "right"):
                at_low = (piece.stands == "left") == (turns in (0, 1))
                along = np.array([first if at_low else last])
            else:
                along = np.unique(np.round([*np.arange(first, last, STEP), last], 3))
            x, y = floor.along(side, first, first, WALL_GAP, WALL_GAP).center
            rows = np.tile((x, y, turns, 0.0), (len(along), 1))
            rows[:, 0 if side in ("south", "north") else 1] = rows[:, 3] = along
            found.append(rows)
        return np.concatenate(found)

    def _free_places(self) -> Floats:
        """All places on a grid, in two directions, as `_wall_places`; x and y are of the middle of the back edge."""
        floor = self.room.floor
        xs, ys = np.arange(floor.x0, floor.x1, 2 * STEP), np.arange(floor.y0, floor.y1, 2 * STEP)
        grid = np.stack(np.meshgrid(xs, ys, (0.0, 1.0), (0.0,), indexing="ij"), axis=-1)
        return grid.reshape(-1, 4)

    def _fits(self, boxes: Floats, tops: Floats, uses: Floats, free: bool) -> NDArray[np.bool_]:
        """Which places (n) are free, by the boxes (n, k, 4) of the parts and the places of use (n, u, 4)."""
        floor = self.room.floor
        slack = AROUND if free else -1e-6
        low, high = np.array([floor.x0, floor.y0]) + slack, np.array([floor.x1, floor.y1]) - slack
        ok = ((boxes[..., :2] >= low) & (boxes[..., 2:] <= high)).all(axis=(1, 2))
        inner = (uses[..., :2] >= low - 0.02) & (uses[..., 2:] <= high + 0.02)
        ok &= free | inner.all(axis=(1, 2))
        solids = np.array(self.solids).reshape(-1, 5)[:, :4]
        ok &= ~_overlap(boxes, solids, AROUND if free else 0.0) & ~_overlap(uses, solids)
        ok &= ~_overlap(boxes, np.array([*self.keep, *self.use]).reshape(-1, 4))
        for *zone, sill in self.windows:
            ok &= ~_overlap(boxes[:, tops > sill], np.array([zone]))
        return ok

    def _scores(self, boxes: Floats, places: Floats, near: tuple[float, float] | None, free: bool) -> Floats:
        """How good places are: snug or apart from what stands, near what they belong to, and some chance."""
        floor = self.room.floor
        score = 1.2 * self.rng.random(len(places))
        if len(places) == 0:
            return score
        walls = np.stack(
            [
                boxes[..., 0] - floor.x0,
                boxes[..., 1] - floor.y0,
                floor.x1 - boxes[..., 2],
                floor.y1 - boxes[..., 3],
            ],
            -1,
        )
        others = np.array(self.solids).reshape(-1, 5)[:, :4]
        away = np.maximum(others[:, :2] - boxes[:, :, None, 2:], boxes[:, :, None, :2] - others[:, 2:])
        gaps = np.concatenate([walls, np.hypot(*np.moveaxis(np.maximum(away, 0), -1, 0))], axis=-1)
        score -= 1.5 * ((gaps > SNUG) & (gaps < APART)).sum(axis=(1, 2))
        if not free:
            score += 0.7 * np.minimum((gaps <= SNUG).sum(axis=(1, 2)) - boxes.shape[1], 2)
        if near is not None:
            score -= 0.9 * np.hypot(*(places[:, :2] - near).T)
        elif free:
            middle = np.abs((boxes[..., :2].min(axis=1) + boxes[..., 2:].max(axis=1)) / 2 - floor.center).sum(
                axis=1
            )
            score -= 0.5 * middle
        return np.asarray(score)

    def connected(self, spots: Iterable[Spot], zones: Iterable[Spot] = (), near: Iterable[Spot] = ()) -> bool:
        """Whether a body comes from each door to each place of use, near to what is used, and to all free floor.

        Args:
            spots: Where something is to stand as well.
            zones: Places of its use.
            near: What of it is used.
        """
        floor, spots = self.room.floor, [*self.hit, *spots]
        _, islands, *_ = _islands(self._distance(spots, _CELL), BODY)
        targets: list[tuple[Spot, ...]] = [((x - 0.25, y - 0.25, x + 0.25, y + 0.25),) for x, y in self.doors]
        targets += [(zone,) for zone in (*self.use, *zones)]
        # Not around corners: there it would be farther away.
        targets += [(_grown(spot, NEAR, 0), _grown(spot, 0, NEAR)) for spot in (*self.near, *near)]
        common: set[int] | None = None
        for boxes in targets:
            here: set[int] = set()
            for x0, y0, x1, y1 in boxes:
                i, j = int((x0 - floor.x0) / _CELL) + 1, int((y0 - floor.y0) / _CELL) + 1
                u, v = int((x1 - floor.x0) / _CELL) + 2, int((y1 - floor.y0) / _CELL) + 2
                here.update(islands[max(i, 0) : u, max(j, 0) : v].ravel().tolist())
            common = here - {0} if common is None else common & here
            if not common:
                return False
        distance = self._distance(spots, _FINE)
        for radius in (*WIDTHS, BODY):
            _, _, stats, _ = _islands(distance, radius)
            if (stats[1:, cv2.CC_STAT_AREA] > POCKET / _FINE**2).sum() > 1:
                return False
        return True

    def _distance(self, spots: Iterable[Spot], cell: float) -> Any:
        """How far cells are from the walls and from what stands in `spots`, m."""
        floor = self.room.floor
        nx, ny = math.ceil(floor.width / cell), math.ceil(floor.depth / cell)
        free = np.zeros((nx + 2, ny + 2), np.uint8)
        free[1:-1, 1:-1] = 1
        for x0, y0, x1, y1 in spots:
            i, j = math.floor((x0 - floor.x0) / cell + 1e-6), math.floor((y0 - floor.y0) / cell + 1e-6)
            u, v = math.ceil((x1 - floor.x0) / cell - 1e-6), math.ceil((y1 - floor.y0) / cell - 1e-6)
            free[max(i, 0) + 1 : u + 1, max(j, 0) + 1 : v + 1] = 0
        return cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * cell


def _islands(distance: Floats, radius: float) -> Any:
    return cv2.connectedComponentsWithStats((distance > radius).astype(np.uint8), connectivity=4)


def _moved(spots: Sequence[Spot], places: Floats) -> Floats:
    """Rectangles of a piece at each of n places, shape (n, k, 4)."""
    turned = np.array([[moved(spot, 0.0, 0.0, turns * math.pi / 2) for spot in spots] for turns in range(4)])
    return np.asarray(turned.reshape(4, -1, 4)[places[:, 2].astype(int)] + places[:, None, [0, 1, 0, 1]])


def _grown(spot: Spot, x: float, y: float) -> Spot:
    return spot[0] - x, spot[1] - y, spot[2] + x, spot[3] + y


def _spot(box: Sequence[float]) -> Spot:
    x0, y0, x1, y1 = (round(value, 4) for value in box)
    return x0, y0, x1, y1


def _overlap(boxes: Floats, others: Floats, margin: float = 0.0) -> NDArray[np.bool_]:
    """Which of n places have a box (n, k, 4) within `margin` of one of the others (m, 4)."""
    if boxes.shape[1] == 0 or len(others) == 0:
        return np.zeros(len(boxes), bool)
    slack = 1e-6 - margin
    b = boxes[:, :, None]
    hit = (b[..., :2] < others[:, 2:] - slack) & (others[:, :2] < b[..., 2:] - slack)
    return np.asarray(hit.all(axis=-1).reshape(len(boxes), -1).any(axis=1))
