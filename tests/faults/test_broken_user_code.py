"""Participants and conditions of a user's own that fail: what was simulated is kept, and one line names the culprit."""

import sys
from pathlib import Path

import pytest
from msgspec import structs
from user_code import participant

from experiments.cli.main import main
from experiments.errors import UserCodeError
from experiments.record import records
from experiments.record.files import read_json
from experiments.record.records import read_events
from experiments.replay.replay import replay
from experiments.trials.trial import run_trial
from faults.conftest import BRIEF, FAST, one_line

CONDITION = """
from hud.conditions.none import hud_state as shown
count = 0
def hud_state(view):
    global count
    count += 1
    if count > {after}:
        {fault}
    return shown(view)
"""


def run(house, out, **settings):
    run_trial(structs.replace(BRIEF, **settings), out, topdown=False, house=house)


def check_kept(house, out, fault):
    """The run directory says how the run ended, and replays."""
    metrics, end = read_json(out / records.METRICS), read_events(out / records.EVENTS)[-1]
    assert metrics["ended"] == end["reason"] == "error"
    assert fault in metrics["error"] and fault in end["error"]
    sys.modules.pop("own_code")  # as in a new process
    assert replay(out, house=house).ended == "error"


@pytest.mark.parametrize("after", [0, 1, 40])
@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("1 / 0", "raised ZeroDivisionError: division by zero"),
        ("raise KeyError('x')", "raised KeyError"),
        ("raise SystemExit(3)", "raised SystemExit"),
        ("return None", "answered None"),
        ("return 'left'", "answered 'left'"),
    ],
)
def test_a_participant_that_fails(after, fault, said, house, tmp_path, own_module):
    own_module(participant(fault, after))
    with pytest.raises(UserCodeError, match=said) as failure:
        run(house, tmp_path / "out", assistance="none", user="own_code:build")
    assert f"kept for `mjsim replay {tmp_path / 'out'}`" in str(failure.value)
    assert ("own_code.py, line 10)" in str(failure.value)) is ("raised" in said)
    check_kept(house, tmp_path / "out", said)


@pytest.mark.parametrize(
    ("fault", "said"), [("1 / 0", "raised ZeroDivision"), ("return None", "returned None")]
)
def test_a_condition_that_fails_while_the_participant_looks(fault, said, house, tmp_path, own_module):
    own_module(CONDITION.format(after=5, fault=fault))
    own_module(participant("percept.hud()"), name="own_person")
    with pytest.raises(UserCodeError, match=said):
        run(house, tmp_path / "out", assistance="own_code:hud_state", user="own_person:build")
    check_kept(house, tmp_path / "out", said)


def test_a_condition_that_never_works_leaves_a_record_too(house, tmp_path, own_module):
    own_module(CONDITION.format(after=0, fault="1 / 0"))
    with pytest.raises(UserCodeError, match="ZeroDivisionError"):
        run(house, tmp_path / "out", assistance="own_code:hud_state", user="searcher")
    assert read_json(tmp_path / "out" / records.METRICS)["ended"] == "error"


@pytest.mark.parametrize(
    "text", ["def build(house, rng):\n    1 / 0\n", "def build(house, rng):\n    return None\n"]
)
def test_a_participant_that_cannot_be_made(text, house, tmp_path, own_module):
    own_module(text)
    with pytest.raises(UserCodeError, match="own_code:build"):
        run(house, tmp_path / "out", assistance="none", user="own_code:build")
    assert not (tmp_path / "out").exists()


def test_one_line_and_the_traceback_in_a_report(tmp_path, own_module, capsys, monkeypatch):
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    own_module(participant("1 / 0", after=3))
    words = ["--no-video", "--no-floor-plan", "--assistance", "none", "--user", "own_code:build"]
    assert main(["run", *FAST, *words, "--out", str(tmp_path / "out")]) == 1
    line = one_line(capsys.readouterr().err)
    report = Path(line.rpartition(" ")[2]).read_text()
    assert "ZeroDivisionError" in report and "own_code.py" in report


@pytest.mark.parametrize(
    ("needs", "said"),
    [("", "EOFError"), ("needs = 'flagpole'", "needs 'flagpole'; it must be a set of marker roles")],
)
def test_needs_are_a_set_of_roles_or_not_said(needs, said, house, tmp_path, own_module):
    """Without any, it acts until it fails."""
    own_module(participant("raise EOFError", after=5).replace("needs = frozenset()", needs))
    with pytest.raises(UserCodeError, match=said):
        run(house, tmp_path / "run", assistance="none", user="own_code:build")
