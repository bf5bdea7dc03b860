"""Batches whose trials fail."""

import os
import sys

from user_code import participant

from experiments.trials.batch import run_batch
from experiments.trials.design import factorial


def test_one_failing_trial_does_not_stop_the_others(tmp_path, own_module, monkeypatch):
    own_module(participant("raise ValueError('nothing to go for')"))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    users, reports = ["own_code:build", "follower"], []
    design = factorial(
        objects=[2], assistance=["optimal"], users=users, seeds=[0], fidelity="event", regret=False
    )
    rows = run_batch(design, tmp_path / "out", workers=1, on_progress=reports.append)
    assert [row["user"] for row in rows] == ["follower"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1)
    assert any("nothing to go for" in (r.failure or "") for r in reports)
