"""Plans that are not shown are made in a thread; the record is the same."""

import contextlib
import json
import math
from types import SimpleNamespace

import numpy as np
import pytest
from sessions import play

from experiments.cli.main import main
from experiments.record.records import EVENTS, METRICS, EventLog, read_events
from experiments.session.task_log import TaskLog, reach_bound
from experiments.trials import setup
from experiments.trials.setup import prepare_session, regret_evaluator, solver_source, trial_planner
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from planner.exact.solver import ExactSolver
from planner.plan import Status, Visit, VisitKind
from planner.regret import RegretBounds, RegretEvaluator
from planner.service import Planner
from planner.solvers import SolveLimit


@pytest.mark.slow
@pytest.mark.parametrize(("assistance", "user"), [("none", "follower"), ("highlight", "boltzmann:1")])
def test_a_run_is_the_same_whether_plans_are_made_in_a_thread_or_inline(house, assistance, user):
    config = TrialConfig(objects=5, assistance=assistance, seed=2, user=user, fidelity="event")
    scene = compose(house.sample_episode(objects=5, seed=2), house.catalogue)
    runs = []
    for planner in (
        trial_planner(config, house, scene.episode),
        Planner(solver_source(config, house), regret_evaluator(config, house)),
    ):
        log = EventLog()
        session, _ = prepare_session(config, house, scene, log, planner=planner)
        with contextlib.closing(planner):
            assert session.run() == "all delivered"
        recorded = session.record.record().recording
        runs.append((log.events, recorded["log_hash"].tolist(), recorded["state_hash"].tolist()))
    assert runs[0] == runs[1]
    assert sum(event["event"] == "plan" for event in runs[0][0]) > 1, "there was no deviation"


def test_the_regret_of_the_suggestion_is_logged_with_that_of_the_visit(house):
    """Plans of six objects are proven, so that nothing better than a suggestion can be done."""
    visits = play(house, "optimal", user="nearest", regret=True).of("visit")
    assert all(visit["suggested_regret_m"] == 0.0 for visit in visits)
    followed, others = (
        [v["regret_m"] for v in visits if v["deviated"] is deviated] for deviated in (False, True)
    )
    assert max(followed) == 0.0 and min(others) >= 0.0 and max(others) > 1.0


def test_a_regret_that_is_not_proven_is_logged_as_bounds(tmp_path, monkeypatch):
    """The record can be read and replayed, and measures treat the regret as unknown."""

    def without_states(_, house):
        searching = ExactSolver(table_bytes=0, passes=())
        return RegretEvaluator(house.geodesics, solver=searching, limit=SolveLimit(work=1))

    run, exact = tmp_path / "run", tmp_path / "exact"
    words = [
        "run",
        "--objects",
        "9",
        "--seed",
        "5",
        "--assistance",
        "none",
        "--user",
        "searcher",
        "--time-limit",
        "60",
    ]
    words += ["--fidelity", "event", "--no-video", "--no-floor-plan", "--out"]
    assert main([*words, str(exact)]) == 0
    monkeypatch.setattr(setup, "regret_evaluator", without_states)
    assert main([*words, str(run)]) == 0
    visits, truth = ([e for e in read_events(d / EVENTS) if e["event"] == "visit"] for d in (run, exact))
    bounded = [(v, t) for v, t in zip(visits, truth, strict=True) if v["regret_m"] is None]
    assert bounded
    assert all(
        v["regret_bounds_m"][0] - 3e-3 <= t["regret_m"] <= v["regret_bounds_m"][1] + 3e-3 for v, t in bounded
    )
    assert all("regret_bounds_m" not in v for v in visits if v["regret_m"] is not None)
    assert not any("regret_bounds_m" in t for t in truth)
    assert json.loads((run / METRICS).read_text())["unjudged_visits"] == len(bounded)
    assert main(["replay", str(run)]) == 0


PICK, PLACE = VisitKind.PICK, VisitKind.PLACE
TARGETS = {"cup": "rack", "plate": "rack", "duck": "chest"}


@pytest.mark.parametrize(
    ("loose", "carried", "made", "suggested", "expected"),
    [
        (3, (), Visit(PICK, "cup"), Visit(PICK, "duck"), (2, 0, False)),
        (1, ("cup", "plate"), Visit(PLACE, "cup"), Visit(PLACE, "plate"), (1, 1, True)),
        (1, ("cup", "plate"), Visit(PLACE, "plate"), Visit(PLACE, "plate"), (1, 1, False)),
        (1, ("cup", "duck"), Visit(PLACE, "duck"), Visit(PLACE, "cup"), (1, 0, False)),
        (2, ("cup",), Visit(PICK, "plate"), Visit(PLACE, "cup"), (2, 0, False)),
        (0, ("cup",), Visit(PLACE, "cup"), None, (0, 0, False)),
    ],
)
def test_alternatives_are_what_could_be_done_and_ties_are_of_one_bin(
    loose, carried, made, suggested, expected
):
    """With full hands, nothing can be picked up."""
    log = TaskLog(None, EventLog(), None, SimpleNamespace(targets=TARGETS), capacity=2, regrets=False)
    state = SimpleNamespace(carried=carried, loose=dict.fromkeys(range(loose)))
    found = log._alternatives(state, made, suggested)
    assert (found["alternatives"], found["tied_alternatives"], found["tied"]) == expected


