"""Commands as a user gives them, and a user's own code."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.trials.trial_config import TrialConfig

BRIEF = TrialConfig(objects=2, assistance="optimal", seed=0, fidelity="event", regret=False)
PROBLEM = {"distances": [[0, 1], [1, 0]], "shipments": [{"pickup": 0, "delivery": 1}]}  # of `mjsim plan`
FAST = ("--objects", "2", "--fidelity", "event", "--no-regret")
ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def signals_as_in_a_terminal():
    """Under `nohup`, and in the background of a shell, tests would inherit that signals are ignored."""
    defaults = {signal.SIGINT: signal.default_int_handler, signal.SIGHUP: signal.SIG_DFL}
    before = {number: signal.signal(number, handler) for number, handler in defaults.items()}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.fixture
def mjsim(tmp_path):
    """Runs the command line in a process of its own, in the folder of the test."""

    def run(*words, timeout=240, **environment):
        path = os.pathsep.join([str(ROOT), *filter(None, [os.environ.get("PYTHONPATH")])])
        return subprocess.run(
            [sys.executable, "-m", "mjsim", *words],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": path, **environment},
            capture_output=True,
            text=True,
            timeout=timeout,
        )

    return run


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """Makes a module of a user's own importable, here and in commands that run in the folder of the test."""

    def write(text, name="own_code"):
        (tmp_path / f"{name}.py").write_text(text)
        monkeypatch.syspath_prepend(str(tmp_path))
        monkeypatch.delitem(sys.modules, name, raising=False)
        return name

    yield write
    sys.modules.pop("own_code", None)


def participant(fault, after=0):
    """A module with a participant that walks in circles; after so many control steps, a statement goes wrong."""
    return f"""
import os, signal, time
from mjsim.actions import Move
class Own:
    needs = frozenset()
    count = 0
    def act(self, percept):
        self.count += 1
        if self.count > {after}:
            {fault}
        return Move(forward=0.5, turn=0.3)
def build(house, rng):
    return Own()
"""


def one_line(text):
    """The only line that a command says on standard error; it is no traceback."""
    lines = text.strip().splitlines()
    assert len(lines) == 1, text
    assert lines[0].startswith("mjsim: "), text
    return lines[0]
