"""Whole trials: delivered, measured, recorded and repeatable."""

import json
import subprocess
import sys

import av
import numpy as np
import pytest
from user_code import participant

from experiments.record import records
from experiments.record.files import read_json
from experiments.record.records import read_events
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from mjsim.values.episode import Episode
from mjsim.values.options import FIDELITIES

ASSISTANCE = ("none", "highlight", "optimal")


@pytest.fixture(scope="module")
def runs(house, tmp_path_factory):
    """One trial per assistance condition, on the same disorganized house."""
    root = tmp_path_factory.mktemp("runs")
    for assistance in ASSISTANCE:
        config = TrialConfig(objects=6, assistance=assistance, seed=3)
        run_trial(config, root / assistance, topdown=False, house=house)
    return root


@pytest.mark.parametrize("assistance", ASSISTANCE)
def test_everything_is_delivered_without_mishap(runs, assistance):
    text = (runs / assistance / records.METRICS).read_text()
    metrics = json.loads(text)
    assert metrics["assistance"] == assistance and "NaN" not in text
    assert (metrics["ended"], metrics["delivered"]) == ("all delivered", 6)
    assert metrics["max_penetration_m"] < 0.010
    assert 0 < metrics["ipl_stand"] <= 1.0
    assert metrics["simulated_s"] == pytest.approx(metrics["completion_time_s"])
    assert metrics["renderer"] == "none: nothing was filmed"


def test_help_shortens_the_walk_every_visit_is_judged_and_following_costs_nothing(runs):
    walked = [read_json(runs / a / records.METRICS)["task_distance_m"] for a in ASSISTANCE]
    assert walked == sorted(walked, reverse=True)
    for assistance in ASSISTANCE:
        metrics = read_json(runs / assistance / records.METRICS)
        visits = [e for e in read_events(runs / assistance / records.EVENTS) if e["event"] == "visit"]
        assert metrics["unjudged_visits"] == 0
        assert metrics["total_regret_m"] == pytest.approx(sum(v["regret_m"] for v in visits))
        assert all(v["regret_m"] == 0 for v in visits if not v["deviated"])
        assert all(v["regret_m"] >= 0 for v in visits)
        assert (metrics["total_regret_m"] > 0) == (metrics["nd_feasible"] > 0) == (assistance != "optimal")


def test_the_record_agrees_with_itself(runs):
    folder = runs / "optimal"
    metrics, events = read_json(folder / records.METRICS), read_events(folder / records.EVENTS)
    arrays = np.load(folder / records.TRAJECTORY)
    episode = Episode.load(folder / records.EPISODE)
    assert [e["event"] for e in (events[0], events[-1])] == ["start", "end"]
    assert sorted(e["object"] for e in events if e["event"] == "placed") == sorted(
        o.name for o in episode.objects
    )
    walked = np.linalg.norm(np.diff(arrays["position"], axis=0), axis=1).sum()
    assert metrics["task_distance_m"] == pytest.approx(walked)
    assert np.diff(arrays["time"]) == pytest.approx(0.04)
    assert (arrays["object_status"][-1] == 2).all()
    assert (arrays["hands"][-1] == -1).all()
    assert read_json(folder / records.PLAN)[0]["cost_m"] == metrics["planned_distance_m"]
    assert replay(folder).ended == "all delivered"
    # Nobody is beamed: at most 1.5 m/s.
    assert np.linalg.norm(np.diff(arrays["position"], axis=0), axis=1).max() < 1.5 * 0.04


def test_carried_objects_move_with_the_person(runs):
    arrays = np.load(runs / "optimal" / records.TRAJECTORY)
    carried = np.argwhere(arrays["object_status"] == 1)
    gap = np.linalg.norm(
        arrays["object_position"][carried[:, 0], carried[:, 1], :2] - arrays["position"][carried[:, 0]],
        axis=1,
    )
    assert len(carried) > 100
    assert gap.max() < 1.3


def run_twice(folder, *words):
    """Check that a command writes the same files in two processes. Return the first run and its metrics."""
    for name in ("one", "two"):
        command = [sys.executable, "-m", "experiments.cli.main", "run", *words, "--out", str(folder / name)]
        subprocess.run(command, check=True, capture_output=True, timeout=600)
    files = {path.name for path in (folder / "one").iterdir()}
    assert files == {path.name for path in (folder / "two").iterdir()}
    for name in (files & {*records.FILES}) - {records.METRICS}:
        assert (folder / "one" / name).read_bytes() == (folder / "two" / name).read_bytes(), name
    first, second = (read_json(folder / name / records.METRICS) for name in ("one", "two"))
    del first["wall_s"], second["wall_s"]
    assert first == second
    return folder / "one", first


@pytest.mark.slow
def test_the_same_command_twice_gives_the_same_bytes(tmp_path):
    words = ("--objects", "6", "--seed", "1", "--time-limit", "5", "--size", "320x240")
    run, metrics = run_twice(tmp_path, *words)
    assert len(metrics["frames_sha256"]) == 64
    with av.open(str(run / records.VIDEO)) as container:
        assert sum(1 for _ in container.decode(video=0)) == 125


@pytest.mark.slow
@pytest.mark.long
def test_a_run_with_forty_objects_repeats_and_replays(house, tmp_path):
    """The participant deviates often, so each method of the planner is used."""
    words = ("--objects", "40", "--seed", "2", "--user", "boltzmann:0.5", "--fidelity", "event", "--no-video")
    run, metrics = run_twice(tmp_path, *words)
    visits = [e for e in read_events(run / records.EVENTS) if e["event"] == "visit"]
    assert (metrics["ended"], metrics["delivered"], metrics["assistance"]) == ("all delivered", 40, "optimal")
    assert metrics["nd_feasible"] > 0
    assert len(visits) == metrics["visits"]
    assert all(e["regret_m"] is not None or e["regret_bounds_m"] is not None for e in visits)
    assert replay(run, house=house).ended == "all delivered"


@pytest.mark.parametrize("fidelity", FIDELITIES)
def test_an_interrupted_trial_keeps_what_was_done(fidelity, house, tmp_path):
    reached = []

    def interrupt(progress):
        reached.append(progress.time)
        if progress.time > 2.0:
            raise KeyboardInterrupt

    config = TrialConfig(objects=6, assistance="optimal", seed=0, fidelity=fidelity)
    metrics = run_trial(config, tmp_path / "run", topdown=False, house=house, on_progress=interrupt)
    assert metrics["ended"] == "interrupted"
    assert 2.0 < reached[-1] < 4.0  # after an action, which may take many control steps
    assert metrics["simulated_s"] == pytest.approx(reached[-1], abs=0.05)
    assert metrics["completion_time_s"] >= metrics["simulated_s"]
    assert read_events(tmp_path / "run" / records.EVENTS)[-1]["reason"] == "interrupted"
    assert replay(tmp_path / "run", house=house).ended == "interrupted"


def test_participants_see_only_what_their_condition_shows(house, tmp_path, own_module):
    seen = "percept.guidance, [*percept.flagpoles], percept.hud().markers"
    own_module(participant(f"assert ({seen}) == (None, [], ())"))
    config = TrialConfig(objects=6, assistance="none", seed=0, user="own_code:build", time_limit=0.2)
    assert run_trial(config, tmp_path / "run", topdown=False, house=house)["ended"] == "time limit"
