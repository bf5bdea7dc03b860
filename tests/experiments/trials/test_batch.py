"""Batches whose trials fail."""

import os
import sys

import pytest
from user_code import participant

from experiments.trials.batch import run_batch
from experiments.trials.design import factorial

ONE = {"objects": [2], "assistance": ["optimal"], "seeds": [0], "fidelity": "event", "regret": False}


@pytest.mark.slow
def test_one_failing_trial_does_not_stop_the_others(tmp_path, own_module, monkeypatch):
    own_module(participant("raise ValueError('nothing to go for')"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    reports, design = [], factorial(**ONE, users=["own_code:build", "follower"])
    rows = run_batch(design, tmp_path / "out", workers=1, on_progress=reports.append)
    assert [row["user"] for row in rows] == ["follower"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1)
    assert any("nothing to go for" in (r.failure or "") for r in reports)


@pytest.mark.slow
def test_a_trial_whose_process_dies_goes_last_and_alone(tmp_path, own_module, monkeypatch):
    """At once and at a resume; what was begun beside it is run as well."""
    own_module(participant("os.kill(os.getpid(), 11)"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    design, outcomes = factorial(**ONE, users=["own_code:build", "follower", "searcher"]), []
    for _ in range(2):
        reports = []
        rows = run_batch(design, tmp_path / "out", workers=2, on_progress=reports.append)
        outcomes.append((reports[-1].done, reports[-1].failed))
        (failure,) = {report.failure for report in reports if report.failure}
        assert "own_code.build" in failure and "its process died" in failure
    assert outcomes == [(2, 1), (0, 1)]
    assert sorted(row["user"] for row in rows) == ["follower", "searcher"]
