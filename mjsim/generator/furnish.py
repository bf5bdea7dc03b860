"""Puts furniture and bins into a floor plan, by rules: what a home must have first, then what rooms usually have."""

import itertools
import math
from collections.abc import Iterable, Sequence

import numpy as np

from mjsim.generator.decorate import decorate
from mjsim.generator.furniture.builder import Builder
from mjsim.generator.furniture.catalogue import KINDS
from mjsim.generator.furniture.look import Look, draw_look
from mjsim.generator.furniture.piece import Mount as Holder
from mjsim.generator.furniture.piece import Piece, flattened, moved
from mjsim.generator.space import UNUSED, Place, Space
from mjsim.generator.usual import LITTLE, MOST_PLANTS, MUSTS, OFTEN, PLANTS, ROUNDS, SHARES, USUAL
from mjsim.generator.values import FloorPlan, Furnishing, Mount, Palette, Placement, Rectangle, Side
from mjsim.house.catalogue.generated_names import stream
from mjsim.values.errors import HouseError

ATTEMPTS = 6
SIZES = 4  # a piece is made so often, each time smaller, for a lack of space
BARE = 0.285  # of the floor: a home with less gets more
LEAST, MOST = 0.26, 0.44  # of the floor: no home has less or more
IN_VAIN = 4  # so many tries, and a room is left as it is
ASIDE = ("wash_corner", "kitchenette")  # a screen hides a door beside it, and nobody wants a cooker there
AXES: tuple[tuple[Side, ...], ...] = (("south", "north"), ("east", "west"))
BINS = {  # receptacle -> width, depth, height, m, and the uses of rooms that it belongs to, the best first
    "recycling_bin": (
        0.48,
        0.42,
        0.5,
        ("kitchen", "utility", "hall", "studio", "living_room", "dining_room"),
    ),
    "laundry_hamper": (0.51, 0.51, 0.55, ("bathroom", "shower_room", "utility", "bedroom", "hall", "studio")),
    "toy_box": (
        0.62,
        0.47,
        0.4,
        ("child", "bedroom", "living_room", "studio", "hall", "office", "dining_room"),
    ),
    "bookshelf": (
        0.9,
        0.34,
        0.75,
        ("living_room", "studio", "office", "dining_room", "hall", "bedroom", "child"),
    ),
}
COOKING = ("kitchen", "living_room", "studio", "dining_room")
DINING = ("dining_room", "kitchen", "living_room", "studio")
WORKING = ("office", "child", "bedroom", "studio", "living_room", "dining_room", "hall")


