"""Batches: what fails, and what is refused."""

import os
import sys

import pytest

from experiments.errors import ConfigError
from experiments.trials.batch import run_batch
from experiments.trials.design import Design, factorial

FAILS_WITHOUT_GUIDANCE = """
from experiments.participants.nearest import Nearest


class Fails(Nearest):
    needs = frozenset()

    def act(self, percept):
        if not percept.shown_roles:
            raise ValueError("nothing to go for")
        return super().act(percept)


def build(house, rng):
    return Fails(house)
"""


def test_one_failing_trial_does_not_stop_the_others(tmp_path, monkeypatch):
    (tmp_path / "fails_without_guidance.py").write_text(FAILS_WITHOUT_GUIDANCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    reports, users = [], ["fails_without_guidance:build"]
    design = factorial(objects=[6], assistance=["none"], users=users, seeds=[0])
    shown = factorial(objects=[6], assistance=["highlight"], users=users, seeds=[0])
    out = tmp_path / "out"
    rows = run_batch(Design(design.trials + shown.trials), out, workers=1, on_progress=reports.append)
    assert [row["assistance"] for row in rows] == ["highlight"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1)
    assert any("nothing to go for" in (r.failure or "") for r in reports)


def test_a_batch_needs_a_worker(tmp_path):
    with pytest.raises(ConfigError, match="at least one worker, got 0"):
        run_batch(
            factorial(objects=[6], assistance=["none"], users=["follower"], seeds=[0]), tmp_path, workers=0
        )
