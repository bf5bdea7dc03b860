"""Live replanning: a plan at once, better ones later, and no change of mind without a reason."""

import json
import threading

import pytest
from planning_cases import Task, two_rooms

from experiments.cli import main
from experiments.house import House
from experiments.replaying.logged_replanner import LoggedReplanner
from experiments.runs import records
from experiments.runs.records import EventLog
from experiments.trials.setup import prepare_session
from experiments.trials.trial_config import TrialConfig
from mjsim.model.scene import compose
from planner.checker import check
from planner.errors import ProblemError, UnreachableError
from planner.exact.solver import ExactSolver
from planner.exact.warm_start import NOTHING_KNOWN
from planner.greedy_solver import nearest_first
from planner.live import TIE, LiveReplanner
from planner.plan import Plan, Status
from planner.replanner import Replanner
from planner.route import TaskState, remaining
from planner.solver import SolveLimit, solver
from planner.task_problems import TaskProblems
from planner.tour import tour_length

SEARCH = ExactSolver(table_bytes=0, passes=((100, 3_000), (1_000, 30_000)))


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


class Script:
    """A solver that hands out prepared orders of visits, the later ones only when told to."""

    name = "script"

    def __init__(self, *orders, bound=0.0, fail=None):
        self.orders, self.bound, self.fail = orders, bound, fail
        self.go = threading.Event()

    def improve(self, problem, *, seed=0, limit=None):  # noqa: ARG002 - the interface of solvers
        for k, order in enumerate(self.orders):
            if k:
                self.go.wait(10)
            visits = order(problem)
            cost = tour_length(problem, visits)
            optimal = cost <= self.bound
            status = Status.OPTIMAL if optimal else Status.FEASIBLE
            yield Plan(tuple(visits), cost, cost if optimal else self.bound, status, 0.0)
        if self.fail is not None:
            raise self.fail


def one_after_another(*shipments):
    return lambda problem: [visit for k in shipments for visit in (problem.pick(k), problem.place(k))]


@pytest.mark.parametrize("seed", range(4))
def test_from_any_state_the_shown_route_ends_up_optimal(geodesics, seed):
    task = Task(geodesics, 9, seed)
    planner = SEARCH if seed % 2 else solver("exact")
    with LiveReplanner(geodesics, planner) as guide:
        guide.prepare(task.state)
        for _ in range(12):
            task.misfortune()
            before = guide.replans
            guide.update(task.state)
            guide.wait()
            guide.poll(task.state)
            assert remaining(guide.route.visits, task.state) == guide.route.visits
            if guide.replans > before:  # else it follows the plan, though from another place
                exact = solver("exact").solve(guide.problems.problem(task.state))
                assert guide.route.plan.cost == pytest.approx(exact.cost, abs=TIE + 1e-3)
                check(guide.problems.problem(task.state), guide.route.plan)
            if guide.route.next is not None:
                task.do(*guide.route.next)
        assert guide.replans >= 4


def test_a_prepared_route_is_followed_to_its_end_without_a_change_of_mind(geodesics):
    task = Task(geodesics, 8, 3)
    with LiveReplanner(geodesics, SEARCH) as guide:
        planned = guide.prepare(task.state)
        assert planned.plan.status is Status.OPTIMAL
        expected, walked = planned.visits, 0.0
        for stop in expected:
            assert guide.route.next == stop
            walked += geodesics.shortest_path(task.position, task.place(stop)).geodesic_distance
            task.do(*stop)
            guide.update(task.state)
            guide.wait()
            assert guide.poll(task.state) is None
        assert guide.replans == 0
        assert walked == pytest.approx(planned.plan.cost, abs=1e-6)


@pytest.fixture
def mirrored():
    bin_ = (2.0, 6.0)
    return TaskState((2.0, 2.0), {"left": (1.0, 2.0), "right": (3.0, 2.0)}, (), {"left": bin_, "right": bin_})


