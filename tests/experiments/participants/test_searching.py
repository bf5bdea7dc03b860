"""Where a simulated guest still has to look, and where it need not go any more."""

import math

import numpy as np
import pytest

from experiments.participants.base import Percept
from experiments.participants.frontier import Frontier, free_length
from mjsim.values.observation import Observation


def stands(position, heading):
    x, y = position
    eye, nothing = np.array([x, y, 1.6]), np.zeros((0, 3))
    return Percept(
        Observation(
            *(0.0, np.array([x, y]), heading, 0.0, eye, np.zeros(2)),
            *((), nothing, np.zeros((0, 4)), (), (None, None), False),
        ),
        {},
    )


def look_all_around(frontier, position, room, within):
    for heading in np.arange(0.0, 2 * math.pi, 0.2):
        frontier.mark_seen(stands(position, heading), room, within)


def test_a_full_turn_sees_what_is_near_in_this_room_with_nothing_in_between_and_nothing_else(house):
    for room, points in house.viewpoints.items():
        frontier, position = Frontier(house, np.random.default_rng(0)), points[0]
        before = list(frontier.places())
        look_all_around(frontier, position, room, 3.0)
        for place in before:
            way = place.point - position
            free = free_length(house.navmesh.outline, position, place.point) >= np.linalg.norm(way) - 1e-9
            seen = place.room == room and np.linalg.norm(way) <= 3.0 and free
            assert frontier.is_left(place) == (not seen)


def test_nobody_sees_what_is_behind(house):
    frontier = Frontier(house, np.random.default_rng(0))
    place = next(place for place in frontier.places() if place.room == "kitchen")
    eye = house.navmesh.snap(place.point + np.array([0.4, 0.0]))
    towards = math.atan2(*(place.point - eye)[::-1])
    frontier.mark_seen(stands(eye, towards + math.pi), "kitchen", 5.0)
    assert frontier.is_left(place)
    frontier.mark_seen(stands(eye, towards), "kitchen", 5.0)
    assert not frontier.is_left(place)


def test_whoever_has_missed_something_goes_nearer_the_next_time(house):
    frontier, position = Frontier(house, np.random.default_rng(0)), house.viewpoints["living_room"][0]
    left = []
    for _ in range(4):
        all_places = len(frontier.places())
        look_all_around(frontier, position, "living_room", 4.0)
        left.append(all_places - len(frontier.places()))
        for place in list(frontier.places()):
            frontier.mark_searched(place)
    assert left == sorted(left, reverse=True) and left[0] > left[-1] >= 1


def test_a_straight_line_ends_at_the_first_wall():
    walls = np.array([[2.0, -1.0, 2.0, 1.0], [1.0, -1.0, 1.0, 1.0], [-1.0, -1.0, -1.0, 1.0]])
    assert free_length(walls, np.zeros(2), np.array([4.0, 0.0])) == pytest.approx(1.0)
    assert free_length(walls, np.zeros(2), np.array([0.5, 0.0])) == pytest.approx(0.5)
    assert free_length(walls, np.zeros(2), np.array([0.0, 7.0])) == pytest.approx(7.0)
