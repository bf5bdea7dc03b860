"""Code of a user's own that ends the process: one line with its file and line, and what was simulated is kept."""

import json
import signal
import subprocess
import sys

import pytest

from benchmarks.support.user_code import participant, planner
from experiments.record import records
from experiments.record.files import read_json
from experiments.replay.replay import replay
from faults.conftest import FAST, PROBLEM, ROOT, one_line

CRASH = "import ctypes; ctypes.string_at(0)"
LEAVE = "import ctypes; ctypes.CDLL(None)._exit(0)"


@pytest.mark.parametrize(("statement", "how"), [(CRASH, "by SIGSEGV"), (LEAVE, "")])
def test_a_run_whose_participant_crashes_is_kept(statement, how, house, tmp_path, mjsim, own_module):
    own_module(participant(statement, after=30))
    words = ("--no-video", "--no-floor-plan", "--assistance", "none", "--user", "own_code:build")
    done = mjsim("run", *FAST, *words, "--out", "out")
    line = one_line(done.stderr)
    assert done.returncode == 1 and f"participant Own ended the process {how}".strip() in line
    assert ("own_code.py, line 10)" in line) == bool(how)
    metrics = read_json(tmp_path / "out" / records.METRICS)
    assert metrics["ended"] == "error" and metrics["simulated_s"] == pytest.approx(30 * 0.04, abs=0.05)
    assert replay(tmp_path / "out", house=house).ended == "error"
    assert {path.name for path in tmp_path.iterdir()} - {"__pycache__"} == {"out", "own_code.py"}


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (planner("os.abort()"), "planner 'own_code:Own' ended the process by SIGABRT"),
        ("import os; os.abort()", "code of your own ended the process by SIGABRT"),
        (planner("signal.raise_signal(11)"), "planner 'own_code:Own' ended the process by SIGSEGV"),
        ("import os; os._exit(0)", "cannot make the planner 'own_code:Own': SystemExit"),
    ],
)
def test_a_planner_that_crashes_says_where(text, said, tmp_path, mjsim, own_module):
    own_module(text)
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    done = mjsim("plan", "problem.json", "--planner", "own_code:Own")
    assert (done.returncode, done.stdout) == (1, "")
    assert said in one_line(done.stderr) and "own_code.py, line" in done.stderr


def test_a_signal_that_another_thread_gets_names_the_planner(tmp_path, mjsim, own_module):
    """A process that sends itself a signal gets it in its main thread, where the call may be over."""
    own_module(planner("os.kill(os.getpid(), 11)"))
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    line = one_line(mjsim("plan", "problem.json", "--planner", "own_code:Own").stderr)
    assert "ended the process by SIGSEGV" in line and "planner 'own_code:Own'" in line


def test_a_signal_to_the_command_reaches_its_child(tmp_path, own_module):
    own_module(planner("print('here', flush=True); time.sleep(60)"))
    (tmp_path / "problem.json").write_text(json.dumps(PROBLEM))
    words = [sys.executable, "-m", "mjsim", "plan", "problem.json", "--planner", "own_code:Own"]
    process = subprocess.Popen(
        words,
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None and process.stdout.readline() == "here\n"
    process.send_signal(signal.SIGTERM)
    assert "stopped by SIGTERM" in process.communicate(timeout=60)[1]
    assert process.returncode == 128 + signal.SIGTERM
