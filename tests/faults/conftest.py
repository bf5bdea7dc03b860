"""Commands as a user gives them."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.trials.trial_config import TrialConfig

BRIEF = TrialConfig(objects=2, assistance="optimal", seed=0, fidelity="event", regret=False)
PROBLEM = {"distances": [[0, 1], [1, 0]], "shipments": [{"pickup": 0, "delivery": 1}]}  # of `mjsim plan`
FAST = ("--objects", "2", "--fidelity", "event", "--no-regret")
ROOT = Path(__file__).parents[2]


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


def one_line(text):
    """The only line that a command says on standard error; it is no traceback."""
    said = [line for line in text.strip().splitlines() if "compiling numeric code" not in line]
    lines = [line for line in said if not line.startswith("trials: ")]  # progress, on a slow machine
    assert len(lines) == 1, text
    assert lines[0].startswith("mjsim: "), text
    return lines[0]
