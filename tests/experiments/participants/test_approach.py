"""Where participants stop: the reach is free there, and after two lost grips or refusals they stand elsewhere."""

import math
from collections import Counter

import numpy as np
import pytest
from conftest import write_small_house
from sessions import prepared
from small_worlds import edited, episode_of

from experiments.house import House
from experiments.participants.approach import MIN_STOP_DISTANCE, Approach
from experiments.participants.base import Percept
from experiments.participants.visit_executor import VisitExecutor
from experiments.trials.trial_config import TrialConfig
from mjsim.values.actions import ActionResult, Pick, Place, Refusal
from mjsim.values.observation import Observation
from mjsim.world.body.carrying import Carrying
from planner.plan import Visit, VisitKind

TRAY = 'mount:tray" pos="{} 0" quat="0.70710678 0 0 {}"'
BALL = 'type="sphere" pos="0 0 0.06" size="0.06"'
BOARD = 'type="box" pos="0 0 0.015" size="0.15 0.11 0.015"'


@pytest.fixture(scope="module")
def by_the_door(tmp_path_factory):
    """The small house with the tray 0.05 m from the frame of its door, and boards instead of balls."""
    folder = tmp_path_factory.mktemp("by_the_door")
    write_small_house(folder)
    catalogue = folder / "catalogue.toml"
    edited(catalogue, "ball.xml", BALL, BOARD)
    edited(catalogue, "ball.xml", "0 0 0.12", "0 0 0.03")
    edited(
        catalogue, "house.xml", TRAY.format("5.7 3.6", "-0.70710678"), TRAY.format("3.31 1.2", "0.70710678")
    )
    return House.load(str(catalogue))


def played(house, folder, start):
    """Events of a trial in `full` and its deepest penetration, m."""
    boards = [("ball", x, y) for x, y in ((1.0, 1.0), (2.3, 1.5), (1.5, 3.2))]
    episode_of(house.catalogue, start, *boards).save(folder / "episode.json")
    config = TrialConfig(
        objects=3,
        assistance="optimal",
        house=str(house.catalogue.folder / "catalogue.toml"),
        episode=str(folder / "episode.json"),
        seed=0,
        regret=False,
        time_limit=120.0,
    )
    session, world, log = prepared(house, config)
    assert session.run() == "all delivered"
    return log.events, world.health.max_penetration_m


def lost(events):
    return Counter(event["object"] for event in events if event["event"] == "grip_lost")


@pytest.mark.slow
@pytest.mark.parametrize("start", [(2.4, 3.5, 1.0), (1.0, 3.0, 1.0)])
def test_nobody_reaches_around_the_frame_of_a_door(by_the_door, tmp_path, start):
    events, deepest = played(by_the_door, tmp_path, start)
    assert not lost(events) and deepest < 0.010


@pytest.mark.slow
@pytest.mark.parametrize("start", [(2.4, 3.5, 1.0), (1.0, 3.0, 1.0)])
def test_after_two_lost_grips_of_an_object_the_next_attempt_is_made_elsewhere(
    by_the_door, tmp_path, monkeypatch, start
):
    """An object is lost each time that it is placed close to where it was lost first."""
    steps = []  # positions of the person in all control steps of places of this object

    def slipped(carrying):
        person, hand = carrying._person, carrying._person.moving_hand
        if hand is None or person.held[hand] != 0:
            return ()
        steps.append(person.rig.position.copy())
        return (hand,) if len(steps) % 10 == 0 and math.dist(steps[0], steps[-1]) < 0.3 else ()

    monkeypatch.setattr(Carrying, "slipped", slipped)
    events, _ = played(by_the_door, tmp_path, start)
    assert lost(events) == {"o0": 2}


def walk_to_tray(house):
    """The path from the west room to the tray."""
    return house.geodesics.shortest_path((2.5, 1.2), house.approaches["tray"]).points


def test_a_walk_ends_beyond_a_place_from_which_the_reach_is_not_free(by_the_door):
    path, tray = walk_to_tray(by_the_door), by_the_door.receptacles["tray"]
    cut, stop_distance = Approach(by_the_door).end(path, tray, 0.72)
    assert stop_distance == 0.0 and by_the_door.standing.suits(cut[-1], tray)
    assert cut[:-1] == pytest.approx(path[: len(cut) - 1]) and cut[-1, 0] > 3.2
    assert math.dist(cut[-1], path[-1]) > 0.1  # no farther than necessary