class Home:
    """A home that is being furnished."""

    def __init__(self, plan: FloorPlan, bins: Sequence[str], look: Look, seed: int, attempt: int) -> None:
        self.plan, self.bins, self.look, self.attempt = plan, tuple(bins), look, attempt
        self.seed = seed
        self.spaces = [
            Space.of(plan, room, stream(seed, "place", room.key, str(attempt))) for room in plan.rooms
        ]
        self.uses = {space.room.key: self._use(space) for space in self.spaces}
        self.mounts: list[Mount] = []
        self.seats = 0

    def _use(self, space: Space) -> str:
        """A room's use; a further bedroom may be a child's."""
        room = space.room
        if (
            room.use == "bedroom"
            and room.key != "bedroom"
            and stream(self.seed, "child", room.key).random() < 0.6
        ):
            return "child"
        return room.use

    def rooms(self, uses: Iterable[str]) -> list[Space]:
        """Rooms of the first use that there is, then those of the next."""
        return [space for use in uses for space in self.spaces if self.uses[space.room.key] == use]

    def put(
        self, space: Space, kind: str, *, largest: int = 0, smallest: int = SIZES - 1, number: int = 0
    ) -> bool:
        """Put a piece of a kind into a room, smaller and smaller until it fits."""
        rng = stream(self.seed, "furniture", space.room.key, kind, str(number), str(self.attempt))
        for smaller in range(min(max(largest, self.attempt - 2), smallest), smallest + 1):
            for sides in AXES if kind == "lounge" else ((*AXES[0], *AXES[1]),):
                fit = (space.depth(sides[0]), 0.0, 0.0) if kind == "lounge" else None
                piece = KINDS[kind].make(rng, self.look, smaller=smaller, fit=fit)
                place = space.put(
                    piece, sides, avoid=space.corners if kind in ASIDE and self.attempt < 3 else ()
                )
                if place is not None:
                    self._note(space, piece, place)
                    return True
        return False

    def _note(self, space: Space, piece: Piece, place: Place) -> None:
        self.seats += piece.seats
        for holder in piece.mounts:
            if holder.receptacle in self.bins and all(m.receptacle != holder.receptacle for m in self.mounts):
                x, y, *_ = moved((*holder.position[:2], *holder.position[:2]), place.x, place.y, place.yaw)
                turns = (place.turns + round((holder.yaw - math.pi) / (math.pi / 2))) % 4
                where = _words(space, piece, holder.receptacle)
                self.mounts.append(
                    Mount(holder.receptacle, space.room.key, where, (x, y, holder.position[2]), turns)
                )

    def put_bin(self, receptacle: str) -> bool:
        """Put a bin that stands on the floor into the first room that has a place."""
        if receptacle not in BINS:
            return any(mount.receptacle == receptacle for mount in self.mounts)
        w, d, h, uses = BINS[receptacle]
        rng = stream(self.seed, "bin", receptacle, str(self.attempt))
        builder = Builder(receptacle, rng, self.look)
        builder.shadow(w, (0, d))
        holder = Holder(receptacle, (0.0, d / 2, 0.0))
        piece = builder.piece((w, d, h), use=0.75, mounts=(holder,))
        for space, beside_doors in itertools.product((*self.rooms(uses), *self.spaces), (False, True)):
            place = space.put(piece, avoid=() if beside_doors else space.corners)
            if place is not None:
                self._note(space, piece, place)
                return True
        return False

    def must(self) -> None:
        """What every home has; `HouseError` where something finds no place."""
        if not self.rooms(("bathroom", "shower_room")):
            self._first(("wash_corner",), ("studio", "bedroom", "living_room"), "a place to wash")
        cooking = next((space.room.use for space in self.rooms(COOKING)), "")
        if not any(self._kitchen(space) for space in self.rooms((cooking,))):
            self._first(("kitchenette",), (cooking,), "a kitchen")
            self._first(("fridge",), (cooking, "utility"), "a fridge")
        for space in self.spaces:
            musts = MUSTS.get(self.uses[space.room.key], ())
            for i in space.rng.permutation(len(musts)) if self.attempt > 1 else range(len(musts)):
                self._any(space, musts[i])
            if self.attempt < 3 and self.uses[space.room.key] in ("bedroom", "child", "studio"):
                _ = (
                    self.put(space, "wardrobe")
                    if space.rng.random() < 0.6
                    else self.put(space, "mirror_wardrobe")
                )
        self._first(("dining", "bar_table"), DINING, "a table")
        late = self.attempt % 2
        if not late:
            self._lounge()
        self._bins()
        if late:
            self._lounge()
        self._seats(sum(space.room.use in ("bedroom", "studio") for space in self.spaces) + 1)

    def _bins(self) -> None:
        if "office_box" in self.bins:
            self._first(("desk",), WORKING, "a desk")
        for receptacle in self.bins:
            if not self.put_bin(receptacle):
                raise HouseError(f"no place for the bin {receptacle!r} in seed {self.seed}")

    def _seats(self, wanted: int) -> None:
        """More seats where there are too few."""
        for number, space in enumerate(
            2 * self.rooms(("living_room", "studio", "dining_room", "kitchen", "bedroom"))
        ):
            if self.seats < wanted:
                self.put(space, "armchair", number=number)
        if self.seats < wanted:
            raise HouseError(f"only {self.seats} of {wanted} seats found a place in seed {self.seed}")

    def _first(self, kinds: Sequence[str], uses: Sequence[str], what: str) -> None:
        """The first of some kinds that has a place, in the first such room of some uses."""
        for space in self.rooms(uses):
            if any(self.put(space, kind) for kind in kinds):
                return
        raise HouseError(f"no place for {what} in seed {self.seed}")

    def _kitchen(self, space: Space) -> bool:
        """The longest run of kitchen units that has a place, straight or around a corner."""
        narrow = min(space.room.floor.width, space.room.floor.depth) < 2.3
        order = ["corner_kitchen", "straight_kitchen"][int(narrow or space.rng.random() < 0.4) :]
        return any(
            self.put(space, kind, largest=size, smallest=size) for size in range(SIZES + 2) for kind in order
        )

    def _any(self, space: Space, kinds: Sequence[str]) -> None:
        """One of some kinds, the first as often as not."""
        order = (
            [kinds[i] for i in space.rng.permutation(len(kinds))] if kinds[0] != kinds[-1] else list(kinds)
        )
        if not any(self.put(space, kind) for kind in order):
            raise HouseError(f"no place for {' or '.join(kinds)} in {space.room.key} of seed {self.seed}")

    def _lounge(self) -> None:
        """Seats before a television, or at least a sofa."""
        for space in self.rooms(("living_room", "studio")):
            small = space.room.floor.area < 9
            if not (not small and self.put(space, "lounge", smallest=2)) and not self.put(space, "sofa"):
                self.put(space, "armchair")

    def usual(self) -> None:
        """What rooms usually have, until enough of the floor is furnished, and more where a home is still bare."""
        for space in self.spaces:
            self._usual(space)
        for space in self.spaces:
            if sum(s.area for s in self.spaces) < BARE * self.plan.area:
                self._usual(space, again=1)
            if all(piece.kind in BINS for piece, _ in space.stood):
                _ = any(self.put(space, kind) for kind in LITTLE)

    def check(self) -> None:
        """`HouseError` where a room is empty, or where too little or too much of the floor is furnished."""
        share = sum(space.area for space in self.spaces) / self.plan.area
        if not LEAST <= share <= MOST:
            raise HouseError(f"{share:.0%} of the floor is furnished in seed {self.seed}")
        for space in self.spaces:
            if not any(piece.parts and piece.kind not in BINS for piece, _ in space.stood):
                raise HouseError(f"nothing finds a place in {space.room.key} of seed {self.seed}")

    def _usual(self, space: Space, again: int = 0) -> None:
        use = self.uses[space.room.key]
        rng = stream(self.seed, "usual", space.room.key, *again * ["again"])
        share = float(rng.uniform(*SHARES.get(use, (0.3, 0.38)))) + 0.1 * again
        if again and use == "living_room" and space.share < share:
            self.put(space, "dining", number=100)
        in_vain = 0
        first, *others = USUAL.get(use, (((), 0.0),))
        wishes = [first, *(others[i] for _ in range(ROUNDS) for i in rng.permutation(len(others)))]
        for number, (kinds, chance) in enumerate(wishes, 100 * again):
            order = [kinds[i] for i in rng.permutation(len(kinds))][:IN_VAIN]
            if (
                rng.random() < chance
                and (space.share < share or number == 0)
                and in_vain < IN_VAIN * (1 + again)
            ):
                in_vain += not self._one_more(space, order, number, again)

    def _one_more(self, space: Space, kinds: Sequence[str], number: int, more: int) -> bool:
        """The first of some kinds that has a place and is not yet there often enough; `more` than usual may be."""
        there = [member.kind for piece, _ in space.stood for member, *_ in flattened(piece)]
        if kinds[0] in PLANTS and sum(kind in PLANTS for kind in there) >= MOST_PLANTS:
            return False
        for kind in kinds:
            often = OFTEN.get(kind, 1) + (kind not in UNUSED) * more
            if there.count(kind) < often and self.put(space, kind, smallest=1, number=number):
                return True
        return False

    def furnishing(self) -> Furnishing:
        """Everything that stands, hangs and lies."""
        placements = [
            placement
            for space in self.spaces
            for piece, place in space.stood
            for placement in placed(space.room.key, piece, place, self.look)
        ]
        return Furnishing(tuple(placements), tuple(self.mounts))


