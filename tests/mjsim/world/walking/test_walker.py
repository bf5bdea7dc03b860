"""Walking for a participant: what counts as an obstacle, and what happens when a walk does not get on."""

import dataclasses

import numpy as np
import pytest

from experiments.participants.base import Percept
from experiments.participants.visit_executor import CLOSER, MIN_STOP_DISTANCE, STOP_SHARE, VisitExecutor
from mjsim.values.actions import ActionResult, FollowPath, Move, Pick, Refusal
from mjsim.values.errors import ActionError
from mjsim.values.observation import ObjectStatus, Observation
from mjsim.values.person_parameters import PersonParameters
from mjsim.world.walking.path_following import CHANGED, WALKING, plain, step_from_python
from mjsim.world.walking.walker import BACK_OFF, BACK_OFF_TIME, Walker
from planner.plan import Visit, VisitKind

STEP = 0.04  # s
NO_WALLS = np.array([(-9, -9, 9, -9), (9, -9, 9, 9), (9, 9, -9, 9), (-9, 9, -9, -9)], dtype=float)


def seen(time=0.0, position=(0.0, 0.0), heading=0.0, objects=()):
    """A person among loose objects, which are called a, b, ..."""
    return Observation(
        time=time,
        position=np.array(position),
        heading=heading,
        pitch=0.0,
        eye=np.array([*position, 1.6]),
        velocity=np.zeros(2),
        object_names=tuple("abcdef"[: len(objects)]),
        object_positions=np.array([(x, y, 0.0) for x, y in objects]).reshape(-1, 3),
        object_quaternions=np.tile([1.0, 0.0, 0.0, 0.0], (len(objects), 1)),
        object_status=(ObjectStatus.LOOSE,) * len(objects),
        hands=(None, None),
        busy=False,
    )


def walk_to(x, then=None):
    return FollowPath(np.array([(0.0, 0.0), (x, 0.0)]), np.array([x, 0.0]), 0.5, then)


def test_an_object_in_the_way_is_sidestepped_unless_the_visit_is_about_it():
    ahead = seen(objects=[(0.6, 0.1), (5.0, 5.0)])
    straight = Walker(PersonParameters(), NO_WALLS).step(walk_to(3.0, Pick("a")), ahead)
    aside = Walker(PersonParameters(), NO_WALLS).step(walk_to(3.0, Pick("b")), ahead)
    assert straight.turn == straight.left == 0.0
    assert aside.turn < 0.0
    carried = dataclasses.replace(ahead, object_status=(ObjectStatus.CARRIED, ObjectStatus.LOOSE))
    assert Walker(PersonParameters(), NO_WALLS).step(walk_to(3.0, Pick("b")), carried).turn == 0.0


def test_at_the_end_of_a_walk_the_person_turns_to_the_goal_and_acts():
    walker, walk = Walker(PersonParameters(), NO_WALLS), walk_to(3.0, Pick("a"))
    turn = walker.step(walk, seen(position=(2.7, 0.0), heading=1.0))
    assert (turn.forward, turn.left) == (0.0, 0.0)
    assert turn.turn < 0.0
    assert walker.step(walk, seen(position=(2.7, 0.0), heading=0.1)) == Pick("a")
    assert walker.step(walk_to(3.0), seen(position=(2.7, 0.0), heading=1.0)) == Move()


@pytest.mark.parametrize("patience", [1.0, 2.0])
def test_a_blocked_person_backs_off_on_the_way_to_a_visit(patience):
    person = PersonParameters(patience=patience)
    walker, walk = Walker(person, NO_WALLS), walk_to(3.0, Pick("a"))
    moves, blocked = [], []
    for k in range(round((patience + BACK_OFF_TIME) / STEP) + 3):  # and the person does not move
        moves.append(walker.step(walk, seen(time=k * STEP)))
        blocked.append(walker.blocked)
    assert moves.count(BACK_OFF) == round(BACK_OFF_TIME / STEP) - 1
    assert blocked.index(True) * STEP == pytest.approx(patience + STEP)
    assert blocked.count(True) == round(BACK_OFF_TIME / STEP)
    assert moves[-1] == moves[0]
    assert blocked[-1] is False


