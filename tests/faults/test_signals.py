"""Signals in the middle of a run and of a batch: the record is kept, says how it ended, and replays."""

import asyncio
import os
import signal
import subprocess
import sys
import threading
import time
import weakref

import pytest
from user_code import participant

from experiments.cli.main import main
from experiments.record import records
from experiments.record.files import read_json
from experiments.record.records import read_events
from experiments.record.writer import RecordWriter
from experiments.session.signals import Stopped, run_until_signal, signals_postponed, signals_raised
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from faults.conftest import BRIEF, FAST, ROOT, one_line
from mjsim.support.files import WORK

RUN = ("run", *FAST, "--no-video", "--no-floor-plan", "--assistance", "none", "--user", "own_code:build")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seconds"), [("SIGINT", 0), ("SIGTERM", 0), ("SIGHUP", 0), ("SIGTERM", 30)], ids=str
)
def test_a_run_that_is_stopped_is_kept(name, seconds, house, tmp_path, mjsim, own_module):
    """Also where the participant hangs, and so never comes to an end by itself."""
    own_module(
        participant(f"if self.count == 50: os.kill(os.getpid(), signal.{name}); time.sleep({seconds})")
    )
    done = mjsim(*RUN, "--out", "out")
    assert done.returncode == 128 + signal.Signals[name]
    assert "Traceback" not in done.stderr
    out = tmp_path / "out"
    metrics, end = read_json(out / records.METRICS), read_events(out / records.EVENTS)[-1]
    assert (metrics["ended"], metrics["signal"]) == (end["reason"], end["signal"]) == ("interrupted", name)
    assert metrics["simulated_s"] == pytest.approx(49 * 0.04, abs=0.05)
    assert replay(out, house=house).ended == "interrupted"
    assert {path.name for path in tmp_path.iterdir()} - {"__pycache__"} == {"out", "own_code.py"}


def test_signals_are_no_exceptions_while_a_record_is_saved():
    with signals_postponed() as signals:
        signals.save()
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.01)
        assert signals.number == signal.SIGTERM
    with pytest.raises(Stopped), signals_raised():
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(1)


def test_a_signal_is_not_lost_where_python_ignores_exceptions(capsys):
    class Value:
        pass

    value, before = Value(), sys.unraisablehook
    watched = weakref.ref(value, lambda _: os.kill(os.getpid(), signal.SIGINT))
    with pytest.raises(Stopped), signals_raised():
        del value
        assert watched() is None  # the exception of the first signal was ignored
        time.sleep(5)
    assert sys.unraisablehook is before
    assert "Traceback" not in capsys.readouterr().err


def test_other_ignored_exceptions_are_still_reported(monkeypatch):
    reported = []
    monkeypatch.setattr(sys, "unraisablehook", reported.append)
    with signals_raised():
        value = threading.Event()
        watched = weakref.ref(value, lambda _: 1 / 0)
        del value
        assert watched() is None
    assert [hook.exc_type for hook in reported] == [ZeroDivisionError]


def test_who_does_not_look_is_interrupted_after_a_while(monkeypatch):
    monkeypatch.setattr("experiments.session.signals.CHECK_TIMEOUT_S", 0.2)
    with pytest.raises(Stopped), signals_postponed():
        os.kill(os.getpid(), signal.SIGHUP)
        time.sleep(10)


@pytest.fixture(scope="module")
def walked(house, tmp_path_factory):
    out = tmp_path_factory.mktemp("walked") / "run"
    run_trial(BRIEF, out, topdown=False, house=house)
    return out


@pytest.mark.parametrize(
    "seconds", [0.6, *(pytest.param(later, marks=pytest.mark.slow) for later in (1.1, 1.6))]
)
def test_a_replay_that_films_names_the_signal_that_stops_it(seconds, walked, tmp_path, capsys):
    stop = threading.Timer(seconds, os.kill, (os.getpid(), signal.SIGTERM))
    stop.start()
    code = main(["replay", str(walked), "--video", str(tmp_path / "film.mp4"), "--size", "1280x960"])
    assert code == 128 + signal.SIGTERM
    assert "stopped by SIGTERM" in one_line(capsys.readouterr().err)
    assert not list(tmp_path.iterdir())


