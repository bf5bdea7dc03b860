"""Batches: what fails, and what is refused."""

import os
import sys

import pytest
from user_code import participant

from experiments.errors import ConfigError
from experiments.trials.batch import run_batch
from experiments.trials.design import factorial

ONE = {"objects": [2], "assistance": ["optimal"], "seeds": [0], "fidelity": "event", "regret": False}


def test_one_failing_trial_does_not_stop_the_others(tmp_path, own_module, monkeypatch):
    own_module(participant("raise ValueError('nothing to go for')"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    reports, design = [], factorial(**ONE, users=["own_code:build", "follower"])
    rows = run_batch(design, tmp_path / "out", workers=1, on_progress=reports.append)
    assert [row["user"] for row in rows] == ["follower"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1)
    assert any("nothing to go for" in (r.failure or "") for r in reports)


def test_a_batch_needs_a_worker(tmp_path):
    with pytest.raises(ConfigError, match="at least one worker, got 0"):
        run_batch(factorial(**ONE, users=["follower"]), tmp_path, workers=0)
