"""Plans that are not shown are made in a thread; the record is the same."""

import contextlib

import pytest

from experiments.record.records import EventLog
from experiments.trials.setup import prepare_session, prepared_planner, regret_evaluator, solver_source
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from planner.service import Planner


@pytest.mark.parametrize(("assistance", "user"), [("none", "follower"), ("highlight", "boltzmann:1")])
def test_a_run_is_the_same_whether_plans_are_made_in_a_thread_or_inline(house, assistance, user):
    config = TrialConfig(objects=5, assistance=assistance, seed=2, user=user, fidelity="event")
    scene = compose(house.sample_episode(objects=5, seed=2), house.catalogue)
    runs = []
    for planner in (
        prepared_planner(config, house, scene.episode),
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
