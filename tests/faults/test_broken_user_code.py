"""Participants and conditions of a user's own that fail: what was simulated is kept, and one line names the culprit."""

import re
import sys
from pathlib import Path

import pytest
from msgspec import structs
from user_code import condition, participant

from experiments.cli.main import main
from experiments.errors import ConfigError, UserCodeError
from experiments.record import records
from experiments.record.files import read_json
from experiments.record.records import read_events
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from faults.conftest import BRIEF, FAST, one_line


def run(house, out, **settings):
    run_trial(structs.replace(BRIEF, **settings), out, topdown=False, house=house)


def check_kept(house, out, fault):
    """The run directory says how the run ended, and replays."""
    metrics, end = read_json(out / records.METRICS), read_events(out / records.EVENTS)[-1]
    assert metrics["ended"] == end["reason"] == "error"
    assert fault in metrics["error"] and fault in end["error"]
    sys.modules.pop("own_code")  # as in a new process
    assert replay(out, house=house).ended == "error"


FAULTS = [
    ("1 / 0", "raised ZeroDivisionError: division by zero"),
    ("raise KeyError('x')", "raised KeyError"),
    ("raise SystemExit(3)", "raised SystemExit"),
    ("os._exit(0)", "raised SystemExit"),
    ("return None", "answered None"),
    ("return 'left'", "answered 'left'"),
    ("raise type('Odd', (BaseException,), {})()", "raised Odd"),
    ("raise type('Mute', (Exception,), {'__str__': None})()", "raised Mute"),
    ("return type('Mute', (), {'__repr__': None})()", "answered a Mute"),
    ("return Move(forward=float('nan'))", "raised Move.forward must be a finite number"),
    ("return Pick(object=5)", "raised the name of an object must be printable text"),
    ("return Pick(object='a\\ud800')", "raised the name of an object must be printable text"),
    ("return FollowPath([[0, 0], [0, float('nan')]], (0, 0), 0.1)", "must be finite numbers"),
    ("return FollowPath([[0, 0]], None, 0.1)", "raised the goal of a path must have the shape"),
    ("return Wait(until=float('nan'))", "raised Wait.until must be a time or None"),
]


@pytest.mark.parametrize(
    ("after", "fault", "said"),
    [(1, *case) for case in FAULTS] + [(after, *case) for after in (0, 40) for case in FAULTS[::4]],
)
def test_a_participant_that_fails(after, fault, said, house, tmp_path, own_module):
    own_module(participant(fault, after))
    with pytest.raises(UserCodeError, match=said) as failure:
        run(house, tmp_path / "out", assistance="none", user="own_code:build")
    assert f"kept for `mjsim replay {tmp_path / 'out'}`" in str(failure.value)
    assert f"own_code.py, line {7 if 'answered' in said else 10})" in str(failure.value)
    check_kept(house, tmp_path / "out", said)


@pytest.mark.parametrize(
    ("fault", "said"),
    [
        ("1 / 0", "raised ZeroDivision"),
        ("raise SystemExit(0)", "raised SystemExit"),
        ("return None", "returned None; it must return a HudState"),
        ("return replace(state, markers=None)", "Expected `array`, got `null` - at `$.markers`"),
        ("return replace(state, message=b'hi')", "got `bytes` - at `$.message`"),
        ("return replace(state, checklist_title='\\ud800')", "at `$.checklist_title`"),
        ("return replace(state, clock=float('nan'))", "nan is not a usable number - at `$.clock`"),
        ("return replace(state, message=Message(b'hi', MessageKind.INFO))", "at `$.message.text`"),
        ("return replace(state, markers=[Marker('cone', (0, 0, 0), (1, 1, 1), (1, 1, 1, 1), '')])", "cone"),
        (
            "return replace(state, markers=[Marker('box', (0, 0, 1e309), (1, 1, 1), (1, 1, 1, 1), '')])",
            "inf is not a usable number - at `$.markers[0].position[2]`",
        ),
    ],
)
def test_a_condition_that_fails_ends_the_run_though_nobody_looks(fault, said, house, tmp_path, own_module):
    own_module(condition(fault, 5))
    own_module(participant("pass"), name="own_person")
    with pytest.raises(UserCodeError, match=re.escape(said)) as failure:
        run(house, tmp_path / "out", assistance="own_code:hud_state", user="own_person:build")
    assert "own_code.py, line" in str(failure.value)
    check_kept(house, tmp_path / "out", said)


def test_numbers_and_lists_of_numpy_can_be_shown(house, tmp_path, own_module):
    marker = "Marker('box', np.zeros(3), [np.float32(1)] * 3, (1, 1, 1, 1), 'mine')"
    own_module(condition(f"return replace(state, markers=[{marker}])", 0))
    run(house, tmp_path / "out", assistance="own_code:hud_state", user="searcher", time_limit=2.0)


@pytest.mark.parametrize("hang", ["time.sleep(600)", "[0 for _ in iter(int, 1)]"])
def test_a_call_that_takes_too_long_is_interrupted_and_says_where(
    hang, house, tmp_path, own_module, monkeypatch
):
    monkeypatch.setenv("MJSIM_CALL_LIMIT", "0.5")
    own_module(participant(f"try: {hang}\n            except Exception: pass", after=3))
    with pytest.raises(UserCodeError, match=r"did not answer within 0.5 s; .*own_code.py, line 10"):
        run(house, tmp_path / "out", assistance="none", user="own_code:build")
    check_kept(house, tmp_path / "out", "did not answer")


def test_a_time_limit_of_calls_that_is_no_number_is_named(house, tmp_path, own_module, monkeypatch):
    monkeypatch.setenv("MJSIM_CALL_LIMIT", "short")
    own_module(participant("pass"))
    with pytest.raises(ConfigError, match="MJSIM_CALL_LIMIT is 'short'; give a number of seconds"):
        run(house, tmp_path / "out", assistance="none", user="own_code:build")


def test_the_folder_in_which_a_command_runs_is_its_own(tmp_path, own_module, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    own_module(participant("os.chdir('/')", after=3))
    words = ["--no-video", "--assistance", "none", "--user", "own_code:build", "--time-limit", "1"]
    assert main(["run", *FAST, *words, "--out", "out"]) == 0
    assert "topdown.png" in capsys.readouterr().err


@pytest.mark.parametrize("name", ["assistance", "user", "house", "planner", "fidelity", "phases"])
def test_names_are_text(name):
    with pytest.raises(ConfigError, match=f"{name} must be text, got 5"):
        TrialConfig(**{"objects": 2, "assistance": "none", "seed": 0, name: 5})


def test_a_condition_that_never_works_leaves_a_record_too(house, tmp_path, own_module):
    own_module(condition("1 / 0", 0))
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
