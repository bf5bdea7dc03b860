"""Tests of live replanning: a first plan appears immediately, and only better plans replace it."""

import argparse
import contextlib
import json
import threading
import time

import planning_cases
import pytest
from planning_cases import SEARCH, Task, asked, planner_of, two_rooms

from experiments.cli import batch, play
from experiments.cli.main import main
from experiments.record import records
from experiments.record.records import EventLog
from experiments.trials import setup
from experiments.trials.replay.replayer import LogSource
from experiments.trials.setup import prepare_session, trial_planner
from experiments.trials.training import trials_of
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from planner.checker import check
from planner.errors import ProblemError
from planner.exact.solver import ExactSolver
from planner.exact.warm_start import NOTHING_KNOWN
from planner.greedy_solver import nearest_first
from planner.plan import Plan, Status, VisitKind
from planner.problem import possible_next, tour_length
from planner.regret import RegretEvaluator
from planner.route import TaskState, remaining
from planner.service import Planner
from planner.solver_source import TIE, SolverSource
from planner.solvers import SolveLimit, solver
from planner.task_problems import TaskProblems


@pytest.fixture(scope="module")
def geodesics():
    return two_rooms()


def live(geodesics, solver, **options):
    return contextlib.closing(planner_of(geodesics, solver, live=True, **options))


class Script:
    """A solver that yields prepared plans. It waits for a signal before each plan except the first."""

    name = "script"

    def __init__(self, *orders, bound=0.0, fail=None):
        self.orders, self.bound, self.fail = orders, bound, fail
        self.go, self.waiting = threading.Event(), []

    def improve(self, problem, *, seed=0, limit=None):  # noqa: ARG002 - the interface of solvers
        for k, order in enumerate(self.orders):
            if k:
                self.waiting.append(threading.get_ident())
                assert self.go.wait(60)
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
    with live(geodesics, planner) as guide:
        guide.prepare(task.state)
        for _ in range(12):
            task.misfortune()
            before = guide.replans
            asked(guide, task.state)
            guide.wait()
            guide.improve(task.state)
            assert remaining(guide.route.visits, task.state) == guide.route.visits
            if guide.replans > before:  # otherwise the person follows the plan, possibly from another place
                exact = solver("exact").solve(TaskProblems(geodesics).problem(task.state))
                assert guide.route.plan.cost == pytest.approx(exact.cost, abs=TIE + 1e-3)
                check(TaskProblems(geodesics).problem(task.state), guide.route.plan)
            if guide.route.next is not None:
                task.do(*guide.route.next)
        assert guide.replans >= 4


@pytest.fixture
def mirrored():
    bin_ = (2.0, 6.0)
    return TaskState((2.0, 2.0), {"left": (1.0, 2.0), "right": (3.0, 2.0)}, (), {"left": bin_, "right": bin_})


