"""Paths that the HUD shows: which of them follow a person who leaves them, and which follow an object that moves."""

from types import SimpleNamespace

import numpy as np
import pytest

from experiments.session.shown_path import PathsToNext

START, DOOR, GOAL = np.array([0.0, 0.0]), np.array([1.0, 0.0]), np.array([9.0, 0.0])


class Straight:
    """Geodesics of an empty floor, which keep what they were asked for."""

    def __init__(self):
        self.asked = []

    def shortest_path(self, start, target):
        self.asked.append((tuple(start), tuple(target)))
        return SimpleNamespace(points=np.array([start, target]))


@pytest.fixture
def floor():
    return Straight()


@pytest.fixture
def paths(floor):
    made = PathsToNext(floor)
    made.begin(START, DOOR, GOAL, GOAL)
    assert not floor.asked, "paths are computed when they are shown"
    assert made.segment.points.tolist() == [[0, 0], [9, 0]] and made.path.points.tolist() == [[1, 0], [9, 0]]
    return made


def test_on_the_path_nothing_is_computed_again(paths, floor):
    for x in np.linspace(1.0, 8.0, 15):
        paths.follow(np.array([x, 0.59]), GOAL, GOAL)
    assert len(floor.asked) == 2
    assert paths.path.ahead(np.array([4.0, 0.3])).tolist() == [[4, 0], [9, 0]]


def test_a_person_who_leaves_the_path_gets_a_new_one_and_the_segment_stays(paths, floor):
    paths.follow(np.array([3.0, 0.61]), GOAL, GOAL)
    assert floor.asked[2:] == [((3.0, 0.61), (9.0, 0.0))]
    assert paths.path.points.tolist() == [[3.0, 0.61], [9, 0]]
    assert paths.segment.points.tolist() == [[0, 0], [9, 0]]


def test_a_walk_of_many_steps_gives_the_same_paths_as_its_steps_one_by_one(floor):
    walk = np.column_stack([np.linspace(1.0, 8.0, 40), 2.0 * np.sin(np.linspace(0.0, 6.0, 40))])
    shown, asked = [], []
    for parts in (1, 4, 40):
        floor.asked.clear()
        paths = PathsToNext(floor)
        paths.begin(START, DOOR, GOAL, GOAL)
        _ = paths.path.points
        for part in np.split(walk, parts):
            paths.path.follow(part, GOAL, GOAL)
        shown.append(paths.path.points.tolist())
        asked.append(list(floor.asked))
    assert len(asked[0]) > 3, "the person leaves several paths"
    assert shown[0] == shown[1] == shown[2] and asked[0] == asked[1] == asked[2]


@pytest.mark.parametrize(("shift", "new"), [(0.24, 0), (0.26, 2)])
def test_an_object_that_moves_takes_its_paths_along(paths, floor, shift, new):
    moved, here = np.array([9.0, shift]), np.array([5.0, 0.1])
    paths.follow(here, moved, moved)
    assert len(floor.asked) == 2 + new
    if new:
        assert paths.segment.points.tolist() == [START.tolist(), moved.tolist()]
        assert paths.path.points.tolist() == [here.tolist(), moved.tolist()]
