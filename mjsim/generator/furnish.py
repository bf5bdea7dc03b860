"""Place furniture and bins in a floor plan according to rules."""

import itertools
import math
from collections.abc import Iterable, Sequence

from mjsim.generator.decorate import decorate
from mjsim.generator.default_furniture import (
    BIN_ROOMS,
    COOKING,
    DEFAULTS,
    DINING,
    FALLBACKS,
    FURNISHED_SHARES,
    MAX_IN_HOME,
    MAX_OF_KIND,
    MAX_PLANTS,
    PLANTS,
    REQUIRED,
    ROUNDS,
    WORKING,
)  # fmt: skip
from mjsim.generator.furniture.appearance import Appearance, draw_appearance
from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.piece import BIN_SIZES, Mount, Piece, Point, flattened, moved
from mjsim.generator.placements import describe_place, drop_points, placed, places_for_objects
from mjsim.generator.poses import WALL_GAP
from mjsim.generator.space import UNUSED, PiecePose, Space
from mjsim.generator.values import BinPlacement, Furnishing, HomePlan, Palette, Side
from mjsim.house.catalogue.generated_names import stream
from mjsim.values.errors import HouseError

ATTEMPTS = 6
STRICT_ATTEMPTS = 2  # number of attempts in which each lounge has a sofa, and each studio has a lounge
SIZES = 4  # number of sizes that are tried for each piece of furniture
BARE = 0.285  # minimum covered share of a home's floor, below which more furniture is added
LARGE_ROOMS, LARGE_POINTS = 4, 24  # minimum number of points for objects in homes of that many rooms or more
LEAST, MOST = 0.26, 0.44  # minimum and maximum share of the floor that furniture covers
MAX_FAILURES = 4  # number of failed placements after which a room counts as full
# A wash corner has a screen that would block a door, and a kitchenette has a cooker, so both avoid doors.
AWAY_FROM_DOORS = ("wash_corner", "kitchenette")
# Distances of a television from the middle of the seats that face it, in metres.
ASIDE = (0.0, 0.4, -0.4, 0.8, -0.8)
AXES: tuple[tuple[Side, ...], ...] = (("south", "north"), ("east", "west"))


