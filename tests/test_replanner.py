"""Alongside a live task the plan is kept while followed and made anew after a deviation."""

import itertools

import pytest
from planning_cases import BINS, Task, two_rooms

from planner.errors import PlannerError, ProblemError, UnreachableError
from planner.plan import VisitKind
from planner.replanner import Replanner
from planner.route import TaskState
from planner.solver import SolveLimit, solver


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


def replanner(geodesics, **options):
    return Replanner(geodesics, solver("ortools"), limit=SolveLimit(work=30), **options)


def length(geodesics, task, visits):
    """Length of a tour, leg by leg."""
    stops = [task.position, *map(task.place, visits)]
    return sum(geodesics.shortest_path(a, b).geodesic_distance for a, b in itertools.pairwise(stops))


def test_a_followed_plan_is_walked_to_its_end_without_replanning(geodesics):
    task, guide = Task(geodesics, 5), replanner(geodesics)
    route = guide.update(task.state)
    planned, walked = route, 0.0
    for expected in planned.visits:
        assert route.next == expected
        walked += geodesics.shortest_path(task.position, task.place(expected)).geodesic_distance
        task.do(*expected)
        route = guide.update(task.state)
        left = guide.problems.length(task.state, route.visits)
        assert left == pytest.approx(planned.plan.cost - walked, abs=1e-6)
    assert route.next is None
    assert guide.replans == 0
    assert walked == pytest.approx(planned.plan.cost, abs=1e-6)


def test_two_visits_between_updates_are_still_the_plan(geodesics):
    task, guide = Task(geodesics, 4), replanner(geodesics)
    planned = guide.update(task.state).visits
    for visit in planned[:2]:
        task.do(*visit)
    assert guide.update(task.state).visits == planned[2:]
    assert guide.replans == 0


def test_a_deviation_is_replanned_and_counted(geodesics):
    task, guide = Task(geodesics, 5), replanner(geodesics)
    route = guide.update(task.state)
    other = next(name for name in task.loose if name != route.next.object)
    task.do(VisitKind.PICK, other)
    route = guide.update(task.state)
    assert guide.replans == 1
    # The new plan is the best from the new state, as planning afresh finds it.
    assert route.plan.cost == replanner(geodesics).plan(task.state).plan.cost
    assert (VisitKind.PICK, other) not in route.visits
    assert (VisitKind.PLACE, other) in route.visits
    assert len(set(route.visits)) == 9


def test_a_dropped_object_is_replanned(geodesics):
    task, guide = Task(geodesics, 3), replanner(geodesics)
    route = guide.update(task.state)
    task.do(*route.next)
    guide.update(task.state)
    name = task.carried.pop()
    task.loose[name] = (3.0, 4.5)
    route = guide.update(task.state)
    assert guide.replans == 1
    assert (VisitKind.PICK, name) in route.visits
    assert route.plan.cost == pytest.approx(length(geodesics, task, route.visits), abs=1e-6)


def test_a_nudge_moves_the_stop_and_a_long_push_replans(geodesics):
    task, guide = Task(geodesics, 3), replanner(geodesics)
    order = guide.update(task.state).visits
    name = next(iter(task.loose))
    x, y = task.loose[name]
    task.loose[name] = (x + 0.1, y)
    route = guide.update(task.state)
    assert route.visits == order
    assert guide.replans == 0
    planned = guide.problems.length(task.state, order)
    assert planned == pytest.approx(length(geodesics, task, order), abs=1e-6)
    task.loose[name] = (x + 0.5, y)
    guide.update(task.state)
    assert guide.replans == 1


def test_the_cost_is_the_length_of_the_geodesics_between_the_stops(geodesics):
    task, guide = Task(geodesics, 4), replanner(geodesics)
    guide.update(task.state)
    # A state seen before, objects moved and back: reused distances must be those of the right places.
    moved = dict(list(task.state.loose.items())[::-1])
    moved["object_01"] = (3.3, 3.3)
    for loose in (moved, task.state.loose):
        route = guide.plan(TaskState((3.0, 4.5), loose, (), task.deliveries))
        task.position, task.loose = (3.0, 4.5), loose
        assert route.plan.cost == pytest.approx(length(geodesics, task, route.visits), abs=1e-9)


def test_objects_out_of_reach_are_listed_by_name(geodesics):
    loose = {"mug": (1.0, 1.0), "sock": (9.6, 1.0), "can": (1.0, 2.0)}
    deliveries = {"mug": BINS[0], "sock": BINS[0], "can": (1.0, -5.0)}
    with pytest.raises(UnreachableError, match=r"can.*|sock.*") as caught:
        replanner(geodesics).plan(TaskState((0.5, 0.5), loose, (), deliveries))
    assert set(caught.value.names) == {"sock", "can"}


def test_a_person_squeezed_against_a_wall_is_still_guided(geodesics):
    guide = replanner(geodesics)
    route = guide.update(TaskState((3.8, 1.0), {"mug": (1.0, 1.0)}, (), {"mug": BINS[0]}))
    assert route.next is not None
    assert route.next == (VisitKind.PICK, "mug")
    to_bin = geodesics.shortest_path((1.0, 1.0), BINS[0]).geodesic_distance
    assert route.plan.cost - to_bin == pytest.approx(2.65, abs=1e-3)


def test_contradictory_states_are_refused():
    for loose, carried, deliveries in (
        ({"mug": (1, 1)}, ("mug",), {"mug": (2, 2)}),
        ({}, ("mug", "mug"), {"mug": (2, 2)}),
        ({"mug": (1, 1)}, (), {}),
    ):
        with pytest.raises(ProblemError, match="mug"):
            TaskState((0, 0), loose, carried, deliveries)


def test_asking_for_a_route_before_planning_is_a_typed_error(geodesics):
    with pytest.raises(PlannerError, match="no route yet"):
        _ = replanner(geodesics).route
