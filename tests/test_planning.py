"""Plans that nobody sees are made in a thread; the record must not tell."""

import pytest

from experiments.house import House
from experiments.runs.records import EventLog
from experiments.session.planning import Planning
from experiments.session.regrets import Regrets
from experiments.trials.setup import early_replanner, prepare_session
from experiments.trials.trial_config import TrialConfig
from mjsim.model.scene import compose
from planner.errors import PlannerError, UnreachableError
from planner.exact.solver import ExactSolver
from planner.replanner import Replanner
from planner.route import TaskState


@pytest.fixture(scope="module")
def house():
    return House.load("apartment")


@pytest.mark.parametrize(("assistance", "user"), [("none", "follower"), ("highlight", "boltzmann:1")])
def test_a_run_is_the_same_whether_plans_are_made_in_the_background_or_at_once(house, assistance, user):
    config = TrialConfig(objects=5, assistance=assistance, seed=2, user=user, fidelity="event")
    scene = compose(house.sample_episode(objects=5, seed=2), house.catalogue)
    runs = []
    for replanner in (
        early_replanner(config, house, scene.episode),
        Replanner(house.geodesics, ExactSolver()),
    ):
        log = EventLog()
        session, _ = prepare_session(config, house, scene, log, replanner=replanner)
        assert session.run() == "all delivered"
        recorded = session.recording.recorded(session.trajectory.arrays()["action"])
        runs.append((log.events, recorded.log_hash.tolist(), recorded.state_hash.tolist()))
    assert runs[0] == runs[1]
    assert sum(event["event"] == "plan" for event in runs[0][0]) > 1, "nobody deviated"


def state(x):
    return TaskState((3.0, 3.0), {"mug": (x, 3.0)}, (), {"mug": (3.0, 3.0)})


def planning(house):
    log = EventLog()
    replanner = Replanner(house.geodesics, ExactSolver())
    return Planning(replanner, Regrets(house.geodesics), log, background=True), log


def test_a_task_that_cannot_be_done_is_reported_at_once(house):
    plans, log = planning(house)
    with pytest.raises(UnreachableError, match="mug"):
        plans.update(0.0, state(99.0), shown=False, more=lambda _: {})
    assert log.entries == 0


def test_a_planner_that_fails_in_the_background_fails_whoever_asks_for_the_plan(house, monkeypatch):
    def fail(*_, **__):
        raise PlannerError("out of ideas")

    monkeypatch.setattr(Replanner, "update", fail)
    plans, log = planning(house)
    plans.update(0.0, state(3.5), shown=False, more=lambda _: {})
    plans.log(0.1, "visit", lambda _: {})
    with pytest.raises(PlannerError, match="out of ideas"):
        _ = plans.next
    with pytest.raises(PlannerError, match="out of ideas"):
        _ = log.events
    assert log.events == []
