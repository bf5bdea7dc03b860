"""Warnings about imported houses that are unlike a home."""

import numpy as np
import pytest

from mjsim.importing.house.floor_grid import CELL, FloorGrid
from mjsim.importing.house.plausibility import RULES, doubts


def grid(sides, *, enclosed=True, walls="WESN"):
    """Create the floor of a room with walls on some sides, in a field that is 4 m wider on each side."""
    margin = round(4 / CELL)
    nx, ny = (round(side / CELL) for side in sides)
    inside = np.zeros((nx + 2 * margin, ny + 2 * margin), bool)
    inside[margin:-margin, margin:-margin] = True
    wall = np.zeros_like(inside)
    across, along = slice(margin, -margin), slice(margin, -margin)
    for side in walls:
        place = {
            "W": (margin, along),
            "E": (-margin - 1, along),
            "S": (across, margin),
            "N": (across, -margin - 1),
        }
        wall[place[side]] = True
    blank = np.zeros_like(inside)
    indoors = inside if enclosed else ~blank
    return FloorGrid(np.zeros(2), wall, wall, blank, indoors, inside, enclosed)


def test_a_closed_home_raises_no_doubts():
    assert list(doubts(grid((6, 5)), 20)) == []


@pytest.mark.parametrize("sides", [(3, 2.5), (25, 20)])
def test_an_area_that_homes_do_not_have_is_doubted(sides):
    assert [f.rule for f in doubts(grid(sides), 20)] == ["area"]


@pytest.mark.parametrize(("places", "rules"), [(5, ["places"]), (6, [])])
def test_fewer_than_six_places_are_doubted(places, rules):
    assert [f.rule for f in doubts(grid((6, 5)), places)] == rules


def test_a_floor_that_walls_do_not_enclose_is_doubted_with_its_share_outside():
    """Three walls of a room of 6 x 5 m in a field of 14 x 13 m: 152 of 182 m2 are outside."""
    open_room = grid((6, 5), enclosed=False, walls="WES")
    assert abs(open_room.outside_share - 152 / 182) < 0.03
    (found,) = doubts(open_room, 20)
    assert (found.rule, found.severity) == ("outline", "warning")
    assert "83 % of its floor" in found.message or "84 % of its floor" in found.message
    assert grid((6, 5)).outside_share == 0


def test_the_rules_are_named_for_tables_of_results():
    assert {f.rule for f in doubts(grid((25, 20), enclosed=False), 0)} == set(RULES)
