"""A session with a person continues after a crash as if there had been none, and leaves a run that replays."""

import itertools
import shutil

import msgspec
import numpy as np
import pytest

from experiments.record.files import read_json
from experiments.record.records import METRICS, TOPDOWN
from experiments.replay.replay import replay
from experiments.trials.trial_config import TrialConfig
from experiments.web.controls import Input
from experiments.web.worker.live_session import LiveSession, journal_of, open_journal, save_run

pytestmark = pytest.mark.usefixtures("frequent_checkpoints")
CONFIG = TrialConfig(objects=6, assistance="guided", seed=3, user="human", live=True, fidelity="event")


def wandering(seed: int, steps: int):
    """What a restless person presses, one batch a control step."""
    rng, number = np.random.default_rng(seed), 0
    for _ in range(steps):
        batch = []
        for _ in range(rng.integers(0, 3) if rng.random() < 0.2 else 0):
            number += 1
            axes = {"forward": float(rng.choice([0.0, 1.0, 1.0])), "yaw": float(rng.normal(0.0, 0.7))}
            press = str(rng.choice(["", "", "act", "left hand"])) or None
            batch.append(Input(number=number, **axes, press=press, scroll=int(rng.choice([0, 0, 0, 2, -1]))))
        yield batch


def play(folder, house, batches, *, config=None):
    """Play batches of inputs; the session, still open."""
    journal = open_journal(folder)
    session = LiveSession(journal, house, config)
    for batch in batches:
        session.step(batch)
    journal.sync()
    return session


def crash(session):
    """Leave a session as the death of its process does."""
    session.close()
    session._journal.close()


def state(session):
    shown = session.session.assistant.hud_state(session.world.observation())
    return (
        session.world.state_hash(),
        session.session.record.step,
        session.input,
        shown.checklist,
        shown.scroll,
    )


@pytest.mark.parametrize("cut", [1, 7, 49, 50, 51, 103, 250])
def test_a_session_resumes_in_the_same_state_with_the_same_plan(house, tmp_path, cut):
    batches = list(wandering(cut, 300))
    whole = play(tmp_path / "whole", house, batches[:cut], config=CONFIG)
    shutil.copytree(tmp_path / "whole", tmp_path / "crashed")
    resumed = play(tmp_path / "crashed", house, [])
    assert resumed.resumed and resumed.config.settings() == CONFIG.settings()
    assert state(resumed) == state(whole)
    for batch in batches[cut:]:
        whole.step(batch)
        resumed.step(batch)
    assert state(resumed)[:3] == state(whole)[:3]
    for session in (whole, resumed):
        session.end("interrupted")


@pytest.mark.parametrize(("crashes", "planner"), [((), "ortools"), ((60, 61, 170), "exact")])
def test_the_run_directory_of_a_session_replays(house, tmp_path, crashes, planner):
    batches = list(wandering(5, 260))
    config = msgspec.structs.replace(CONFIG, planner=planner)
    session = play(tmp_path / "session", house, batches[: crashes[0] if crashes else 260], config=config)
    for first, end in itertools.pairwise((*crashes, 260)):
        crash(session)
        session = play(tmp_path / "session", house, batches[first:end])
    session.end("interrupted")
    save_run(tmp_path / "session", tmp_path / "run", house)
    metrics = read_json(tmp_path / "run" / METRICS)
    assert (metrics["ended"], metrics["user"], metrics["planner"]) == ("interrupted", "human", planner)
    assert metrics["planned_distance_m"] > 0 and session.config.settings() == config.settings()
    report = replay(tmp_path / "run", house=house)
    assert report.steps == 260


def test_an_unfinished_session_leaves_a_run_that_replays(house, tmp_path):
    session = play(tmp_path / "session", house, wandering(8, 120), config=CONFIG)
    save_run(tmp_path / "session", tmp_path / "run", house)
    session.close()
    assert replay(tmp_path / "run", house=house).steps == 120
    (tmp_path / "run" / TOPDOWN).unlink()  # as a kill in between leaves it
    save_run(tmp_path / "session", tmp_path / "run", house)
    assert (tmp_path / "run" / TOPDOWN).is_file()
    assert journal_of(tmp_path / "session") == tmp_path / "session" and journal_of(tmp_path) is None


def test_a_journal_that_is_full_ends_the_session(tmp_path, house, monkeypatch):
    session = play(tmp_path, house, wandering(0, 3), config=CONFIG)
    assert session.end_reason is None
    monkeypatch.setattr("experiments.web.worker.live_session.MAX_JOURNAL", 100)
    assert session.end_reason == "interrupted"
    crash(session)
