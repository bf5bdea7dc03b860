"""`mjsim bench malformed`: what it finds wrong, and that a hundred of its cases are not."""

import os
import time
from pathlib import Path

import pytest

from benchmarks import malformed
from benchmarks._command import benchmark
from benchmarks.support import warm_commands
from benchmarks.support.warm_commands import REFUSED, USED, Case, CaseFactory
from experiments.errors import ConfigError
from mjsim.files import WORK


def refuse(text="no"):
    raise ConfigError(text)


def write(name):
    Path(name).write_text("new")


@pytest.fixture
def attempt(tmp_path):
    (tmp_path / "there").write_text("old")
    return lambda case: CaseFactory(lambda _: None, lambda *_: case, tmp_path).attempt(0)


@pytest.mark.parametrize(
    ("call", "must", "fault"),
    [
        (refuse, REFUSED, ""),
        (refuse, "", ""),
        (lambda: None, "", ""),
        (lambda: None, REFUSED, "silent wrong"),
        (refuse, USED, "refused what is good"),
        (lambda: 1 / 0, "", "traceback (exit 70)"),
        (lambda: os.kill(os.getpid(), 9), "", "died of SIGKILL"),
        (lambda: print("x.py:3: RuntimeWarning: divide"), "", "traceback (exit 0)"),
        (lambda: write("there"), "", "lost there"),
        (lambda: Path("there").unlink(), "", "lost there"),
        (lambda: (write("new"), refuse()), "", "half-written new"),
        (lambda: write(f"{WORK}1"), "", f"half-written {WORK}1"),
        (lambda: time.sleep(60), "", "hang"),
        (lambda: [0 for _ in iter(int, 1)], "", "hang"),
        (lambda: print("mjsim: " + "long " * 1000) or refuse(), "", "refused at length"),
    ],
)
def test_what_is_wrong_is_found(call, must, fault, attempt, monkeypatch):
    monkeypatch.setattr(warm_commands, "CPU_LIMIT", 1)
    monkeypatch.setattr(warm_commands, "WALL_LIMIT", 3)
    assert attempt(Case("any", "kind", must=must, call=call)).fault == fault


def test_a_reason_is_asked_for(attempt):
    assert attempt(Case("any", "kind", call=refuse, message="whose")).fault == "refused without its reason"


@pytest.mark.slow
def test_a_hundred_hostile_cases_are_taken_as_they_should_be():
    result = malformed.measure(quick=True)
    assert result["cases"] == malformed.QUICK
    outcomes = list(benchmark("malformed").lines(result))[-len(malformed.REQUIREMENTS) :]
    assert all("pass" in line for line in outcomes), result["failures"]