def furnish(plan: FloorPlan, bins: Sequence[str], palette: Palette, seed: int) -> Furnishing:
    """Furniture, decoration and bins for a plan: the same for the same arguments, in any process.

    Args:
        plan: Rooms, doors and windows.
        bins: Receptacles of the apartment's catalogue.
        palette: The colours of the home.
        seed: Every room and purpose has its own stream of chance under it.

    Raises:
        HouseError: Something that a home must have finds no place.
    """
    return furnished(plan, bins, palette, seed).furnishing()


def furnished(plan: FloorPlan, bins: Sequence[str], palette: Palette, seed: int) -> Home:
    """The home of `furnish`, with what stands in each room."""
    look = draw_look(palette, stream(seed, "look"))
    attempt = 0
    while True:
        home = Home(plan, bins, look, seed, attempt)
        try:
            home.must()
        except HouseError:
            attempt += 1
            if attempt == ATTEMPTS:
                raise
        else:
            home.usual()
            decorate(home.spaces, home.uses, plan, look, seed)
            home.check()
            return home


def placed(room: str, piece: Piece, place: Place, look: Look) -> list[Placement]:
    """A piece, or the members of a group, as the house is written."""
    found = []
    for member, x, y, yaw in flattened(piece, place.x, place.y, place.yaw):
        turns = round(yaw / (math.pi / 2))
        turn = yaw - turns * math.pi / 2
        spots = [moved(part.spot, x, y, yaw) for part in member.parts] if not member.members else []
        rectangle = None
        if spots:
            corners = np.array(spots)
            rectangle = Rectangle(*corners[:, :2].min(axis=0).tolist(), *corners[:, 2:].max(axis=0).tolist())
        own = tuple(asset for picture in member.pictures for asset in picture.assets)
        assets = (*look.of(member.geoms), *own)
        found.append(
            Placement(
                member.kind,
                room,
                member.geoms,
                (round(x, 4), round(y, 4), 0.0),
                turns % 4,
                rectangle,
                assets,
                0.0 if abs(turn) < 1e-9 else turn,
            )
        )
    return found


def _words(space: Space, piece: Piece, receptacle: str) -> str:
    """Where a bin is, as people read it."""
    if receptacle == "dish_bin":
        return "on the counter, beside the sink"
    if piece.kind == "desk":
        return "on the desk"
    spot = space.solids[-1]
    nearest = None
    for other, place in space.stood[:-1]:
        box = moved((-other.size[0] / 2, 0, other.size[0] / 2, other.size[1]), place.x, place.y, place.yaw)
        gap = math.hypot(
            max(box[0] - spot[2], spot[0] - box[2], 0), max(box[1] - spot[3], spot[1] - box[3], 0)
        )
        if gap < 0.8 and (nearest is None or gap < nearest[0]) and other.kind not in BINS:
            nearest = gap, other.kind
    if nearest is None:
        return "on the floor, against the wall"
    return f"on the floor, by the {_NAMES.get(nearest[1], nearest[1].replace('_', ' '))}"


_NAMES = {
    "lounge": "sofa",
    "dining": "dining table",
    "straight_kitchen": "kitchen counter",
    "corner_kitchen": "kitchen counter",
    "kitchenette": "kitchen counter",
    "double_bed": "bed",
    "single_bed": "bed",
}
