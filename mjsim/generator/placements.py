"""Convert furnished rooms to the placements of furniture, and find the places on it where objects can lie."""

import math
from collections.abc import Sequence

from mjsim.generator.default_furniture import SHOWN_NAMES
from mjsim.generator.furniture.appearance import Appearance
from mjsim.generator.furniture.piece import BIN_SIZES, Piece, Point, flattened, moved_point
from mjsim.generator.space import PiecePose, Space, footprint
from mjsim.generator.values import BinPlacement, HomePlan, Placement
from mjsim.values.episode import FLOOR_SHARE

# Number of points for objects per square metre of floor, low enough for furnished homes.
POINTS_PER_M2 = 0.32
POINTS = (8, 40)  # minimum and maximum number of points for objects in a home
PLACES_APART = 0.6  # minimum distance between places for objects on furniture, in metres
FROM_BIN = 1.0  # minimum distance between such a place and a bin, in metres
HIGHEST_PLACE = 1.1  # maximum height of such a place, in metres


def drop_points(plan: HomePlan, places: Sequence[Point]) -> int:
    """Return the number of points at which objects can lie in a home, on the floor and on furniture."""
    on_floor = max(POINTS[0], math.floor(POINTS_PER_M2 * plan.area))
    return min(POINTS[1], on_floor + len(places), math.floor(on_floor / FLOOR_SHARE))


def places_for_objects(spaces: Sequence[Space], bins: Sequence[BinPlacement]) -> tuple[Point, ...]:
    """Return the places on furniture for objects, which are apart from each other and from the bins."""
    found: list[Point] = []
    for space in spaces:
        places = [moved_point(at, p.x, p.y, p.yaw) for piece, p in space.stood for at in piece.places]
        for place in space.reachable([place for place in places if place[2] <= HIGHEST_PLACE]):
            apart = all(math.dist(place[:2], other[:2]) >= PLACES_APART for other in found)
            if apart and all(math.dist(place[:2], placed.position[:2]) >= FROM_BIN for placed in bins):
                found.append(place)
    return tuple(found)


def placed(room: str, piece: Piece, pose: PiecePose, look: Appearance) -> list[Placement]:
    """Return the placements of a piece of furniture, or of all members if it is a group."""
    found = []
    for member, x, y, yaw in flattened(piece, pose.x, pose.y, pose.yaw):
        turns = round(yaw / (math.pi / 2))
        turn = yaw - turns * math.pi / 2
        own = [asset for picture in member.pictures for asset in picture.assets]
        assets, position = (*look.assets_of(member.geoms), *own), (round(x, 4), round(y, 4), 0.0)
        turn = 0.0 if abs(turn) < 1e-9 else turn
        found.append(Placement(member.kind, room, member.geoms, position, turns % 4, assets, turn))
    return found


def describe_place(space: Space, piece: Piece, receptacle: str) -> str:
    """Describe where a bin stands. The bin is the last piece that was placed in the room."""
    if receptacle == "dish_bin":
        return "on the counter, beside the sink"
    if piece.kind == "desk":
        return "on the desk"
    spot = space.solids[-1]
    nearest = None
    for other, pose in space.stood[:-1]:
        box = footprint(other, pose)
        dx, dy = max(box[0] - spot[2], spot[0] - box[2], 0), max(box[1] - spot[3], spot[1] - box[3], 0)
        gap = math.hypot(dx, dy)
        if gap < 0.8 and (nearest is None or gap < nearest[0]) and other.kind not in BIN_SIZES:
            nearest = gap, other.kind
    if nearest is None:
        return "on the floor, against the wall"
    return f"on the floor, by the {SHOWN_NAMES.get(nearest[1], nearest[1].replace('_', ' '))}"