@pytest.mark.parametrize(("x", "y"), [(0.1, 0.8), (0.1, -0.8), (-0.1, 0.8), (-0.1, -0.8)])
def test_the_bound_of_a_walk_saves_the_reach_on_both_ways_but_the_last(x, y):
    """A bin of 0.4 m by 0.6 m, seen from each of its corners: its far corner is 0.3 m to the side and 1.1 m away."""
    bin_ = SimpleNamespace(
        half_size=np.array([0.2, 0.3, 0.5]),
        rotation=np.eye(3),
        center=np.array([x, y, 0.5]),
        approach=np.zeros(2),
    )
    house = SimpleNamespace(person=SimpleNamespace(reach=0.9), receptacles={"rack": bin_})
    episode = SimpleNamespace(
        objects=[SimpleNamespace(name=name) for name in ("cup", "plate")],
        targets={"cup": "rack", "plate": "rack"},
    )
    place = 0.9 + math.hypot(0.3, 1.1)
    saved = 2 * (2 * 0.9 + 2 * place) - place
    assert reach_bound(30.0, house, episode) == pytest.approx(30.0 - saved)
    assert reach_bound(1.0, house, episode) == 0.0


def route(*visits, cost=9.1234567, bound=8.7654321, status=Status.FEASIBLE):
    plan = SimpleNamespace(cost=cost, lower_bound=bound, status=status)
    return SimpleNamespace(plan=plan, visits=visits, next=visits[0] if visits else None)


FIRST, SECOND = Visit(PICK, "cup"), Visit(PICK, "duck")


@pytest.mark.parametrize(
    ("before", "better", "differs"),
    [
        (route(FIRST, SECOND), None, False),
        (route(FIRST, SECOND), route(FIRST, SECOND), False),
        (route(FIRST, SECOND), route(SECOND, FIRST), True),
        (None, route(FIRST), True),
    ],
)
def test_a_better_plan_is_logged_as_such_and_says_whether_its_visits_differ(before, better, differs):
    planner, log = SimpleNamespace(route=before, improve=lambda _: better), EventLog()
    task = TaskLog(planner, log, None, None, capacity=2, regrets=False)
    assert task.improve(2.5, None) == differs
    expected = {"event": "plan", "t": 2.5, "cost_m": 9.123457, "lower_bound_m": 8.765432, "improved": True}
    expected["status"] = "feasible"
    if better is None:
        assert log.events == []
    else:
        assert log.events == [{**expected, "visits": [["pick", visit.object] for visit in better.visits]}]


def test_regrets_that_were_late_are_logged_with_their_visit_and_bounds_are_rounded_outwards():
    found = [
        ((3, ("regret",)), RegretBounds(1.23456789, 1.23456789, 1.23456789)),
        ((4, ("regret", "suggested_regret")), RegretBounds(0.10000049, 2.00000011, None)),
        ((5, ("suggested_regret",)), None),
    ]
    log = EventLog()
    TaskLog(SimpleNamespace(finish=lambda: found), log, None, None, capacity=2, regrets=True).finish(7.0)
    bounds = [0.1, 2.000001]
    assert [{k: v for k, v in e.items() if k not in ("event", "t")} for e in log.events] == [
        {"visit": 3, "regret_m": 1.234568},
        {
            "visit": 4, "regret_m": None, "regret_bounds_m": bounds,
            "suggested_regret_m": None, "suggested_regret_bounds_m": bounds,
        },
        {"visit": 5, "suggested_regret_m": None},
    ]  # fmt: skip
    assert {(event["event"], event["t"]) for event in log.events} == {("regret", 7.0)}


@pytest.mark.parametrize(
    ("made", "planned", "status", "judged"),
    [
        (FIRST, FIRST, Status.OPTIMAL, []),
        (SECOND, FIRST, Status.OPTIMAL, [(SECOND, ("regret",))]),
        (FIRST, FIRST, Status.FEASIBLE, [(FIRST, ("regret", "suggested_regret"))]),
        (SECOND, FIRST, Status.FEASIBLE, [(SECOND, ("regret",)), (FIRST, ("suggested_regret",))]),
        (FIRST, None, None, [(FIRST, ("regret", "suggested_regret"))]),
    ],
)
def test_a_suggestion_of_a_proven_plan_has_no_regret_and_all_else_is_judged(made, planned, status, judged):
    asked = []

    def judge(visit, key):
        asked.append((visit, key[1]))
        assert key[0] == 0  # number of the visit
        return RegretBounds(1.5, 1.5, 1.5)

    task = TaskLog(SimpleNamespace(judge=judge), EventLog(), None, None, capacity=2, regrets=True)
    fields = task._regrets_of(made, None if planned is None else route(planned, status=status))
    assert asked == judged
    names = {name for _, keys in judged for name in keys}
    assert fields == {f"{name}_m": 1.5 if name in names else 0.0 for name in ("regret", "suggested_regret")}
