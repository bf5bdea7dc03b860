"""Runs and batches that are killed at seeded moments and repeated: their files are those of undisturbed ones."""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pyarrow.csv
import pytest

from experiments.cli.main import main
from experiments.record import records, run_directory
from experiments.record.files import CHECKSUMS
from experiments.trials import trial
from experiments.trials.replay.replay import replay
from experiments.trials.trial import run_trial
from experiments.trials.trial_reader import ROWS
from faults.conftest import BRIEF
from mjsim.support.files import remove_leftovers

CASES = int(os.environ.get("MJSIM_KILL_CASES", "1"))  # for each command, of four kills each
FAST = ("--objects", "6", "--fidelity", "event", "--no-regret")
BATCH = ("batch", *FAST, "--assistance", "none,optimal", "--seeds", "0:2", "--workers", "2")
PACKED = "--packed"
COMMANDS = {"run": ("run", *FAST, "--no-video"), "batch": BATCH, "packed": (*BATCH, PACKED)}
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
TICKS = os.sysconf("SC_CLK_TCK")


def start(words, out):
    """A command in a process group of its own; its messages are in `out` with the suffix `.txt`."""
    with out.with_suffix(".txt").open("wb") as messages:
        return subprocess.Popen(
            [sys.executable, "-m", "mjsim", *words, "--out", str(out)],
            stdout=subprocess.DEVNULL,
            stderr=messages,
            env={**os.environ, "TMPDIR": str(out.parent)},
            start_new_session=True,
        )


def group_time(group):
    """Processor time of the living processes of a group, s."""
    ticks = 0
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[2]) == group and fields[0] != "Z":
            ticks += int(fields[11]) + int(fields[12]) + 1  # one more, as a new process has used none
    return ticks / TICKS


def kill(process, number, moment, *, group):
    """Send a signal after some processor time, s, which means the same on a busy machine; the exit code."""
    while process.poll() is None and group_time(process.pid) < moment:
        time.sleep(0.005)
    if process.poll() is None:
        (os.killpg if group else os.kill)(process.pid, number)
    code = process.wait(600)
    while group_time(process.pid) > 0:  # workers follow their parent
        time.sleep(0.005)
    return code


def content(path):
    """The part of a file that must not differ: all but wall times and checksums of files that hold them."""
    if path.name == records.METRICS:
        return {name: value for name, value in json.loads(path.read_text()).items() if name != "wall_s"}
    if path.name == CHECKSUMS:
        return [line for line in path.read_text().splitlines() if records.METRICS not in line]
    if path.suffix == ".csv":
        return pyarrow.csv.read_csv(path).drop_columns(["wall_s"]).to_pylist()
    return None if path.suffix == ".parquet" else path.read_bytes()  # a Parquet table has the rows of the CSV


def contents(folder):
    return {
        path.relative_to(folder).as_posix(): content(path)
        for path in folder.rglob("*")
        if path.is_file() and path.name != ROWS
    }


@pytest.fixture(
    scope="module",
    params=["run", *(pytest.param(name, marks=pytest.mark.long) for name in ("batch", "packed"))],
)
def undisturbed(request, tmp_path_factory):
    """A command, the folder that it writes (without packing), and its processor time, s."""
    folder = tmp_path_factory.mktemp("undisturbed")
    for name in ("first", "out"):  # the first one may compile kernels
        before = os.times()
        assert start([w for w in COMMANDS[request.param] if w != PACKED], folder / name).wait(600) == 0
    return request.param, folder / "out", sum(os.times()[2:4]) - sum(before[2:4])  # of children


@pytest.mark.slow
@pytest.mark.parametrize("case", range(CASES))
def test_killed_commands_end_up_with_the_files_of_undisturbed_ones(undisturbed, case, tmp_path):
    name, expected, spent = undisturbed
    rng, out, code = np.random.default_rng([20, case]), tmp_path / name, None

    def again():
        return start([*COMMANDS[name], *(["--force"] if name == "run" and out.exists() else [])], out)

    for _ in range(4):
        moment, group = float(rng.uniform(0.1, 1.0)) * spent, bool(rng.random() < 0.5)
        code = kill(again(), SIGNALS[rng.integers(3)], moment, group=group)
        messages = out.with_suffix(".txt").read_text()
        assert "Traceback" not in messages and "internal error" not in messages, (moment, group, messages)
        if name == "run" and out.exists():
            replay(out)
    assert code == 0 or again().wait(600) == 0
    for folder in filter(Path.is_dir, (tmp_path, out, out / "trials")):
        remove_leftovers(folder, max_age=0)
    if name == "packed":
        assert not [path for path in (out / "trials").iterdir() if path.is_dir()]
        assert main(["unpack", str(out)]) == 0
    assert contents(out) == contents(expected)
    assert {path.name for path in tmp_path.iterdir()} == {name, f"{name}.txt"}
    assert not [path for path in out.rglob(".*") if path.name != ROWS]


@pytest.mark.slow
@pytest.mark.parametrize("after", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("step", ["link_or_copy", "write_checksums", "exchange"])
def test_a_run_killed_at_its_floor_plan_has_it_whole_or_not_at_all(step, after, house, tmp_path, monkeypatch):
    """At each step by which the picture comes to the record; what draws it is not needed for that."""
    monkeypatch.setattr(trial, "draw_topdown", lambda path, *_: path.write_bytes(b"picture"))
    monkeypatch.setattr(run_directory, step, killed(getattr(run_directory, step), after=after))
    child = os.fork()
    if child == 0:
        try:
            run_trial(BRIEF, tmp_path / "out", house=house)
        finally:
            os._exit(1)
    _, status = os.waitpid(child, 0)
    assert os.WTERMSIG(status) == signal.SIGKILL
    assert replay(tmp_path / "out", house=house).ended == "all delivered"
    assert (tmp_path / "out" / records.TOPDOWN).exists() == (after and step == "exchange")
    remove_leftovers(tmp_path, max_age=0)
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


def killed(function, *, after):
    """The function, killed before or after it does its work."""

    def call(*args):
        if after:
            function(*args)
        os.kill(os.getpid(), signal.SIGKILL)

    return call
