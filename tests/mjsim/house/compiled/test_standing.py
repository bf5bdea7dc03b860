"""Places to stand: a bin next to a doorway is used from its room, and no reach leads around a wall."""

import dataclasses
import math

import numpy as np
import pytest
from small_worlds import edited, episode_of

from experiments.house import House
from mjsim.house.check import check_path
from mjsim.house.compiled.house import compiled_house

CRATE = 'mount:crate" pos="0.3 3.7 0"'


@pytest.fixture
def by_the_door(fresh_house):
    """The small house with the crate 0.1 m from the frame of the door (y from 1.5 to 2.5 m at x = 3 m)."""
    return House.of(
        edited(fresh_house, "house.xml", CRATE, 'mount:crate" pos="2.6 1.1 0" euler="0 0 -1.5708"')
    )


def test_a_reach_around_the_frame_of_a_door_is_not_free(by_the_door):
    crate, standing = by_the_door.receptacles["crate"], by_the_door.standing
    assert standing.suits(by_the_door.approaches["crate"], crate)
    assert standing.suits(np.array([2.3, 1.7]), crate)
    assert not standing.is_free(np.array([3.15, 1.75]), crate)
    assert not standing.is_free(np.array([3.4, 1.1]), crate)  # through the wall


def test_an_object_is_free_on_this_side_of_a_wall_only(by_the_door):
    here = np.array([2.7, 3.2])
    assert by_the_door.standing.suits(np.array([2.4, 3.5]), here)
    assert not by_the_door.standing.suits(np.array([3.4, 3.2]), here)


@pytest.mark.parametrize(
    ("point", "is_doorway"),
    [
        ((3.0, 2.0), True),
        ((3.1, 1.75), True),
        ((3.2, 2.2), True),
        ((2.6, 2.0), False),
        ((2.7, 3.0), False),
        ((4.5, 2.0), False),
    ],
)
def test_a_doorway_has_walls_on_two_sides_and_rooms_on_the_others(by_the_door, point, is_doorway):
    """The rooms east:1 and east:2 are one room, whose halves meet at y = 2 m."""
    assert by_the_door.standing.in_doorway(np.array(point)) == is_doorway


def test_a_bin_that_faces_a_doorway_is_used_from_next_to_it(fresh_house):
    catalogue = edited(fresh_house, "house.xml", CRATE, 'mount:crate" pos="2.3 1.7 0" euler="0 0 1.5708"')
    house = House.of(catalogue)
    stand, crate = house.approaches["crate"], house.receptacles["crate"]
    assert house.standing.in_doorway(np.array([2.95, 1.75]))  # its own approach
    assert house.standing.suits(stand, crate) and not house.standing.in_doorway(stand)
    assert crate.distance(stand) < house.person.reach


def test_a_suitable_approach_does_not_change(house, small_catalogue):
    for loaded in (house, House.of(small_catalogue)):
        for key, receptacle in compiled_house(loaded.catalogue).receptacles.items():
            np.testing.assert_array_equal(loaded.receptacles[key].approach, receptacle.approach)


def test_places_to_avoid_are_left_out(by_the_door):
    crate, standing = by_the_door.receptacles["crate"], by_the_door.standing
    places = standing.around(crate)
    others = standing.around(crate, [places[0]])
    assert others and all(math.dist(other, places[0]) >= 0.4 for other in others)
    assert all(standing.suits(place, crate) for place in places)


class Doorways:
    """A floor on which people can stand in doorways only."""

    def __init__(self, standing):
        self._standing = standing

    def snap(self, point, max_distance):  # noqa: ARG002
        return point if self._standing.in_doorway(point) else np.array([3.0, 2.0])


def test_a_bin_that_needs_a_doorway_is_recognised(by_the_door):
    crate = by_the_door.receptacles["crate"]
    crate = dataclasses.replace(
        crate, center=np.add(crate.center, (0.0, 0.6, 0.0))
    )  # 0.1 m in front of the doorway
    doorway, room = np.array([3.0, 2.0]), np.array([1.9, 1.7])
    standing = dataclasses.replace(by_the_door.standing, navigable=Doorways(by_the_door.standing))
    assert standing.is_free(doorway, crate)
    assert standing.needs_doorway(crate, doorway)
    assert not standing.needs_doorway(crate, room)
    assert not by_the_door.standing.needs_doorway(crate, doorway)


def test_check_names_what_cannot_be_reached_straight(fresh_house, small_catalogue, tmp_path):
    """Two boards, over which a person can look but not reach, enclose the corner with the crate."""
    boards = "".join(
        f'<geom type="box" pos="{x} {y} 1.16" size="{w} {d} 0.03"/>'
        for x, y, w, d in ((0.5, 3.15, 0.55, 0.05), (1.0, 3.6, 0.05, 0.4))
    )
    edited(fresh_house, "house.xml", "</worldbody>", boards + "</worldbody>")
    episode_of(small_catalogue, (2.0, 1.0, 0.0), ("cube", 0.8, 3.4), ("cube", 2.0, 2.0)).save(
        tmp_path / "episode.json"
    )
    house = str(fresh_house)
    for report in (check_path(house), check_path(str(tmp_path / "episode.json"), house)):
        named = [f for f in report.findings if "straight line" in f.message]
        assert report.usable and [(f.rule, f.severity) for f in named] == [("reach", "warning")]
        assert named[0].subject in ("receptacle crate", "o0")
