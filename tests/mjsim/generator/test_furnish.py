import itertools
import math
from collections.abc import Iterator

import numpy as np
import pytest
from houses_cases import BINS, PALETTE, flat, studio

from mjsim.generator.furnish import FurnishedHome, furnish
from mjsim.generator.furniture.piece import BIN_SIZES, flattened, intersect, moved, moved_boxes
from mjsim.generator.space import Space
from mjsim.generator.values import Furnishing, HomePlan, Placement, Rectangle
from mjsim.values.errors import HouseError

CASES = [(flat(), BINS, seed) for seed in range(2)] + [(studio(), BINS[:3], 0)]


@pytest.fixture(scope="module", params=CASES, ids=lambda case: f"{len(case[0].rooms)}-{case[2]}")
def home(request: pytest.FixtureRequest) -> FurnishedHome:
    plan, bins, seed = request.param
    return furnish(plan, bins, PALETTE, seed)


def boxes(space: Space) -> Iterator[list[Rectangle]]:
    """What each piece of a room stands on."""
    for piece, place in space.stood:
        if piece.parts:
            yield [Rectangle(*moved(part.spot, place.x, place.y, place.yaw)) for part in piece.parts]


@pytest.mark.slow
def test_pieces_stand_in_their_rooms_and_not_in_one_another(home: FurnishedHome) -> None:
    for space in home.spaces:
        stood = list(boxes(space))
        for box in itertools.chain(*stood):
            assert space.room.floor.grown(0.001).contains(box.x0, box.y0)
            assert space.room.floor.grown(0.001).contains(box.x1, box.y1)
        for one, other in itertools.combinations(stood, 2):
            assert not any(a.overlaps(b, 0.001) for a, b in itertools.product(one, other))


def test_nothing_stands_in_doorways_or_where_somebody_has_to_stand(home: FurnishedHome) -> None:
    for space in home.spaces:
        free = [Rectangle(*spot) for spot in (*space.keep, *space.use)]
        for piece, place in space.stood:
            own = [Rectangle(*moved(spot, place.x, place.y, place.yaw)) for spot in piece.use]
            for part in piece.parts:
                box = Rectangle(*moved(part.spot, place.x, place.y, place.yaw))
                if piece.kind != "radiator":
                    assert not any(box.overlaps(zone, 0.002) for zone in free if zone not in own), piece.kind


def test_nothing_that_is_drawn_overlaps(home: FurnishedHome) -> None:
    for space in home.spaces:
        stood = [
            (piece.kind, moved_boxes(piece.drawn, at.x, at.y, at.yaw))
            for piece, at in space.stood
            if piece.stands not in ("ceiling", "recess")
        ]
        for (one, boxes), (other, others) in itertools.combinations(stood, 2):
            assert not intersect(boxes, others), (one, other)


def test_no_bin_is_beside_a_door(home: FurnishedHome) -> None:
    for mount in home.mounts:
        room = home.plan.room(mount.room)
        x, y, _ = mount.position
        w, d, _ = BIN_SIZES[mount.receptacle]
        half = (d, w) if mount.quarter_turns % 2 else (w, d)
        box = Rectangle(x - half[0] / 2, y - half[1] / 2, x + half[0] / 2, y + half[1] / 2)
        for door in home.plan.doors_of(mount.room):
            reach = door.width / 2 + 0.35
            side = door.side_in(mount.room)
            zone = room.floor.along(side, door.center - reach, door.center + reach, 0, 0.6)
            assert not box.overlaps(zone, 0.001), mount


def test_seats_around_a_table_face_a_television_or_stove(home: FurnishedHome) -> None:
    lounges = [
        p for s in home.spaces if s.room.use == "living_room" for p, _ in s.stood if p.kind == "lounge"
    ]
    assert len(lounges) == sum(room.use == "living_room" for room in home.plan.rooms)
    for lounge in lounges:
        poses = {piece.kind: (x, y, yaw) for piece, x, y, yaw in flattened(lounge)}
        focus = poses.get("television", poses.get("stove"))
        seat = next(poses[kind] for kind in ("sofa", "corner_sofa", "armchair") if kind in poses)
        assert focus is not None and seat[1] - focus[1] > 1.5 and abs(seat[0] - focus[0]) < 1.0
        assert math.cos(seat[2]) < -0.99  # turned to the television


def test_objects_on_furniture_can_be_taken(home: FurnishedHome) -> None:
    places = home.furnishing().places
    assert len(places) >= len(home.spaces)
    for one, other in itertools.combinations(places, 2):
        assert math.dist(one[:2], other[:2]) >= 0.6
    for place, mount in itertools.product(places, home.mounts):
        assert math.dist(place[:2], mount.position[:2]) >= 1.0