def test_other_walks_do_not_change(by_the_door):
    path = by_the_door.geodesics.shortest_path((4.5, 3.0), by_the_door.approaches["crate"]).points
    crate = by_the_door.receptacles["crate"]
    end, stop_distance = Approach(by_the_door).end(path, crate, 0.72)
    assert end is path and stop_distance == 0.72


def attempt(action, position, refusal=None):
    """A percept just after an attempt has begun or was refused."""
    nothing = np.zeros((0, 3))
    seen = Observation(
        *(0.0, np.array(position), 0.0, 0.0, np.zeros(3), np.zeros(2)),
        *((), nothing, np.zeros((0, 4)), (), (None, None), refusal is None),
    )
    return Percept(seen, {"board": "tray"}, ActionResult(action, refusal, action.object, "tray"))


@pytest.mark.parametrize(("lost_at", "moves"), [((), False), ((0.0,), False), ((0.0, 0.05), True)])
def test_the_second_lost_grip_changes_the_place(by_the_door, lost_at, moves):
    approach, tray = Approach(by_the_door), by_the_door.receptacles["tray"]
    usual, place = by_the_door.approaches["tray"], Visit(VisitKind.PLACE, "board")
    percept = attempt(Pick("board"), (2.0, 2.0))
    approach.record(percept)
    for shift in lost_at:
        approach.record(attempt(Place("board"), usual + np.array([0.0, shift])))
        approach.record(attempt(Pick("board"), usual))
    other = approach.elsewhere(percept, place, tray)
    assert (other is not None) == moves
    assert approach.elsewhere(percept, Visit(VisitKind.PICK, "board"), usual) is None
    if other is not None:
        assert math.dist(other, usual) >= 0.4 and by_the_door.standing.suits(other, tray)


def test_a_pick_that_is_refused_close_to_the_object_is_tried_from_all_sides(by_the_door):
    """If it is refused at all places, the participant returns to the first one."""
    executor, at, visit = VisitExecutor(by_the_door), np.array([1.5, 2.0]), Visit(VisitKind.PICK, "board")
    position, ends = np.array([1.5, 1.7]), []
    for _ in range(40):
        action = executor.act(attempt(Pick("board"), position, Refusal.OUT_OF_REACH), visit, {"board": at})
        ends.append((*action.points[-1].tolist(), action.stop_distance))
        if action.stop_distance == 0.0:
            position = action.points[-1]
    firsts = ends.index(next(end for end in ends if end[2] == 0.0))
    assert 3 < firsts < 12  # it is tried closer and closer before
    sides = {round(math.atan2(y - at[1], x - at[0])) for x, y, stop in ends if stop == 0.0}
    assert len(sides) >= 3
    assert 0.0 < max(stop for *_, stop in ends[firsts:]) <= MIN_STOP_DISTANCE


def test_an_object_is_not_fetched_through_a_wall(tmp_path):
    """The nearest floor is on the other side of the wall, because a table top is over the object."""
    write_small_house(tmp_path)
    table = '<geom type="box" pos="2.72 3.4 0.75" size="0.23 0.5 0.03"/></worldbody>'
    catalogue = edited(tmp_path / "catalogue.toml", "house.xml", "</worldbody>", table)
    house, at = House.of(catalogue), np.array([2.85, 3.4])
    assert house.navmesh.snap(at)[0] > 3.0
    place = house.place_of(at)
    assert place[0] < 3.0 and house.standing.suits(place, at)
    episode_of(catalogue, (1.0, 1.0, 0.0), ("cube", *at)).save(tmp_path / "episode.json")
    options = {"house": str(tmp_path / "catalogue.toml"), "episode": str(tmp_path / "episode.json")}
    session, world, _ = prepared(
        house, TrialConfig(objects=1, assistance="optimal", seed=0, regret=False, **options)
    )
    session.begin()
    assert session.assistant.task_state(world.observation()).loose["o0"] == pytest.approx(tuple(place))
    assert session.assistant.guidance(world.observation()).path[-1] == pytest.approx(place, abs=1e-3)
    for point in ((1.0, 1.0), (2.95, 1.0)):  # on the floor, and next to the wall
        assert house.place_of(np.array(point)) == pytest.approx(point)
