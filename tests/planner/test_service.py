"""Check that a plan is kept while it is followed, and replaced after a deviation."""

import contextlib
import itertools

import pytest
from planning_cases import BINS, SEARCH, Task, asked, planner_of, two_rooms

from planner.errors import ProblemError, UnreachableError
from planner.plan import Status, VisitKind
from planner.problem import tour_length
from planner.regret import RegretEvaluator
from planner.route import TaskState
from planner.service import Planner
from planner.solver_source import SolverSource
from planner.solvers import SolveLimit, solver
from planner.task_problems import TaskProblems


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


def guided(geodesics, **options):
    return planner_of(geodesics, solver("ortools"), limit=SolveLimit(work=30), **options)


def length(geodesics, task, visits):
    """Return the length of a tour as the sum of its legs."""
    stops = [task.position, *map(task.place, visits)]
    return sum(geodesics.shortest_path(a, b).geodesic_distance for a, b in itertools.pairwise(stops))


@pytest.mark.parametrize("live", [False, True])
def test_a_followed_plan_is_walked_to_its_end_without_a_change_of_mind(geodesics, live):
    task, walked = Task(geodesics, 8, 3), 0.0
    with contextlib.closing(planner_of(geodesics, SEARCH, live=live)) as guide:
        guide.prepare(task.state)
        planned = asked(guide, task.state)
        assert planned.plan.status is Status.OPTIMAL
        for expected in planned.visits:
            assert guide.next == expected
            walked += geodesics.shortest_path(task.position, task.place(expected)).geodesic_distance
            task.do(*expected)
            route = asked(guide, task.state)
            guide.wait()
            assert guide.improve(task.state) is None
            left = tour_length(TaskProblems(geodesics).problem(task.state), route.visits)
            assert left == pytest.approx(planned.plan.cost - walked, abs=1e-6)
        assert guide.next is None
        assert guide.replans == 0
        assert walked == pytest.approx(planned.plan.cost, abs=1e-6)


def test_two_visits_between_updates_are_still_the_plan(geodesics):
    task, guide = Task(geodesics, 4), guided(geodesics)
    planned = asked(guide, task.state).visits
    for visit in planned[:2]:
        task.do(*visit)
    assert asked(guide, task.state).visits == planned[2:]
    assert guide.replans == 0


def test_a_deviation_is_replanned_and_counted(geodesics):
    task, guide = Task(geodesics, 5), guided(geodesics)
    route = asked(guide, task.state)
    other = next(name for name in task.loose if name != route.next.object)
    task.do(VisitKind.PICK, other)
    route = asked(guide, task.state)
    assert guide.replans == 1
    # The new plan is as short as a plan that is computed from scratch.
    assert route.plan.cost == asked(guided(geodesics), task.state).plan.cost
    assert (VisitKind.PICK, other) not in route.visits
    assert (VisitKind.PLACE, other) in route.visits
    assert len(set(route.visits)) == 9


def test_a_nudge_moves_the_stop_and_a_long_push_replans(geodesics):
    task, guide = Task(geodesics, 3), guided(geodesics)
    order = asked(guide, task.state).visits
    name = next(iter(task.loose))
    x, y = task.loose[name]
    task.loose[name] = (x + 0.1, y)
    route = asked(guide, task.state)
    assert route.visits == order
    assert guide.replans == 0
    planned = tour_length(TaskProblems(geodesics).problem(task.state), order)
    assert planned == pytest.approx(length(geodesics, task, order), abs=1e-6)
    task.loose[name] = (x + 0.5, y)
    asked(guide, task.state)
    assert guide.replans == 1


def test_the_cost_is_the_length_of_the_geodesics_between_the_stops(geodesics):
    task, guide = Task(geodesics, 4), guided(geodesics)
    asked(guide, task.state)
    # Objects are moved and then moved back. Cached distances must belong to the right places.
    moved = dict(list(task.state.loose.items())[::-1])
    moved["object_01"] = (3.3, 3.3)
    for loose in (moved, task.state.loose):
        route = asked(guide, TaskState((3.0, 4.5), loose, (), task.deliveries))
        task.position, task.loose = (3.0, 4.5), loose
        assert route.plan.cost == pytest.approx(length(geodesics, task, route.visits), abs=1e-9)


def test_a_person_squeezed_against_a_wall_is_still_guided(geodesics):
    guide = guided(geodesics)
    route = asked(guide, TaskState((3.8, 1.0), {"mug": (1.0, 1.0)}, (), {"mug": BINS[0]}))
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


def test_there_is_no_route_before_the_first_question(geodesics):
    guide = guided(geodesics)
    assert guide.route is None and guide.next is None
    assert guide.regrets() == {} and guide.regret((VisitKind.PICK, "mug")) is None
    assert guide.improve(Task(geodesics, 3).state) is None


def test_a_plan_for_another_start_is_not_followed(geodesics):
    task = Task(geodesics, 5, 1)
    with contextlib.closing(planner_of(geodesics, solver("exact"), live=True)) as guide:
        guide.prepare(task.state)
        task.position = task.anywhere()
        found = asked(guide, task.state)
    assert found.plan.cost == asked(planner_of(geodesics, solver("exact")), task.state).plan.cost
    assert guide.replans == 0


@pytest.mark.parametrize("live", [False, True])
def test_objects_out_of_reach_are_listed_by_name_at_once_and_planning_goes_on(geodesics, live):
    task = Task(geodesics, 4)
    with contextlib.closing(planner_of(geodesics, solver("exact"), live=live)) as guide:
        guide.prepare(task.state)
        home, bin_ = task.loose["object_01"], task.deliveries["object_02"]
        task.loose["object_01"], task.deliveries["object_02"] = (20.0, 20.0), (1.0, -5.0)
        with pytest.raises(UnreachableError) as caught:
            guide.ask(task.state)
        assert set(caught.value.names) == {"object_01", "object_02"}
        task.loose["object_01"], task.deliveries["object_02"] = home, bin_
        assert len(asked(guide, task.state).visits) == 8


def test_regrets_that_are_shown_leave_the_budget_of_those_that_are_logged(geodesics):
    class Counting(RegretEvaluator):
        def all(self, *args):
            asked.append(self)
            return super().all(*args)

    asked, evaluator = [], Counting(geodesics)
    guide = Planner(SolverSource(geodesics, solver("exact")), evaluator)
    guide.ask(Task(geodesics, 4).state)
    assert guide.regrets(shown=True) == guide.regrets() != {}
    assert asked[1] is evaluator is not asked[0], "one budget for both"
    assert guide.judge(guide.next, 0).exact == 0.0
