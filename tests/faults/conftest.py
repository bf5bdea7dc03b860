"""Commands as a user gives them, and a user's own code."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from experiments.house import House

FAST = ("--objects", "2", "--fidelity", "event", "--no-regret")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="session")
def house():
    return House.load()


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


def one_line(text):
    """The only line that a command says on standard error; it is no traceback."""
    lines = text.strip().splitlines()
    assert len(lines) == 1, text
    assert lines[0].startswith("mjsim: "), text
    return lines[0]
