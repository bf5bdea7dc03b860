"""Hostile inputs of all commands: no traceback, nothing wrong in silence, nothing lost, nothing that hangs.

`MJSIM_FAULTS=10000` tries 10,000 cases instead of 100; `MJSIM_CASE=4711` runs the case of that number again.
"""

import os
import time
from pathlib import Path

import pytest
from hostile import warm_commands
from hostile.cases import case_factory
from hostile.warm_commands import REFUSED, UNSTABLE, USED, Case, CaseFactory, run_cases

from experiments.errors import ConfigError
from mjsim.support.files import WORK


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
        (lambda: refuse(f"no longer trustworthy; {UNSTABLE}"), "", "accepted, but its physics failed"),
        (lambda: print("x.py:3: RuntimeWarning: divide"), "", "traceback (exit 0)"),
        (lambda: write("there"), "", "lost there"),
        (lambda: Path("there").unlink(), "", "lost there"),
        (lambda: (write("new"), refuse()), "", "half-written new"),
        (lambda: write(f"{WORK}1"), "", f"half-written {WORK}1"),
        (lambda: [0 for _ in iter(int, 1)], "", "hang"),
        (lambda: print("mjsim: " + "long " * 1000) or refuse(), "", "refused at length"),
    ],
)
def test_what_is_wrong_is_found(call, must, fault, attempt, monkeypatch):
    monkeypatch.setattr(warm_commands, "CPU_LIMIT", 1)
    monkeypatch.setattr(warm_commands, "WALL_LIMIT", 3)
    assert attempt(Case("any", "kind", must=must, call=call)).fault == fault


def test_who_sleeps_hangs(attempt, monkeypatch):
    monkeypatch.setattr(warm_commands, "WALL_LIMIT", 0.5)
    assert attempt(Case("any", "kind", call=lambda: time.sleep(60))).fault == "hang"


def test_a_reason_is_asked_for(attempt):
    assert attempt(Case("any", "kind", call=refuse, message="whose")).fault == "refused without its reason"


def numbers():
    """Numbers of the cases to run."""
    if "MJSIM_CASE" in os.environ:
        return [int(os.environ["MJSIM_CASE"])]
    return range(int(os.environ.get("MJSIM_FAULTS", "100")))


@pytest.mark.slow
@pytest.mark.long
def test_hostile_cases_are_used_or_refused_as_they_should_be():
    outcomes = list(run_cases(case_factory, numbers(), os.cpu_count() or 1))
    assert len(outcomes) == len(numbers())
    assert not [outcome for outcome in outcomes if outcome.fault]
