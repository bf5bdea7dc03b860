"""Code of a user's own that crashes the process: standard error names its file and line, and --out stays free."""

import json
import signal

import pytest
from user_code import participant, planner

from faults.conftest import FAST, PROBLEM


@pytest.mark.slow
@pytest.mark.parametrize(
    ("statement", "number"),
    [
        ("import ctypes; ctypes.string_at(0)", signal.SIGSEGV),
        ("os.abort()", signal.SIGABRT),
    ],
)
def test_a_run_whose_participant_crashes_names_it(statement, number, tmp_path, mjsim, own_module):
    own_module(participant(statement, after=30))
    words = ("--no-video", "--no-floor-plan", "--assistance", "none", "--user", "own_code:build")
    done = mjsim("run", *FAST, *words, "--out", "out")
    assert done.returncode == -number
    assert 'own_code.py", line 10 in act' in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_a_planner_that_crashes_says_where(tmp_path, mjsim, own_module):
    own_module(planner("signal.raise_signal(11)"))
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    done = mjsim("plan", "problem.json", "--planner", "own_code:Own")
    assert (done.returncode, done.stdout) == (-signal.SIGSEGV, "")
    assert 'own_code.py", line' in done.stderr


@pytest.mark.slow
def test_a_planner_whose_module_leaves_is_named(tmp_path, mjsim, own_module):
    own_module("import os; os._exit(0)")
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    done = mjsim("plan", "problem.json", "--planner", "own_code:Own")
    assert done.returncode == 1
    assert "cannot make the planner 'own_code:Own': SystemExit" in done.stderr