def test_a_signal_that_comes_while_compiled_code_returns_is_named(monkeypatch, capsys):
    """The interpreter raises this then."""

    def interrupted(*_, **__):
        raise SystemError("returned a result with an exception set") from Stopped(signal.SIGTERM)

    monkeypatch.setattr("experiments.cli.main._run", interrupted)
    assert main(["doctor"]) == 128 + signal.SIGTERM
    assert "stopped by SIGTERM" in one_line(capsys.readouterr().err)


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGHUP])
def test_a_signal_cancels_a_coroutine_which_cleans_up_and_is_then_raised(number):
    steps = []

    async def work():
        try:
            os.kill(os.getpid(), number)
            await asyncio.sleep(30.0)
        finally:
            os.kill(os.getpid(), signal.SIGTERM)  # a second signal does not interrupt the cleanup
            await asyncio.sleep(0.01)
            steps.append("cleaned up")

    before = signal.getsignal(number)
    with pytest.raises(Stopped) as stopped:
        run_until_signal(work())
    assert str(stopped.value) == str(Stopped(number))
    assert steps == ["cleaned up"]
    assert signal.getsignal(number) is before


def test_a_coroutine_without_a_signal_returns_its_result_or_raises_its_own_error():
    async def result(value):
        return value

    async def cancelled():
        raise asyncio.CancelledError

    assert run_until_signal(result(7)) == 7
    with pytest.raises(asyncio.CancelledError):
        run_until_signal(cancelled())


def test_an_ignored_signal_stays_ignored():
    """As SIGHUP is after `nohup`."""
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with signals_raised(), signals_postponed() as signals:
            os.kill(os.getpid(), signal.SIGHUP)
            time.sleep(0.01)
        assert signals.number is None
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_batch_that_is_stopped_writes_its_tables(number, tmp_path):
    words = ["batch", *FAST, "--assistance", "optimal", "--seeds", "0:200", "--workers", "1", "--out", "out"]
    process = subprocess.Popen(
        [sys.executable, "-m", "mjsim", *words],
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    trials = tmp_path / "out" / "trials"
    deadline = time.monotonic() + 200
    while len(list(trials.glob(f"[!.]*/{records.METRICS}"))) < 2 and time.monotonic() < deadline:
        time.sleep(0.02)
    os.killpg(process.pid, number)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    assert number.name in one_line(said)
    done = [path.name for path in trials.iterdir() if not path.name.startswith(WORK)]
    assert not [name for name in done if name.startswith(".")]
    assert len((tmp_path / "out" / "trials.csv").read_text().splitlines()) == len(done) + 1 < 200


@pytest.mark.slow
def test_a_worker_that_is_killed_is_one_line_for_each_trial(tmp_path, mjsim, own_module):
    own_module(participant("os.kill(os.getpid(), signal.SIGKILL)"))
    words = ("--assistance", "none", "--user", "own_code:build", "--workers", "1", "--seeds", "0:2")
    done = mjsim("batch", *FAST, *words, "--out", "out")
    assert done.returncode == 1
    assert "Traceback" not in done.stderr and done.stderr.count("its process died") == 2
    assert all(path.name.startswith((WORK, ".apart")) for path in (tmp_path / "out" / "trials").iterdir())


def test_a_signal_in_the_very_first_step_leaves_one_state(house, tmp_path, monkeypatch):
    """Where a step takes so long that the signal cannot wait, it comes before the step is recorded."""
    monkeypatch.setattr(RecordWriter, "append", stopped_once(RecordWriter.append))
    assert run_trial(BRIEF, tmp_path / "out", topdown=False, house=house)["ended"] == "interrupted"
    assert replay(tmp_path / "out", house=house).steps == 1


def stopped_once(function):
    calls = []

    def stopped(*args):
        calls.append(args)
        if len(calls) == 1:
            raise Stopped(signal.SIGTERM)
        return function(*args)

    return stopped