class FurnishedHome:
    """A home in the process of being furnished."""

    def __init__(
        self, plan: HomePlan, bins: Sequence[str], look: Appearance, seed: int, attempt: int
    ) -> None:
        self.plan, self.bins, self.look, self.seed, self.attempt = plan, tuple(bins), look, seed, attempt
        self.spaces = [
            Space.of(plan, room, stream(seed, "place", room.key, str(attempt))) for room in plan.rooms
        ]
        self.uses = {space.room.key: self._use(space) for space in self.spaces}
        self.mounts: list[BinPlacement] = []
        self.places: tuple[Point, ...] = ()
        self.seats = 0
        self.needed = sum(space.room.use in ("bedroom", "studio") for space in self.spaces) + 1

    def _use(self, space: Space) -> str:
        room = space.room
        is_further_bedroom = room.use == "bedroom" and room.key != "bedroom"
        is_child = is_further_bedroom and stream(self.seed, "child", room.key).random() < 0.6
        return "child" if is_child else room.use

    def rooms(self, uses: Iterable[str]) -> list[Space]:
        """Return all rooms with the given uses, ordered by use."""
        return [space for use in uses for space in self.spaces if self.uses[space.room.key] == use]

    def put(
        self,
        space: Space,
        kind: str,
        *,
        largest: int = 0,
        smallest: int = SIZES - 1,
        number: int = 0,
        seats: int = 0,
    ) -> bool:
        """Place the largest version of a furniture type that fits into a room. Return False if none fits.

        Versions with fewer than `seats` seats are not placed.
        """
        rng = stream(self.seed, "furniture", space.room.key, kind, str(number), str(self.attempt))
        fits = (
            [(sides, None) for sides in ((*AXES[0], *AXES[1]),)]
            if kind != "lounge"
            else [
                (sides, (space.depth(sides[0]) - 2 * WALL_GAP, aside, 0.0))
                for aside in ASIDE
                for sides in AXES
            ]
        )
        for smaller in range(min(max(largest, self.attempt - 2), smallest), smallest + 1):
            for sides, fit in fits:
                piece = KINDS[kind].make(rng, self.look, smaller=smaller, fit=fit)
                avoid = space.corners if kind in AWAY_FROM_DOORS and self.attempt < 3 else ()
                if piece.seats >= seats and (pose := space.put(piece, sides, avoid)) is not None:
                    self._record(space, piece, pose)
                    return True
        return False

    def _record(self, space: Space, piece: Piece, pose: PiecePose) -> None:
        self.seats += piece.seats
        for mount in piece.mounts:
            key = mount.receptacle
            if key in self.bins and all(placed.receptacle != key for placed in self.mounts):
                x, y, *_ = moved((*mount.position[:2], *mount.position[:2]), pose.x, pose.y, pose.yaw)
                turns = (pose.turns + round((mount.yaw - math.pi) / (math.pi / 2))) % 4
                place, position = describe_place(space, piece, key), (x, y, mount.position[2])
                self.mounts.append(BinPlacement(key, space.room.key, place, position, turns))

    def put_bin(self, receptacle: str) -> bool:
        """Place a bin on the floor of the first room with enough space. Return False if no room has space."""
        if receptacle in ("dish_bin", "office_box"):
            return any(mount.receptacle == receptacle for mount in self.mounts)
        w, d, h = BIN_SIZES[receptacle]
        rng = stream(self.seed, "bin", receptacle, str(self.attempt))
        builder = Builder(receptacle, rng, self.look)
        builder.shadow(w, (0, d))
        piece = builder.piece((w, d, h), use=0.75, mounts=(Mount(receptacle, (0.0, d / 2, 0.0)),))
        rooms = (*self.rooms(BIN_ROOMS[receptacle]), *self.spaces)
        for space, beside_doors in itertools.product(rooms, (False, True)):
            pose = space.put(piece, avoid=() if beside_doors else space.corners)
            if pose is not None:
                self._record(space, piece, pose)
                return True
        return False

    def add_required_furniture(self) -> None:
        """Add the furniture that every home needs. Raise `HouseError` if a piece does not fit."""
        if not self.rooms(("bathroom", "shower_room")):
            self._put_first(("wash_corner",), ("studio", "bedroom", "living_room"), "a place to wash")
        cooking = next((space.room.use for space in self.rooms(COOKING)), "")
        if not any(self._put_kitchen(space) for space in self.rooms((cooking,))):
            self._put_first(("kitchenette",), (cooking,), "a kitchen")
            self._put_first(("fridge",), (cooking, "utility"), "a fridge")
        for space in self.spaces:
            required = REQUIRED.get(self.uses[space.room.key], ())
            for i in space.rng.permutation(len(required)) if self.attempt > 1 else range(len(required)):
                self._put_any(space, required[i])
            if self.attempt < 3 and self.uses[space.room.key] in ("bedroom", "child", "studio"):
                self.put(space, "wardrobe" if space.rng.random() < 0.6 else "mirror_wardrobe")
        steps = [self._put_lounges, self._put_table, self._put_bins]
        for step in steps[::-1] if self.attempt % 2 else steps:
            step()
        self._put_seats(self.needed)

    def _put_table(self) -> None:
        """Put a table with a seat for every sleeper and a guest into the home, or a smaller one if none fits."""
        for seats, space in itertools.product((max(4, self.needed), self.needed, 1), self.rooms(DINING)):
            if self.put(space, "dining", number=seats, seats=seats):
                return
        self._put_first(("bar_table",), DINING, "a table")

    def _put_bins(self) -> None:
        if "office_box" in self.bins:
            self._put_first(("desk",), WORKING, "a desk")
        for receptacle in self.bins:
            if not self.put_bin(receptacle):
                raise HouseError(f"no place for the bin {receptacle!r} in seed {self.seed}")

    def _put_seats(self, wanted: int) -> None:
        rooms = self.rooms(("living_room", "studio", "dining_room", "kitchen", "bedroom"))
        for number, space in enumerate(2 * rooms):
            if self.seats < wanted:
                self.put(space, "armchair", number=number)
        if self.seats < wanted:
            raise HouseError(f"only {self.seats} of {wanted} seats fit in seed {self.seed}")

    def _put_first(self, kinds: Sequence[str], uses: Sequence[str], what: str) -> None:
        for space in self.rooms(uses):
            if any(self.put(space, kind) for kind in kinds):
                return
        raise HouseError(f"no place for {what} in seed {self.seed}")

    def _put_kitchen(self, space: Space) -> bool:
        narrow = min(space.room.floor.width, space.room.floor.depth) < 2.3
        order = ["corner_kitchen", "straight_kitchen"][int(narrow or space.rng.random() < 0.4) :]
        choices = itertools.product(range(SIZES + 2), order)
        return any(self.put(space, kind, largest=size, smallest=size) for size, kind in choices)

    def _put_any(self, space: Space, kinds: Sequence[str]) -> None:
        if not any(self.put(space, kinds[i]) for i in space.rng.permutation(len(kinds))):
            raise HouseError(f"no place for {' or '.join(kinds)} in {space.room.key} of seed {self.seed}")

    def _put_lounges(self) -> None:
        for space in self.rooms(("living_room", "studio")):
            strict = self.attempt < STRICT_ATTEMPTS
            if self.put(space, "lounge", smallest=SIZES - 1 - strict):
                continue
            if strict or space.room.use == "living_room":
                raise HouseError(
                    f"no place for seats before a television in {space.room.key} of seed {self.seed}"
                )
            for kinds in (("sofa", "armchair"), ("television", "stove")):
                _ = any(self.put(space, kind) for kind in kinds)

    def add_default_furniture(self) -> None:
        """Add default furniture to each room, and more of it if too little of the home's floor is covered."""
        for space in self.spaces:
            self._put_defaults(space)
        for space in self.spaces:
            if sum(s.area for s in self.spaces) < BARE * self.plan.area:
                self._put_defaults(space, again=1)
            if all(piece.kind in BIN_SIZES for piece, _ in space.stood):
                _ = any(self.put(space, kind) for kind in FALLBACKS)

    def check(self) -> None:
        """Find places for objects. Raise `HouseError` if there are too few, or if a room is empty or too full."""
        share = sum(space.area for space in self.spaces) / self.plan.area
        if not LEAST <= share <= MOST:
            raise HouseError(f"{share:.0%} of the floor is furnished in seed {self.seed}")
        for space in self.spaces:
            if not any(piece.parts and piece.kind not in BIN_SIZES for piece, _ in space.stood):
                raise HouseError(f"nothing fits into {space.room.key} of seed {self.seed}")
        self.places = places_for_objects(self.spaces, self.mounts)
        points = drop_points(self.plan, self.places)
        if len(self.plan.rooms) >= LARGE_ROOMS and points < LARGE_POINTS:
            raise HouseError(f"only {points} objects fit into seed {self.seed}")

    def _put_defaults(self, space: Space, again: int = 0) -> None:
        use = self.uses[space.room.key]
        rng = stream(self.seed, "usual", space.room.key, *again * ["again"])
        share = float(rng.uniform(*FURNISHED_SHARES.get(use, (0.3, 0.38)))) + 0.1 * again
        if again and use == "living_room" and space.share < share:
            self.put(space, "dining", number=100)
        failures = 0
        first, *others = DEFAULTS.get(use, (((), 0.0),))
        wishes = [first, *(others[i] for _ in range(ROUNDS) for i in rng.permutation(len(others)))]
        for number, (kinds, chance) in enumerate(wishes, 100 * again):
            order = [kinds[i] for i in rng.permutation(len(kinds))][:MAX_FAILURES]
            is_wanted = rng.random() < chance and (space.share < share or number == 0)
            if is_wanted and failures < MAX_FAILURES * (1 + again):
                failures += not self._put_one_more(space, order, number, again)

    def _put_one_more(self, space: Space, kinds: Sequence[str], number: int, more: int) -> bool:
        there, home = (
            [member.kind for other in spaces for piece, _ in other.stood for member, *_ in flattened(piece)]
            for spaces in ([space], self.spaces)
        )
        if kinds[0] in PLANTS and sum(kind in PLANTS for kind in there) >= MAX_PLANTS:
            return False
        for kind in kinds:
            most = MAX_OF_KIND.get(kind, 1) + (kind not in UNUSED) * more
            is_rare = home.count(kind) >= MAX_IN_HOME.get(kind, math.inf)
            if there.count(kind) < most and not is_rare and self.put(space, kind, smallest=1, number=number):
                return True
        return False

    def furnishing(self) -> Furnishing:
        placements = [
            placement
            for space in self.spaces
            for piece, pose in space.stood
            for placement in placed(space.room.key, piece, pose, self.look)
        ]
        return Furnishing(tuple(placements), tuple(self.mounts), self.places)


def furnish(plan: HomePlan, bins: Sequence[str], palette: Palette, seed: int) -> FurnishedHome:
    """Place furniture, decoration and bins in a floor plan, in several attempts. Equal arguments give equal homes.

    Args:
        plan: The floor plan, with rooms, doors and windows.
        bins: Catalogue keys of the bins.
        palette: Colours of the furniture.
        seed: Seed of the random streams. Each room and purpose has its own stream.

    Raises:
        HouseError: A required piece does not fit into this floor plan.
    """
    look = draw_appearance(palette, stream(seed, "look"))
    for attempt in range(ATTEMPTS):
        home = FurnishedHome(plan, bins, look, seed, attempt)
        try:
            home.add_required_furniture()
            break
        except HouseError:
            if attempt == ATTEMPTS - 1:
                raise
    home.add_default_furniture()
    decorate(home.spaces, home.uses, plan, look, seed)
    home.check()
    return home