def test_a_place_behind_something_is_no_place() -> None:
    space = Space.of(studio(), studio().rooms[1], np.random.default_rng(0))
    x, y = space.room.floor.center
    space.hit.append((x - 0.3, y - 0.3, x + 0.3, y + 0.3))
    assert space.reachable([(x, y - 0.15, 0.7)])
    space.drawn = np.vstack([space.drawn, [x - 0.3, y - 0.35, 0.7, x + 0.3, y - 0.3, 0.95]])
    assert not space.reachable([(x, y - 0.15, 0.7)])


@pytest.mark.parametrize("closed", [False, True])
def test_a_place_beside_a_pocket_of_the_floor_is_no_place(closed: bool) -> None:
    """A pocket on which a person fits counts only if there is a way to it."""
    space = Space.of(studio(), studio().rooms[1], np.random.default_rng(0))
    floor, x, y = space.room.floor, *space.room.floor.center
    space.hit += [(floor.x0, y - 0.3, x, y + 0.3), (floor.x0 + 0.6, y + 0.3, floor.x0 + 0.9, floor.y1)]
    if not closed:
        space.hit[-1] = (floor.x0 + 0.6, y + 0.3, floor.x0 + 0.9, floor.y1 - 0.7)
    assert bool(space.reachable([(floor.x0 + 0.3, y + 0.1, 0.7)])) != closed


def test_all_places_of_use_can_be_reached(home: FurnishedHome) -> None:
    for space in home.spaces:
        assert space.connected(())


def test_nothing_higher_than_a_sill_stands_before_a_window(home: FurnishedHome) -> None:
    for space in home.spaces:
        for window in home.plan.windows_of(space.room.key):
            half = window.width / 2
            zone = space.room.floor.along(window.side, window.center - half, window.center + half, 0, 0.5)
            for x0, y0, x1, y1, top in space.solids:
                assert top <= window.sill or not Rectangle(x0, y0, x1, y1).overlaps(zone, 0.001)


def test_a_home_has_what_it_must_have(home: FurnishedHome) -> None:
    kinds = [
        p.kind for space in home.spaces for piece, _ in space.stood for p, *_ in (*flattened(piece), (piece,))
    ]
    for options in (
        {"double_bed", "single_bed", "bunk_bed"},
        {"toilet"},
        {"washbasin"},
        {"bathtub", "shower"},
        {"straight_kitchen", "corner_kitchen"},
        {"table", "round_table", "bar_table"},
    ):
        assert options & set(kinds)
    sleeping = sum(space.room.use in ("bedroom", "studio") for space in home.spaces)
    assert home.seats >= sleeping + 1
    assert sorted(mount.receptacle for mount in home.mounts) == sorted(home.bins)
    assert all(space.stood for space in home.spaces)


def test_a_quarter_to_a_half_of_the_floor_is_furnished(home: FurnishedHome) -> None:
    share = sum(space.area for space in home.spaces) / home.plan.area
    assert 0.25 < share < 0.45


def test_no_floor_is_shut_off_from_large_people_alone() -> None:
    space = Space.of(studio(), studio().rooms[1], np.random.default_rng(0))
    assert space.connected([(5.72, 1.95, 7.08, 1.99)])
    assert not space.connected([(5.72, 1.95, 7.15, 1.99)])  # 0.55 m to a strip of 0.61 m


@pytest.fixture(scope="module")
def made() -> Furnishing:
    return furnish(flat(), BINS, PALETTE, 3).furnishing()


@pytest.mark.slow
def test_the_same_seed_gives_the_same_home_and_another_seed_another(made: Furnishing) -> None:
    assert furnish(flat(), BINS, PALETTE, 3).furnishing() == made
    assert furnish(flat(), BINS, PALETTE, 4).furnishing() != made


def test_placements_name_each_asset_they_need(made: Furnishing) -> None:
    def names(placement: Placement) -> set[str]:
        return {asset.name for asset in placement.assets}

    images = [asset for p in made.placements for asset in p.assets if asset.image is not None]
    assert images and all(f'file="{asset.name}.png"' in asset.xml for asset in images)
    for placement in made.placements:
        assert "wood_a" not in placement.geoms or "wood_a" in names(placement)


def test_a_home_without_space_is_refused() -> None:
    plan = studio()
    tiny = HomePlan((plan.rooms[1],), plan.doors[:0], ())
    with pytest.raises(HouseError, match="no place for a kitchen"):
        furnish(tiny, BINS, PALETTE, 0)


def test_a_piece_that_nobody_could_reach_is_not_put() -> None:
    space = Space.of(studio(), studio().rooms[1], np.random.default_rng(0))
    across = Rectangle(5.72, 0.0, 7.7, 2.6)
    assert space.connected(())
    assert not space.connected([(across.x0, 1.2, across.x1, 1.4)], [(6.0, 1.6, 7.0, 2.4)])