def test_of_two_equal_tours_the_shown_one_stays_and_takes_over_the_proof(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    script.bound = -1.0
    with live(geodesics, script) as guide:
        shown = asked(guide, mirrored)
        assert shown.plan.status is Status.FEASIBLE
        script.bound = shown.plan.cost + 1e-3
        script.go.set()
        guide.wait()
        better = guide.improve(mirrored)
        assert better.visits == shown.visits
        assert better.plan.status is Status.OPTIMAL
        assert better.plan.visits == shown.plan.visits
        assert guide.improve(mirrored) is None


def test_a_bound_within_the_rounding_of_an_unproven_plan_is_no_proof(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    with live(geodesics, script) as guide:
        shown = asked(guide, mirrored)
        script.bound = shown.plan.cost - 5e-4  # two tours within 0.8 mm count as equal here
        script.go.set()
        guide.wait()
        better = guide.improve(mirrored)
        assert better.visits == shown.visits
        assert (better.plan.status, better.plan.lower_bound) == (Status.FEASIBLE, script.bound)


def test_a_shorter_tour_is_shown_unless_it_is_too_late(geodesics):
    state = TaskState(
        (1.0, 1.0), {"near": (1.0, 2.0), "far": (1.0, 5.0)}, (), {"near": (1.0, 2.2), "far": (1.0, 5.2)}
    )
    for position, switches in (((1.0, 1.0), True), ((1.0, 5.5), False)):
        script = Script(one_after_another(1, 0), one_after_another(0, 1))
        with live(geodesics, script) as guide:
            shown = asked(guide, state)
            assert guide.improve(state) is None
            script.go.set()
            guide.wait()
            now = TaskState(position, state.loose, (), state.deliveries)
            better = guide.improve(now)
            if switches:
                assert better.plan.cost < shown.plan.cost - TIE
                assert better.next.object == "near"
            assert guide.route.next.object == ("near" if switches else "far")


def test_a_proof_that_begins_otherwise_than_what_was_done_is_asked_for_anew(geodesics, mirrored):
    script = Script(one_after_another(0, 1), one_after_another(1, 0))
    with live(geodesics, script) as guide:
        asked(guide, mirrored)
        left = TaskState((1.0, 2.0), {"right": (3.0, 2.0)}, ("left",), mirrored.deliveries)
        asked(guide, left)
        assert guide.replans == 0
        script.orders = (nearest_first,)
        script.go.set()
        guide.wait()
        assert guide.improve(left) is None  # the proven plan starts with the right object
        guide.wait()
        guide.improve(left)
        assert len(guide.route.visits) == 3
        check(TaskProblems(geodesics).problem(left), guide.route.plan)


def test_what_a_proof_dies_of_is_told(geodesics, mirrored):
    script = Script(one_after_another(0, 1), fail=ProblemError("no such thing"))
    with live(geodesics, script) as guide:
        asked(guide, mirrored)
        guide.wait()
        with pytest.raises(ProblemError, match="no such thing"):
            guide.improve(mirrored)


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


def test_a_session_continues_while_every_proof_is_stuck(house, monkeypatch):
    def in_turn(problem):
        n = len(problem.shipments)
        held = [problem.place(k) for k in range(n, len(problem.names))]
        return held + one_after_another(*range(n))(problem)

    log, planner = EventLog(), Script(in_turn, in_turn)
    config = TrialConfig(objects=6, assistance="highlight", seed=3, live=True, regret=False, fidelity="event")
    scene = compose(house.sample_episode(objects=6, seed=3), house.catalogue)
    planner.go.set()  # let the plan of the familiarisation finish
    monkeypatch.setattr(setup, "planner_named", lambda _: planner)
    with contextlib.closing(trial_planner(config, house, scene.episode)) as guide:
        session, _ = prepare_session(config, house, scene, log, planner=guide)
        planner.go.clear()
        assert session.run() == "all delivered"
        assert guide.replans >= 2
        planner.go.set()
        guide.wait()
        assert len(planner.waiting) == guide.replans + 1  # one more for the familiarisation
        assert threading.get_ident() not in planner.waiting
    plans = [event for event in log.events if event["event"] == "plan"]
    assert len(plans) == guide.replans + 1
    assert plans[0]["t"] == 0.0


def test_the_command_line_runs_live_and_its_replay_shows_the_logged_plans(tmp_path, monkeypatch):
    """The replay must not call the planner, which might plan differently."""
    run = str(tmp_path / "run")
    options = ["--objects", "16", "--seed", "4", "--user", "boltzmann:20", "--time-limit", "14"]
    options += ["--no-video", "--fidelity", "event"]
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


@pytest.mark.parametrize(("live", "delivered"), [([], 4), (["--live", "--time-limit", "5"], 0)])
def test_or_tools_plans_where_it_is_chosen(tmp_path, monkeypatch, live, delivered):
    """The exact planner must not plan, but it still computes the regrets."""

    def fail(*_args, **_options):
        pytest.fail("planned by the exact planner")

    monkeypatch.setattr(ExactSolver, "improve", fail)
    monkeypatch.setattr("planner.solver_source.PROOF_LIMIT", SolveLimit(seconds=0.3))
    words = ["--objects", "4", "--planner", "ortools", "--fidelity", "event", "--no-regret"]
    words += ["--no-video", "--no-floor-plan", "--out", str(tmp_path / "run")]
    assert main(["run", *live, *words]) == 0
    metrics = json.loads((tmp_path / "run" / records.METRICS).read_text())
    assert (metrics["planner"], metrics["delivered"]) == ("ortools", delivered)
    assert json.loads((tmp_path / "run" / records.PLAN).read_text())


def test_a_batch_and_play_take_or_tools():
    parser = argparse.ArgumentParser()
    commands = parser.add_subparsers()
    batch.add_parser(commands)
    play.add_parser(commands)
    design = batch._design(parser.parse_args(["batch", "--planner", "ortools", "--out", "out"]))
    assert {trial.planner for trial in design.trials} == {"ortools"}
    task = play.task_of(parser.parse_args(["play", "--planner", "ortools"]))
    assert {trial["planner"] for trial in trials_of(task).values()} == {"ortools"}


def test_a_better_plan_that_was_logged_is_handed_out_when_it_was_shown(geodesics, mirrored):
    def logged(t, order, **more):
        visits = [[kind, name] for name in order for kind in ("pick", "place")]
        numbers = {"cost_m": 9.0, "lower_bound_m": 8.0, "status": "feasible"}
        return {"t": t, "event": "plan", "visits": visits, **numbers, **more}

    first, second = ("left", "right"), ("right", "left")
    plans = LogSource([logged(0.0, first), logged(1.0, second, improved=True)])
    guide = Planner(plans, RegretEvaluator(geodesics))
    assert asked(guide, mirrored).next.object == "left"
    plans.clock = lambda: 0.5
    assert not guide.pending
    assert guide.improve(mirrored) is None
    plans.clock = lambda: 1.0
    assert guide.pending
    assert guide.improve(mirrored).next.object == "right"
    assert not guide.pending
    assert guide.replans == 0


def test_a_logged_route_is_followed_live_from_where_the_log_ends(geodesics):
    task = Task(geodesics, 6, 2)
    with live(geodesics, solver("exact")) as guide:
        shown = asked(guide, task.state)
        source = SolverSource(geodesics, solver("exact"))
        source.adopt(task.state)
        guide.use(source)
        assert asked(guide, task.state).visits == shown.visits
        task.do(*next(v for v in possible_next(source.problems.problem(task.state)) if v != shown.next))
        assert asked(guide, task.state).visits != shown.visits
        assert guide.replans == 1


@pytest.fixture
def slow(monkeypatch):
    """Make the evaluator wait for a signal before it returns regrets."""
    go, states = threading.Event(), []

    class Slow(RegretEvaluator):
        def limited(self, limit):
            return Slow(self.geodesics, limit=limit)

        def all(self, state, plan=None):
            states.append(state)
            go.wait(10)
            return super().all(state, plan)

    monkeypatch.setattr(planning_cases, "RegretEvaluator", Slow)
    return go, states


def test_the_caller_never_waits_for_regrets_and_they_are_those_of_a_run_that_repeats(geodesics, slow):
    go, states = slow
    state = Task(geodesics, 8, 1).state
    with live(geodesics, solver("exact")) as guide:
        guide.ask(state)
        for _ in range(50):
            assert guide.regrets() == {}
            guide.ask(state)
        go.set()
        guide.wait()
        assert len(states) == 1  # computed only once for many requests
        assert guide.regrets() == RegretEvaluator(geodesics).all(state) != {}


def test_regrets_of_a_state_that_is_past_are_not_shown(geodesics, slow):
    go, _ = slow
    task = Task(geodesics, 6, 2)
    with live(geodesics, solver("exact")) as guide:
        guide.ask(task.state)
        guide.regrets()
        task.do(VisitKind.PICK, "object_03")
        guide.ask(task.state)
        go.set()
        guide.regrets()
        guide.wait()
        assert (VisitKind.PLACE, "object_03") in guide.regrets()
        assert (VisitKind.PICK, "object_03") not in guide.regrets()


def test_visits_are_judged_after_the_task(geodesics):
    task, expected = Task(geodesics, 7, 3), {}
    inline = planner_of(geodesics, solver("exact"))
    with live(geodesics, solver("exact")) as guide:
        for number in range(4):
            stop = list(RegretEvaluator(geodesics).all(task.state))[-1]
            for planner in (guide, inline):
                planner.ask(task.state)
            expected[number] = inline.judge(stop, number).exact
            assert guide.judge(stop, number) is None
            task.do(*stop)
        found = {number: bounds.exact for number, bounds in guide.finish()}
        assert found == pytest.approx(expected, abs=1e-9)
        assert guide.finish() == inline.finish() == []


def test_neither_the_start_nor_the_end_waits_for_proofs_or_regrets(geodesics, monkeypatch):
    go = threading.Event()

    class Stuck(RegretEvaluator):
        def limited(self, limit):
            return Stuck(self.geodesics, limit=limit)

        def all(self, *_):
            go.wait(60)
            return {}

        def bounds(self, state, visit, plan=None):
            if len(state.loose) < 4:
                go.wait(60)
            return super().bounds(state, visit, plan)

    monkeypatch.setattr(planning_cases, "RegretEvaluator", Stuck)
    task, script = Task(geodesics, 4, 1), Script(one_after_another(0, 1, 2, 3), nearest_first)
    with live(geodesics, script) as guide:
        started = time.monotonic()
        guide.prepare(task.state, seconds=0.1)
        visits = asked(guide, task.state).visits[:2]
        for number, visit in enumerate(visits):
            guide.judge(visit, number)
            task.do(*visit)
            guide.ask(task.state)
        assert time.monotonic() - started < 10.0
        found = dict(guide.finish())
        assert time.monotonic() - started < 20.0
        assert found[0].exact is not None
        assert found[1] is None
        script.go.set()
        go.set()


def test_regrets_that_are_not_computed_at_the_end_are_bounded(geodesics, monkeypatch):
    monkeypatch.setattr("planner.service.FINISH_SECONDS", 0.0)
    monkeypatch.setattr("planner.service.BOUNDS_SECONDS", 20.0)
    begun, go = threading.Event(), threading.Event()

    class Late(RegretEvaluator):
        def limited(self, limit):
            return Late(self.geodesics, solver=SEARCH, limit=limit)

        def bounds(self, *args):
            begun.set()
            assert go.wait(20)
            return super().bounds(*args)

    monkeypatch.setattr(planning_cases, "RegretEvaluator", Late)
    task, exact = Task(geodesics, 14, 1), RegretEvaluator(geodesics)
    with live(geodesics, solver("greedy")) as guide:
        guide.ask(task.state)
        stop = list(exact.all(task.state))[-1]
        guide.judge(stop, 0)
        assert begun.wait(20)
        threading.Timer(0.2, go.set).start()  # after `finish` has given up waiting
        ((_, found),) = guide.finish()
    assert found.exact is None
    assert found.lower - 3e-3 <= exact.of(task.state, stop) <= found.upper + 3e-3
