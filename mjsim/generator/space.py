"""Find furniture poses in a room that keep doors, windows and walkways clear."""

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from mjsim.generator.furniture.drawn_boxes import Boxes, drawn_boxes
from mjsim.generator.furniture.piece import Piece, Point, Spot, intersect, moved, moved_boxes
from mjsim.generator.poses import Floats, free_poses, moved_spots, wall_poses
from mjsim.generator.shell import room_shell
from mjsim.generator.values import SIDES, HomePlan, Room, Side

# Lengths are in metres.
BODY = 0.36  # body radius that must fit through all walkways
# Body radii including clearance. For each radius, the floor on which such a body fits must be connected.
PERSON_RADII = (0.25, 0.265, 0.28, 0.29, 0.3)
POCKET = 0.005  # maximum area of unreachable floor that is tolerated, in square metres
BESIDE = 0.6  # width of the floor next to a door that bins should avoid
BESIDE_MIN = 0.36  # width of the floor next to a door that bins must avoid
DOORWAY = 1.0  # maximum depth of the free floor in front of a door
SNUG, APART = 0.09, 0.62  # range of gap widths that are avoided, because people would get stuck
BEFORE_LEAF = 0.45  # depth of the free floor in front of an open door leaf
BEFORE_WINDOW = 0.6  # depth of the zone in front of a window where furniture is lower than the sill
CURTAIN = 0.3  # extra width of that zone on each side of a window with curtains
# Extra width of that zone on each side of a window with a blind, because leaves of plants may overhang.
LEAVES = 0.1
BLINDS = ("kitchen", "bathroom", "shower_room", "utility")  # room uses with blinds
AROUND = 0.76  # width of the free floor around a free-standing piece
NEAR = BODY + 0.15  # maximum distance between a person's centre and a piece that the person uses
UNUSED = ("radiator", "floor_lamp", "bush", "tree", "snake_plant", "palm", "cactus", "fern_stand")
STANDING = 0.25  # radius of the free floor around a person who takes an object from furniture
WITHIN = 0.65  # maximum distance between such a person's centre and the object
TRIES = 14  # maximum number of poses per piece for which walkways are checked
_CELL, _FINE = 0.05, 0.0125  # cell sizes of the grids that detect blocked walkways and unreachable floor


@dataclass(frozen=True)
class PiecePose:
    """The pose of a piece of furniture in the house."""

    x: float  # x coordinate of the piece's origin, in metres
    y: float
    turns: int  # number of counter-clockwise quarter turns
    side: Side | None  # wall behind the piece, or None
    along: float = 0.0  # position of the piece's centre along this wall, in metres

    @property
    def yaw(self) -> float:
        return self.turns * math.pi / 2


def footprint(piece: Piece, pose: PiecePose) -> Spot:
    """Return the rectangle on the floor that a piece covers, in metres."""
    w, d, _ = piece.size
    return moved((-w / 2, 0, w / 2, d), pose.x, pose.y, pose.yaw)


