"""The search for bins that a simulated participant has not seen: where it begins, in which order, and when it ends."""

import dataclasses
import math
from types import SimpleNamespace
from typing import ClassVar

import numpy as np
import pytest
from scripted_percepts import Script, place_in

from experiments.participants.base import NEARBY
from experiments.participants.nearest import Nearest
from experiments.participants.searcher import Searcher
from experiments.participants.visit_executor import ARRIVED, BinSearch
from mjsim.values.actions import Move
from mjsim.values.person_parameters import PersonParameters

INTERVAL = PersonParameters().looking_interval


@pytest.fixture(scope="module")
def unseen(house):
    """The apartment for a participant who has seen no bin."""
    return dataclasses.replace(house, seen=frozenset())


def percept(position, time=0.0, heading=0.0, seen=()):
    return SimpleNamespace(
        position=np.array(position), time=time, heading=heading, pitch=0.0, person=PersonParameters(),
        look_for=lambda unknown: set(seen) & set(unknown),
    )  # fmt: skip


def walk(_, goal, stop_distance):
    assert stop_distance == ARRIVED
    return np.array(goal)


def nearest(house, position, points):
    distances = [house.geodesics.shortest_path(position, point).geodesic_distance for point in points]
    return points[int(np.argmin(distances))]


def rooms_of(house):
    return {key: house.catalogue.receptacles[key].room for key in house.receptacles}


def test_a_search_begins_at_the_nearest_viewpoint_of_the_room_and_not_at_the_bin(house, unseen):
    search = BinSearch(unseen)
    for key, room in rooms_of(house).items():
        beside = house.approaches[key]
        for position in (beside, place_in(house, "living_room"), place_in(house, "bedroom")):
            expected = nearest(house, position, house.viewpoints[room])
            assert (search.likely_place(position, key) == expected).all()
            assert (BinSearch(unseen).act(percept(position), key, walk) == expected).all() or (
                math.dist(position, expected) <= ARRIVED
            )


class Crowded:
    """A house that is so full that no room has a viewpoint."""

    viewpoints: ClassVar = {}

    def __init__(self, house):
        self._house = house

    def __getattr__(self, name):
        return getattr(self._house, name)


@pytest.mark.parametrize("make", [Nearest, lambda house: Searcher(house, np.random.default_rng(0))])
def test_bins_in_view_are_remembered_also_while_there_is_nothing_to_visit(unseen, make):
    participant = make(unseen)
    script, (seen, *others) = Script(participant, {}, place_in(unseen, "bedroom")), unseen.receptacles
    script.act(look_for=lambda unknown: {seen} & set(unknown))
    known = participant._executor._bins.knows
    assert known(seen) and not all(map(known, others))


def test_in_a_room_without_viewpoints_a_search_begins_at_the_bin(house, unseen):
    search = BinSearch(Crowded(unseen))
    for key in house.receptacles:
        assert (search.likely_place(place_in(house, "living_room"), key) == house.approaches[key]).all()


def test_all_viewpoints_are_searched_nearest_first_then_the_place_of_the_bin_and_then_all_again(
    house, unseen
):
    key, room = next(iter(rooms_of(house).items()))
    search, position, visited = BinSearch(unseen), house.approaches[key], []
    left = list(house.viewpoints[room])
    for _ in range(2 * (len(left) + 1)):
        goal = search.act(percept(position), key, walk)
        if isinstance(goal, Move):  # the next place is within half a metre
            goal = np.array(search._target)
        visited.append(goal)
        position = goal
        turns = [search.act(percept(position, heading=angle % math.tau), key, walk) for angle in
                 np.arange(0.0, math.tau, 0.5)]  # fmt: skip
        assert all(isinstance(turn, Move) and turn.turn > 0.0 for turn in turns)
        search.act(percept(position, heading=math.tau - 1e-3), key, walk)
    half = len(visited) // 2
    position = house.approaches[key]
    for goal in visited[: half - 1]:
        expected = nearest(house, position, left)
        assert (goal == expected).all()
        left = [point for point in left if not (point == expected).all()]
        position = goal
    assert (visited[half - 1] == house.approaches[key]).all()
    again = {tuple(point) for point in visited[half:]}
    assert again == {tuple(point) for point in visited[:half]}


def test_another_bin_is_searched_from_the_beginning(house, unseen):
    one, room = next(iter(rooms_of(house).items()))
    other = next(key for key, where in rooms_of(house).items() if where != room)
    search, start = BinSearch(unseen), place_in(house, "living_room", 1)
    first = search.act(percept(start), one, walk)
    search.act(percept(start), other, walk)
    assert (search.act(percept(start), one, walk) == first).all()


def test_bins_in_view_and_those_near_by_in_the_same_room_are_known_from_the_next_look_on(house, unseen):
    search, keys = BinSearch(unseen), list(house.receptacles)
    far = place_in(house, "bedroom")
    assert not any(search.knows(key) for key in keys)
    search.look(percept(far, seen=keys[:1]))
    assert [search.knows(key) for key in keys[:2]] == [True, False]
    search.look(percept(far, time=INTERVAL - 0.1, seen=keys[:2]))
    assert not search.knows(keys[1]), "too early"
    search.look(percept(far, time=INTERVAL, seen=keys[:2]))
    assert search.knows(keys[1])
    for key, room in rooms_of(house).items():
        points = house.navmesh.sample(np.random.default_rng(0), 400)
        for point in points:
            inside = house.rooms.room_at(point) == room
            near = house.receptacles[key].distance(point) < NEARBY
            if inside != near or inside:
                fresh = BinSearch(unseen)
                fresh.look(percept(point))
                assert fresh.knows(key) == (inside and near)
                if inside and near:
                    break


def test_a_decision_is_due_at_the_next_look_as_long_as_a_bin_is_unknown(house, unseen):
    search = BinSearch(unseen)
    search.look(percept(place_in(house, "bedroom"), time=3.0))
    assert search.until(None) == 3.0 + INTERVAL
    assert search.until(3.0 + INTERVAL / 2) == 3.0 + INTERVAL / 2
    assert search.until(99.0) == 3.0 + INTERVAL
    knowing = BinSearch(house)
    assert (knowing.until(None), knowing.until(99.0)) == (None, 99.0)
    assert all(knowing.knows(key) for key in house.receptacles)
    partly = BinSearch(dataclasses.replace(house, seen=frozenset([min(house.receptacles)])))
    assert [key for key in house.receptacles if partly.knows(key)] == [min(house.receptacles)]
