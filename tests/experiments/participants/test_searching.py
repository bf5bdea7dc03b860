"""Where a simulated guest still has to look, and where it need not go any more."""

import math

import numpy as np
import pytest
from scripted_percepts import Script, place_in, place_near, refusal

from experiments.participants.base import FAR, Percept, estimated_distances
from experiments.participants.frontier import SHIFT, Frontier, free_length
from experiments.participants.nearest import Nearest
from experiments.participants.searcher import Searcher
from mjsim.values.actions import IDLE, WAIT, FollowPath, Move, Pick, Place
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


def test_places_are_shifted_at_random_to_all_sides(house):
    around = 0.3 * np.array([[dx, dy] for dx in (-1, 0, 1) for dy in (-1, 0, 1)])
    middle = next(
        point
        for points in house.viewpoints.values()
        for point in points
        if all(house.navmesh.is_navigable(point + offset) for offset in around)
    )
    shifts = []
    for seed in range(300):
        places = [place.point for place in Frontier(house, np.random.default_rng(seed)).places()]
        shifts.append(min((place - middle for place in places), key=np.linalg.norm))
    assert np.abs(np.mean(shifts, axis=0)).max() < 0.03
    assert np.std(shifts, axis=0) == pytest.approx(SHIFT, rel=0.2)


def test_an_unreachable_place_is_far_and_all_others_are_as_far_as_they_are(house):
    start, *goals = house.navmesh.sample(np.random.default_rng(0), 4)
    outside = np.array([-50.0, -50.0])
    found = estimated_distances(house, start, [goals[0], outside, *goals[1:]])
    assert found.pop(1) == FAR
    assert found == pytest.approx(estimated_distances(house, start, goals)) and max(found) < FAR


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


def searcher(house, position, *names):
    return Script(Searcher(house, np.random.default_rng(0)), dict.fromkeys(names, "dish_bin"), position)


@pytest.mark.parametrize("refused", [False, True])
@pytest.mark.parametrize("distance", [1.0, 1.4])
@pytest.mark.parametrize("seen", [False, True])
def test_a_searcher_gives_an_object_up_after_a_refusal_near_its_place_if_it_is_not_seen(
    house, refused, distance, seen
):
    place = place_in(house, "living_room")
    script = searcher(house, place_in(house, "living_room", 5), "cup")
    assert script.aim({"cup": place}) == Pick("cup")
    here, answer = place_near(house, place, distance), refusal("cup") if refused else None
    aim = script.aim({"cup": place} if seen else (), position=here, answer=answer)
    assert (aim == Pick("cup")) == (seen or not refused or distance > 1.2)


def test_a_searcher_places_objects_when_the_hands_are_full_or_no_other_is_known(house):
    here, near, far = (place_in(house, "living_room", number) for number in (0, 6, 1))
    script = searcher(house, here, "cup", "mug", "duck")
    assert script.aim({"cup": near, "mug": far}) == Pick("cup")
    assert script.aim({"duck": here}, position=near) == Pick("cup"), "a visit is pursued"
    assert script.aim(carried=("cup",)) in (Pick("duck"), Pick("mug"))
    assert script.aim(carried=("cup", "mug")) in (Place("cup"), Place("mug"))
    assert script.aim(carried=()) == Pick("duck")
    assert script.aim(carried=("duck",)) == Place("duck")
    assert isinstance(script.act(carried=(), seconds=0.1), Move), "it looks around for more"


def test_a_searcher_turns_around_at_each_place_of_a_room_and_then_goes_to_the_next_room(house):
    script, rooms = searcher(house, place_in(house, "bedroom"), "cup"), []
    for _ in range(len(house.viewpoints["bedroom"]) + 1):
        walk = script.act()
        place = walk.goal if isinstance(walk, FollowPath) else script.percept.position
        rooms.append(house.rooms.room_at(place))
        turns = (
            script.turn()
            if not isinstance(walk, FollowPath)
            else [script.act(position=place), *script.turn()]
        )
        assert sum(isinstance(turn, Move) and turn.turn > 0.0 for turn in turns) >= 12
    assert rooms[:-1] == ["bedroom"] * len(house.viewpoints["bedroom"]) and rooms[-1] != "bedroom"


def test_a_searcher_looks_around_from_half_a_metre_before_a_place(house):
    script = searcher(house, place_in(house, "living_room"), "cup")
    while not isinstance(walk := script.act(), FollowPath):
        script.turn()
    assert walk.stop_distance == 0.5
    for distance, walks in ((0.55, True), (0.45, False)):
        action = script.act(position=place_near(house, walk.goal, distance))
        assert isinstance(action, FollowPath) is walks


def test_a_turn_that_a_find_interrupts_starts_again(house):
    here = place_in(house, "bedroom")
    script = searcher(house, here, "cup", "mug")
    assert [isinstance(script.act(heading=angle), Move) for angle in (0.0, 2.0, 4.0)] == [True] * 3
    assert script.aim({"cup": here + 1.0}) == Pick("cup")
    assert script.aim(carried=("cup",)) == Place("cup")
    turns = [script.act(carried=(), heading=angle, seconds=0.1) for angle in np.arange(1.0, 7.0, 0.5)]
    assert all(isinstance(turn, Move) and turn.turn > 0.0 for turn in turns)
    assert script.act(heading=7.5, seconds=0.1) == IDLE


def test_nearest_turns_to_find_flagpoles_and_makes_the_nearest_visit_until_it_is_impossible(house):
    here, near, far = (place_in(house, "living_room", number) for number in (0, 6, 1))
    script = Script(Nearest(house), dict.fromkeys(["cup", "mug"], "dish_bin"), here)
    *turns, after = script.turn()
    assert all(isinstance(turn, Move) and turn.turn > 0.0 for turn in turns[:-1]) and after == WAIT
    assert script.aim(flagpoles={"mug": far, "cup": near}) == Pick("cup")
    assert script.aim(position=far) == Pick("cup"), "a visit is pursued"
    assert script.aim(answer=refusal("cup"), flagpoles={"mug": far, "cup": near}) == Pick("cup")
    assert script.aim(answer=refusal("cup"), flagpoles={"mug": far}) == Pick("mug"), "it has gone"
    assert script.aim(carried=("mug",), flagpoles={}) == Place("mug")
    assert script.aim(carried=("mug",), flagpoles={"cup": far}) == Place("mug"), "a visit is pursued"
    assert isinstance(Script(Nearest(house), {"cup": "dish_bin"}, here).act(), Move)
