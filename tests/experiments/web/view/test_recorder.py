"""What the page of `mjsim view` is told, against the run directory."""

import numpy as np
import pytest

from experiments.record.reader import read_run
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.web.viewing import timeline
from experiments.web.viewing.recorder import DECIMALS, RunRecorder

ROUNDING = 0.51 * 10.0**-DECIMALS


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with breadcrumbs that follow the person, and its record."""
    folder = tmp_path_factory.mktemp("view") / "run"
    config = TrialConfig(objects=3, assistance="guided-xray", seed=4, user="searcher", fidelity="event")
    run_trial(config, folder, topdown=False)
    return folder, read_run(folder)


@pytest.fixture(scope="module")
def seen(run):
    found = []

    def watch(replayer):
        found.append((RunRecorder(), replayer.house))
        return found[0][0]

    replay(run[0], watch=watch)
    return found[0]


@pytest.mark.slow
def test_poses_are_those_of_the_trajectory(run, seen):
    trajectory, (recorder, _) = run[1].trajectory, seen
    steps = len(trajectory["time"])
    np.testing.assert_allclose(recorder.time[:steps], trajectory["time"], atol=ROUNDING)
    body = np.reshape(recorder.body, (-1, 4))[:steps]
    np.testing.assert_allclose(body[:, :2], trajectory["position"], atol=ROUNDING)
    np.testing.assert_allclose(body[:, 2], trajectory["heading"], atol=ROUNDING)
    for index, name in enumerate(run[1].names):
        rows = np.reshape(recorder.objects[name], (-1, 8))
        at = np.searchsorted(rows[:, 0], np.arange(steps), side="right") - 1
        np.testing.assert_allclose(rows[at, 1:4], trajectory["object_position"][:, index], atol=ROUNDING)
    assert min(len(rows) for rows in recorder.objects.values()) > 8 * 50  # each was carried


def test_hands_hold_what_is_carried(run, seen):
    trajectory, (recorder, _) = run[1].trajectory, seen
    step = int(np.flatnonzero(trajectory["hands"][:, 0] >= 0)[20])
    x, y, heading, _ = recorder.body[4 * step : 4 * step + 4]
    forward, left, up = recorder.hands[6 * step : 6 * step + 3]
    c, s = np.cos(heading), np.sin(heading)
    hand = np.array([x + c * forward - s * left, y + s * forward + c * left, up])
    held = trajectory["object_position"][step, trajectory["hands"][step, 0]]
    assert np.linalg.norm(hand - held) < 0.25


def test_every_marker_is_kept_once(seen):
    recorder, _ = seen
    shown = [number for _, numbers in recorder.shown for number in numbers]
    assert sorted(set(shown)) == list(range(len(recorder.markers)))
    assert len(recorder.shown) > 10  # the breadcrumbs follow the person
    assert {marker["role"] for marker in recorder.markers} >= {"breadcrumb", "flagpole"}


def test_the_timeline_has_each_visit_and_the_plans_from_where_the_person_was(run, seen):
    record, house = run[1], seen[1]
    moments = timeline.moments(record, house)
    assert [moment["t"] for moment in moments] == sorted(moment["t"] for moment in moments)
    assert sum("in its bin" in moment["text"] for moment in moments) == 3
    assert moments[-1] == {"t": record.end["t"], "kind": "end", "text": "end: all delivered"}
    plans = timeline.plans(record, house)
    assert len(plans) == len(record.plans)
    for plan, event in zip(plans, record.plans, strict=True):
        path = np.reshape(plan["path"], (-1, 2))
        length = np.linalg.norm(np.diff(path, axis=0), axis=1).sum()
        assert length == pytest.approx(event["cost_m"], rel=0.05)
