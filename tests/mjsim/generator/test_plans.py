"""Laws of floor plans, whatever the seed."""

import itertools
from collections.abc import Iterator

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mjsim.generator.openings import add_openings, wall_stretches
from mjsim.generator.plan import draw_rooms
from mjsim.generator.programme import NEEDS, draw_programme
from mjsim.generator.values import SIDES, WALL, HomePlan, Rectangle
from mjsim.house.catalogue.generated_names import ROOMS
from mjsim.values.errors import HouseError

CASES = given(seed=st.integers(0, 10**6), rooms=st.integers(1, 7))
FEW = settings(max_examples=12, deadline=None, derandomize=True)


def plan_of(seed: int, rooms: int) -> HomePlan:
    programme, found = draw_rooms(seed, rooms)
    return add_openings(seed, programme, found)


def cells(plan: HomePlan) -> list[Rectangle]:
    return [room.floor.grown(WALL / 2) for room in plan.rooms]


@FEW
@CASES
def test_rooms_are_disjoint_and_cover_a_rectangle_or_an_l(seed: int, rooms: int) -> None:
    found = cells(plan_of(seed, rooms))
    assert not any(a.overlaps(b) for a, b in itertools.combinations(found, 2))
    outline = Rectangle(
        min(c.x0 for c in found),
        min(c.y0 for c in found),
        max(c.x1 for c in found),
        max(c.y1 for c in found),
    )
    free = outline.area - sum(cell.area for cell in found)
    corners = itertools.product((outline.x0, outline.x1), (outline.y0, outline.y1))
    bare = [(x, y) for x, y in corners if not any(c.contains(x, y) for c in found)]
    assert free == pytest.approx(0.0, abs=1e-6) if not bare else len(bare) == 1


@pytest.mark.slow
@FEW
@CASES
def test_rooms_are_as_large_as_they_should_be_and_have_daylight(seed: int, rooms: int) -> None:
    plan = plan_of(seed, rooms)
    assert len(plan.rooms) == rooms
    for room in plan.rooms:
        needs = NEEDS[room.key]
        assert needs.area[0] <= room.floor.area <= needs.area[1]
        assert min(room.floor.width, room.floor.depth) >= needs.side - 1e-6
        assert not needs.daylight or plan.windows_of(room.key)


@pytest.mark.slow
@FEW
@CASES
def test_doors_connect_all_rooms_and_are_wide_enough(seed: int, rooms: int) -> None:
    plan = plan_of(seed, rooms)
    assert sum(door.is_front for door in plan.doors) == 1
    reached = {plan.rooms[0].key}
    for _ in plan.rooms:
        reached |= {key for door in plan.doors if reached & set(door.rooms) for key in door.rooms}
    assert reached == {room.key for room in plan.rooms}
    for door in plan.doors:
        assert door.width >= 0.85
        for key in door.rooms:
            low, high = plan.room(key).floor.wall(door.side_in(key))
            assert low < door.center - door.width / 2
            assert door.center + door.width / 2 < high


@FEW
@CASES
def test_openings_of_a_wall_do_not_meet(seed: int, rooms: int) -> None:
    plan = plan_of(seed, rooms)
    for room, side in itertools.product(plan.rooms, SIDES):
        doors = (d for d in plan.doors_of(room.key) if d.side_in(room.key) == side)
        windows = [w for w in plan.windows_of(room.key) if w.side == side]
        holes = sorted((o.center - o.width / 2, o.center + o.width / 2) for o in (*doors, *windows))
        assert all(a[1] <= b[0] for a, b in itertools.pairwise(holes))
        outside = [(a, b) for a, b, is_outside in wall_stretches(room, side, plan.rooms) if is_outside]
        for window in windows:
            half = window.width / 2
            assert any(a < window.center - half and window.center + half < b for a, b in outside)


def test_another_number_of_rooms_is_refused() -> None:
    for rooms in (ROOMS[0] - 1, ROOMS[1] + 1):
        with pytest.raises(HouseError, match=rf"of {rooms} rooms .* ask for 1 to 10"):
            draw_rooms(0, rooms)


def programmes() -> Iterator[frozenset[str]]:
    from mjsim.house.catalogue.generated_names import stream

    for seed in range(60):
        yield frozenset(draw_programme(8, stream(seed, "programme")).areas)


def test_homes_of_one_size_differ_in_their_rooms() -> None:
    assert len(set(programmes())) >= 8