def test_of_two_equal_tours_the_shown_one_stays_and_takes_over_the_proof(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    script.bound = -1.0
    with LiveReplanner(geodesics, script) as guide:
        shown = guide.update(mirrored)
        assert shown.plan.status is Status.FEASIBLE
        script.bound = shown.plan.cost + 1e-3
        script.go.set()
        guide.wait()
        better = guide.poll(mirrored)
        assert better.visits == shown.visits
        assert better.plan.status is Status.OPTIMAL
        assert better.plan.visits == shown.plan.visits
        assert guide.poll(mirrored) is None


def test_a_shorter_tour_is_shown_unless_it_is_too_late(geodesics):
    state = TaskState(
        (1.0, 1.0), {"near": (1.0, 2.0), "far": (1.0, 5.0)}, (), {"near": (1.0, 2.2), "far": (1.0, 5.2)}
    )
    for position, switches in (((1.0, 1.0), True), ((1.0, 5.5), False)):
        script = Script(one_after_another(1, 0), one_after_another(0, 1))
        with LiveReplanner(geodesics, script) as guide:
            shown = guide.update(state)
            assert guide.poll(state) is None
            script.go.set()
            guide.wait()
            now = TaskState(position, state.loose, (), state.deliveries)
            better = guide.poll(now)
            if switches:
                assert better.plan.cost < shown.plan.cost - TIE
                assert better.next.object == "near"
            assert guide.route.next.object == ("near" if switches else "far")


def test_a_proof_that_begins_otherwise_than_what_was_done_is_asked_for_anew(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    with LiveReplanner(geodesics, script) as guide:
        guide.update(mirrored)
        left = TaskState((1.0, 2.0), {"right": (3.0, 2.0)}, ("left",), mirrored.deliveries)
        guide.update(left)
        assert guide.replans == 0
        script.orders = (lambda problem: nearest_first(problem),)
        script.go.set()
        guide.wait()
        assert guide.poll(left) is None  # it said: first the right one
        guide.wait()
        guide.poll(left)
        assert len(guide.route.visits) == 3
        check(guide.problems.problem(left), guide.route.plan)


def test_nobody_waits_for_the_proof(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    with LiveReplanner(geodesics, script) as guide:
        shown = guide.update(mirrored)
        assert guide.busy
        for _ in range(100):
            assert guide.poll(mirrored) is None
        assert guide.update(mirrored).visits == shown.visits
        assert guide.busy
        script.go.set()


def test_what_a_proof_dies_of_is_told(geodesics, mirrored):
    with LiveReplanner(
        geodesics, Script(one_after_another(0, 1), fail=ProblemError("no such thing"))
    ) as guide:
        guide.update(mirrored)
        guide.wait()
        with pytest.raises(ProblemError, match="no such thing"):
            guide.poll(mirrored)


def test_objects_out_of_reach_are_listed_by_name_and_the_guide_goes_on(geodesics):
    task = Task(geodesics, 4, 0)
    with LiveReplanner(geodesics, solver("exact")) as guide:
        guide.prepare(task.state)
        home = task.loose["object_01"]
        task.loose["object_01"] = (20.0, 20.0)
        with pytest.raises(UnreachableError) as caught:
            guide.update(task.state)
        assert caught.value.names == ("object_01",)
        task.loose["object_01"] = home
        assert len(guide.update(task.state).visits) == 8


@pytest.mark.parametrize("name", ["ortools", "greedy"])
def test_other_solvers_can_guide_live_too(geodesics, name):
    task = Task(geodesics, 4, 1)
    with LiveReplanner(geodesics, solver(name), limit=SolveLimit(work=20)) as guide:
        route = guide.prepare(task.state, seconds=30)
        check(guide.problems.problem(task.state), route.plan)


def test_what_is_known_of_some_objects_serves_a_problem_with_others(geodesics):
    task = Task(geodesics, 16, 1)
    problems = TaskProblems(geodesics)
    problem = problems.problem(task.state)
    plan = SEARCH.solve(problem)
    warm = NOTHING_KNOWN.updated(problem, plan)
    first = next(SEARCH.improve(problem, warm=warm))
    check(problem, first)
    assert first.cost == pytest.approx(plan.cost)
    del task.loose["object_00"]
    task.loose["new"], task.deliveries["new"] = task.anywhere(), task.deliveries["object_00"]
    other = problems.problem(task.state)
    *_, found = SEARCH.improve(other, warm=warm)
    check(other, found)
    assert found.cost == pytest.approx(solver("exact").solve(other).cost, abs=1e-3)


class Stuck:
    """A solver that hands out a first plan and then gets stuck, and notes who waits for it."""

    name = "stuck"

    def __init__(self):
        self.free = threading.Event()
        self.waiting = []

    def solve(self, *_, **__):
        raise AssertionError("nobody may ask for a finished plan")

    def improve(self, problem, *, seed=0, limit=None):  # noqa: ARG002 - the interface of solvers
        held = [problem.place(k) for k in range(len(problem.shipments), len(problem.names))]
        visits = held + one_after_another(*range(len(problem.shipments)))(problem)
        cost = tour_length(problem, visits)
        yield Plan(tuple(visits), cost, 0.0, Status.FEASIBLE, 0.0)
        self.waiting.append(threading.get_ident())
        assert self.free.wait(60)


def test_a_session_goes_on_while_every_proof_is_stuck():
    house, log, planner = House.load(), EventLog(), Stuck()
    config = TrialConfig(objects=6, assistance="highlight", seed=3, live=True, regret=False)
    scene = compose(house.sample_episode(objects=6, seed=3), house.catalogue)
    planner.free.set()  # the familiarisation may wait
    with LiveReplanner(house.geodesics, planner) as guide:
        session, _ = prepare_session(config, house, scene, log, replanner=guide)
        planner.free.clear()
        assert session.run() == "all delivered"
        assert guide.replans >= 2
        assert len(planner.waiting) == guide.replans + 1  # the first one for the familiarisation
        assert threading.get_ident() not in planner.waiting
        planner.free.set()
    plans = [event for event in log.events if event["event"] == "plan"]
    assert len(plans) == guide.replans + 1
    assert plans[0]["t"] == 0.0


def test_the_command_line_runs_live_and_its_replay_shows_the_logged_plans(tmp_path, monkeypatch):
    """Not even a planner that would plan otherwise changes what a replay shows."""
    run = str(tmp_path / "run")
    options = ["--objects", "16", "--seed", "4", "--user", "boltzmann:20", "--time-limit", "14", "--no-video"]
    assert main(["run", "--live", *options, "--assistance", "optimal-regret", "--out", run]) == 0
    metrics = json.loads((tmp_path / "run" / records.METRICS).read_text())
    assert metrics["live"] is True
    assert metrics["unjudged_visits"] == 0
    plans = json.loads((tmp_path / "run" / records.PLAN).read_text())
    assert metrics["replans"] == sum(not plan.get("improved", False) for plan in plans) - 1 >= 1
    assert all(plan["lower_bound_m"] <= plan["cost_m"] + 1e-9 for plan in plans)
    asked = []
    monkeypatch.setattr(ExactSolver, "solve", lambda *_, **__: asked.append("solve"))
    monkeypatch.setattr(ExactSolver, "improve", lambda *_, **__: asked.append("improve"))
    assert main(["replay", run]) == 0
    assert asked == []


def test_a_better_plan_that_was_logged_is_handed_out_when_it_was_shown(mirrored):
    def logged(t, order, **more):
        visits = [[kind, name] for name in order for kind in ("pick", "place")]
        numbers = {"cost_m": 9.0, "lower_bound_m": 8.0, "status": "feasible"}
        return {"t": t, "event": "plan", "visits": visits, **numbers, **more}

    now = [0.0]
    first, second = ("left", "right"), ("right", "left")
    plans = LoggedReplanner([logged(0.0, first), logged(1.0, second, improved=True)], lambda: now[0])
    assert plans.update(mirrored).next.object == "left"
    now[0] = 0.5
    assert not plans.pending
    assert plans.poll(mirrored) is None
    now[0] = 1.0
    assert plans.pending
    assert plans.poll(mirrored).next.object == "right"
    assert not plans.pending
    assert plans.replans == 0


def test_the_repeatable_replanner_never_changes_its_mind(geodesics):
    task = Task(geodesics, 4, 0)
    guide = Replanner(geodesics, solver("exact"))
    guide.update(task.state)
    assert guide.poll(task.state) is None