def test_a_blocked_person_who_only_walks_is_told_so_and_does_not_back_off():
    walker, walk = Walker(PersonParameters(), NO_WALLS), walk_to(3.0)
    moves = [walker.step(walk, seen(time=k * STEP)) for k in range(60)]
    assert BACK_OFF not in moves


def test_a_walk_continues_only_while_there_is_nothing_new():
    walker = Walker(PersonParameters(), NO_WALLS)
    path = dataclasses.replace(walk_to(3.0), shown=True, tolerance=0.3)
    asked = seen(objects=[(5.0, 5.0), (1.0, 5.0)])
    later = dataclasses.replace(asked, time=1.0, position=np.array([1.0, 0.29]))
    shifted = asked.object_positions + np.array([(0.0, 0.0, 0.0), (0.0, 0.0, 1e-12)])

    def phase(asked, now):
        state = now.position, now.heading, now.time, walker.progress, now.object_positions
        return step_from_python(plain(walker.walk(path, asked)), *state, False)[0]

    assert phase(asked, later) == WALKING
    for new in ({"position": np.array([1.0, 0.31])}, {"object_positions": shifted}, {"time": 9.0}):
        assert phase(asked, dataclasses.replace(later, **new)) == CHANGED, new
    carrying = dataclasses.replace(asked, object_status=(ObjectStatus.LOOSE, ObjectStatus.CARRIED))
    assert phase(carrying, dataclasses.replace(later, object_positions=shifted)) == WALKING


class House:
    seen, receptacles = None, {}
    """A floor without walls, where every path has a detour of its own."""

    def __init__(self):
        self.asked = 0
        self.geodesics = self.navmesh = self.standing = self

    def shortest_path(self, start, goal):
        self.asked += 1
        return type("Path", (), {"points": np.array([start, goal])})

    def snap(self, position):
        return position

    place_of = snap

    def suits(self, *_):
        return True


def percept(observation, *, refused=False, blocked=False):
    answer = ActionResult(Pick("a"), Refusal.OUT_OF_REACH) if refused else None
    return Percept(observation, {"a": "bin"}, answer, blocked=blocked)


def test_refusals_bring_the_person_closer_and_a_new_visit_starts_afresh():
    executor, there = VisitExecutor(House()), {"a": np.array([3.0, 0.0]), "b": np.array([0.0, 3.0])}
    pick = Visit(VisitKind.PICK, "a")
    distances = [executor.act(percept(seen(), refused=k > 0), pick, there).stop_distance for k in range(6)]
    first = STOP_SHARE * PersonParameters().reach
    assert distances[:3] == pytest.approx([first, first - CLOSER, first - 2 * CLOSER])
    assert distances[-1] == MIN_STOP_DISTANCE
    other = executor.act(percept(seen()), Visit(VisitKind.PICK, "b"), there)
    assert (other.stop_distance, other.then) == (first, Pick("b"))


def test_a_path_is_kept_until_the_person_leaves_it_or_is_blocked():
    house = House()
    executor, there = VisitExecutor(house), {"a": np.array([3.0, 0.0])}

    def asked(position, **more):
        executor.act(percept(seen(position=position), **more), Visit(VisitKind.PICK, "a"), there)
        return house.asked

    assert [asked((0.0, 0.0)), asked((1.0, 0.1)), asked((1.0, 0.5)), asked((1.5, 0.4))] == [1, 1, 2, 2]
    assert asked((1.5, 0.4), blocked=True) == 3


@pytest.mark.parametrize("shape", [(2,), (0, 2), (3, 3)])
def test_paths_of_another_shape_are_refused(shape):
    with pytest.raises(ActionError, match="points of a path must have the shape"):
        FollowPath(np.zeros(shape), np.zeros(2), 0.5)


def test_lists_are_paths_and_words_are_none():
    path = FollowPath([[0, 0], [1, 0]], (1, 0), 0.5)
    assert path.points.dtype == path.goal.dtype == np.float64 and path.points.shape == (2, 2)
    with pytest.raises(ActionError, match="must be arrays of numbers"):
        FollowPath([["a", "b"]], (1, 0), 0.5)