@dataclass
class Space:
    """A room with the furniture that has been placed so far.

    Rectangles are (x0, y0, x1, y1) in metres, followed by a height in `solids` and `windows`.
    """

    room: Room
    rng: np.random.Generator
    solids: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    # Obstacles that people can bump into, without overhanging parts.
    hit: list[Spot] = field(default_factory=list)
    keep: list[Spot] = field(default_factory=list)  # floor that must stay free
    use: list[Spot] = field(default_factory=list)  # floor that must stay free and reachable
    near: list[Spot] = field(default_factory=list)  # obstacles that people must be able to approach
    corners: list[Spot] = field(default_factory=list)  # floor next to doors, which bins should avoid
    doors: list[tuple[float, float]] = field(default_factory=list)  # a point in front of each door
    windows: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    # Occupied parts of the walls as (side, start, end, bottom).
    hung: list[tuple[Side, float, float, float]] = field(default_factory=list)
    stood: list[tuple[Piece, PiecePose]] = field(default_factory=list)
    beside: list[Spot] = field(default_factory=list)  # floor next to doors, which bins must avoid
    ways: list[Spot] = field(default_factory=list)  # floor before doors, on which no person may stand
    drawn: Boxes = field(default_factory=lambda: np.empty((0, 6)))  # boxes of all drawn geoms in the room
    area: float = 0.0  # floor area covered by furniture, in square metres

    @classmethod
    def of(cls, plan: HomePlan, room: Room, rng: np.random.Generator) -> "Space":
        """Create the space for a room that contains no furniture yet."""
        space, floor = cls(room, rng), room.floor
        space.drawn = drawn_boxes(room_shell(plan, room))
        for door in plan.doors_of(room.key):
            side, half = door.side_in(room.key), door.width / 2
            deep = min(DOORWAY, max(0.75, space.depth(side) - 0.3))
            zone = floor.along(side, door.center - half - 0.06, door.center + half + 0.06, 0, deep)
            space.keep.append(zone.spot)
            for zones, wide in ((space.corners, BESIDE), (space.beside, BESIDE_MIN), (space.ways, 0.0)):
                zone = floor.along(side, door.center - half - wide, door.center + half + wide, 0, BESIDE)
                zones.append(zone.spot)
            space.doors.append(floor.along(side, door.center, door.center, 0.42, 0.42).center)
            space.hung.append((side, door.center - half - 0.12, door.center + half + 0.12, 0.0))
            if door.leaf is not None and door.leaf.room == room.key:
                leaf = door.leaf
                space.solids.append((*leaf.floor.spot, door.height))
                space.hit.append(leaf.floor.spot)
                low, high = leaf.floor.wall(leaf.side)
                space.hung.append((leaf.side, low, high, 0.0))
                space.keep.append(floor.along(leaf.side, low, high, 0, BEFORE_LEAF).spot)
        for window in plan.windows_of(room.key):
            half = window.width / 2 + (LEAVES if room.use in BLINDS else CURTAIN)
            zone = floor.along(window.side, window.center - half, window.center + half, 0, BEFORE_WINDOW)
            space.windows.append((*zone.spot, window.sill))
            space.hung.append((window.side, window.center - half - 0.05, window.center + half + 0.05, 0.0))
        return space

    @property
    def share(self) -> float:
        return self.area / self.room.floor.area

    def depth(self, side: Side) -> float:
        """Return the distance between a wall and the opposite wall, in metres."""
        return self.room.floor.depth if side in ("south", "north") else self.room.floor.width

    def put(
        self, piece: Piece, sides: Sequence[Side] = SIDES, avoid: Sequence[Spot] = ()
    ) -> PiecePose | None:
        """Place a piece at its best pose along the given walls. Return the pose, or None if none fits."""
        free = piece.stands == "free"
        places = free_poses(self.room.floor) if free else wall_poses(self.room.floor, piece, sides)
        if not len(places):
            return None
        spots = (
            [part.spot for part in piece.parts],
            [part.hit for part in piece.parts],
            piece.use,
            [mount.spot for mount in piece.mounts],
            [mount.stand for mount in piece.mounts],
        )
        there, ends = moved_spots(list(itertools.chain(*spots)), places), np.cumsum([len(of) for of in spots])
        boxes, hits, uses, bins, stands = np.split(there, ends[:-1], axis=1)
        tops = np.array([part.top for part in piece.parts])
        ok = self._fits(boxes, tops, uses, free) & ~_overlap(boxes, np.array(avoid).reshape(-1, 4))
        ok &= ~_overlap(bins, np.array(self.beside).reshape(-1, 4))
        ok &= ~_overlap(stands, np.array(self.ways).reshape(-1, 4))
        fits = np.flatnonzero(ok)
        order: list[int] = fits[np.argsort(-self._scores(boxes[fits], free), kind="stable")].tolist()
        poses = ((k, self._pose(places[k], free)) for k in order)
        for k, place in itertools.islice(((k, at) for k, at in poses if self.is_clear(piece, at)), TRIES):
            own, hit, zones = ([_spot(box) for box in of[k].tolist()] for of in (boxes, hits, uses))
            reached = () if piece.kind in UNUSED else piece.reached
            used = [moved(spot, place.x, place.y, place.yaw) for spot in reached]
            if self.connected(hit, zones, used):
                self.near += used
                self.stand(piece, place, own, zones, hit)
                return place
        return None

    def is_clear(self, piece: Piece, place: PiecePose) -> bool:
        """Return True if what is drawn of a piece does not overlap anything that is drawn in the room."""
        return not intersect(moved_boxes(piece.drawn, place.x, place.y, place.yaw), self.drawn)

    def reachable(self, places: Sequence[Point]) -> list[Point]:
        """Return the places on furniture from which a person can take an object without bending around things."""
        floor, (_, islands) = self.room.floor, _islands(self._distance(self.hit, _FINE), STANDING)
        # Smaller parts of the floor are pockets to which there is no way.
        largest = np.bincount(islands.ravel(), minlength=2)[1:].argmax() + 1
        cells = (np.argwhere(islands == largest) - 0.5) * _FINE + (floor.x0, floor.y0)
        steps, found = np.linspace(0.0, 1.0, 9)[:, None], []
        for place in places:
            away = np.hypot(*(cells - place[:2]).T)
            if len(away) and away.min() <= WITHIN:
                way = place[:2] + steps * (cells[away.argmin()] - place[:2])
                hand = np.hstack([way, np.full((9, 1), place[2])])
                low, high = hand + np.array([-0.06, -0.06, 0.02]), hand + np.array([0.06, 0.06, 0.3])
                if not intersect(np.hstack([low, high]), self.drawn):
                    found.append(place)
        return found

    def record(self, piece: Piece, place: PiecePose) -> None:
        """Record a piece, and what is drawn of it, at its final pose."""
        self.stood.append((piece, place))
        self.drawn = np.concatenate([self.drawn, moved_boxes(piece.drawn, place.x, place.y, place.yaw)])

    @staticmethod
    def _pose(row: Floats, free: bool) -> PiecePose:
        x, y, turns, along = row.tolist()
        return PiecePose(x, y, int(turns), None if free else SIDES[int(turns)], along)

    def stand(
        self,
        piece: Piece,
        place: PiecePose,
        spots: Iterable[Spot],
        zones: Iterable[Spot],
        hit: Iterable[Spot],
    ) -> None:
        """Record a piece of furniture at its final pose."""
        for spot, low, part in zip(spots, hit, piece.parts, strict=True):
            self.solids.append((*spot, part.top))
            self.hit.append(low)
            self.area += (low[2] - low[0]) * (low[3] - low[1])
        self.use.extend(zones)
        self.record(piece, place)

    def _fits(self, boxes: Floats, tops: Floats, uses: Floats, free: bool) -> NDArray[np.bool_]:
        """Return a mask (n,) of the poses at which neither `boxes` nor `uses` overlap anything."""
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

    def _scores(self, boxes: Floats, free: bool) -> Floats:
        floor = self.room.floor
        score = 1.2 * self.rng.random(len(boxes))
        if len(boxes) == 0:
            return score
        low, high = np.array([floor.x0, floor.y0]), np.array([floor.x1, floor.y1])
        walls = np.concatenate([boxes[..., :2] - low, high - boxes[..., 2:]], axis=-1)
        others = np.array(self.solids).reshape(-1, 5)[:, :4]
        away = np.maximum(others[:, :2] - boxes[:, :, None, 2:], boxes[:, :, None, :2] - others[:, 2:])
        gaps = np.concatenate([walls, np.hypot(*np.moveaxis(np.maximum(away, 0), -1, 0))], axis=-1)
        score -= 1.5 * ((gaps > SNUG) & (gaps < APART)).sum(axis=(1, 2))
        if free:
            middle = (boxes[..., :2].min(axis=1) + boxes[..., 2:].max(axis=1)) / 2
            score -= 0.5 * np.abs(middle - floor.center).sum(axis=1)
        else:
            score += 0.7 * np.minimum((gaps <= SNUG).sum(axis=(1, 2)) - boxes.shape[1], 2)
        return np.asarray(score)

    def connected(self, spots: Iterable[Spot], zones: Iterable[Spot] = (), near: Iterable[Spot] = ()) -> bool:
        """Return True if a person can reach all pieces and all free floor from every door.

        Args:
            spots: Obstacles of an additional piece.
            zones: Floor that is needed to use the additional piece.
            near: Obstacles of the additional piece that a person must be able to approach.
        """
        floor, spots = self.room.floor, [*self.hit, *spots]
        _, islands = _islands(self._distance(spots, _CELL), BODY)
        targets: list[tuple[Spot, ...]] = [((x - 0.25, y - 0.25, x + 0.25, y + 0.25),) for x, y in self.doors]
        targets += [(zone,) for zone in (*self.use, *zones)]
        # Extend rectangles along one axis at a time, because their corners would otherwise be too far away.
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
        for radius in (*PERSON_RADII, BODY):
            count, islands = _islands(distance, radius)
            if count > 2 and (np.bincount(islands.ravel())[1:] > POCKET / _FINE**2).sum() > 1:
                return False
        return True

    def _distance(self, spots: Iterable[Spot], cell: float) -> Any:
        floor = self.room.floor
        nx, ny = math.ceil(floor.width / cell), math.ceil(floor.depth / cell)
        free = np.zeros((nx + 2, ny + 2), np.uint8)
        free[1:-1, 1:-1] = 1
        for x0, y0, x1, y1 in spots:
            i, j = math.floor((x0 - floor.x0) / cell + 1e-6), math.floor((y0 - floor.y0) / cell + 1e-6)
            u, v = math.ceil((x1 - floor.x0) / cell - 1e-6), math.ceil((y1 - floor.y0) / cell - 1e-6)
            free[max(i, 0) + 1 : u + 1, max(j, 0) + 1 : v + 1] = 0
        return cv2.distanceTransform(free, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) * cell


def _islands(distance: Floats, radius: float) -> tuple[int, Any]:
    """Count the connected parts of the floor. Return their number plus one, and the part of each cell, from 1, or 0."""
    return cv2.connectedComponents((distance > radius).astype(np.uint8), connectivity=4)


def _grown(spot: Spot, x: float, y: float) -> Spot:
    return spot[0] - x, spot[1] - y, spot[2] + x, spot[3] + y


def _spot(box: Sequence[float]) -> Spot:
    x0, y0, x1, y1 = (round(value, 4) for value in box)
    return x0, y0, x1, y1


def _overlap(boxes: Floats, others: Floats, margin: float = 0.0) -> NDArray[np.bool_]:
    if boxes.shape[1] == 0 or len(others) == 0:
        return np.zeros(len(boxes), bool)
    slack = 1e-6 - margin
    b = boxes[:, :, None]
    hit = (b[..., :2] < others[:, 2:] - slack) & (others[:, :2] < b[..., 2:] - slack)
    return np.asarray(hit.all(axis=-1).reshape(len(boxes), -1).any(axis=1))
