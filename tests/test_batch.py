"""Batches: the whole design, in parallel, surviving a kill."""

import os
import signal
import subprocess
import sys
import time

import pyarrow.parquet as pq
import pytest

from experiments.errors import ConfigError
from experiments.runs.records import METRICS
from experiments.trials.batch import run_batch
from experiments.trials.design import Design, factorial

COMMAND = [
    sys.executable,
    "-m",
    "experiments.cli",
    "batch",
    "--objects",
    "6",
    "--assistance",
    "optimal,highlight",
]


def finished(out):
    return sorted(out.glob(f"trials/[!.]*/{METRICS}"))


def test_a_killed_batch_goes_on_where_it_stopped(tmp_path):
    arguments = [*COMMAND, "--seeds", "0:2", "--workers", "1", "--out", str(tmp_path)]
    process = subprocess.Popen(arguments, stderr=subprocess.DEVNULL, start_new_session=True)
    deadline = time.monotonic() + 120
    while not finished(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    before = {path: path.stat().st_mtime_ns for path in finished(tmp_path)}
    assert 1 <= len(before) < 4

    arguments[arguments.index("1")] = "9" * 25  # workers; never more than trials
    done = subprocess.run(arguments, check=True, capture_output=True, text=True, timeout=240)
    assert "4 trials" in done.stderr
    assert {path: path.stat().st_mtime_ns for path in before} == before
    table = pq.read_table(tmp_path / "trials.parquet").to_pydict()
    assert list(zip(table["assistance"], table["house_seed"], strict=True)) == [
        ("optimal", 0),
        ("optimal", 1),
        ("highlight", 0),
        ("highlight", 1),
    ]
    assert table["delivered"] == [6] * 4
    assert table["regretful_visits"][:2] == [0, 0]  # followers
    assert all(metres > 0 for metres in table["total_regret_m"][2:])
    assert len((tmp_path / "trials.csv").read_text().splitlines()) == 5


FAILS_WITHOUT_GUIDANCE = """
from experiments.participants.nearest import Nearest


class Fails(Nearest):
    needs = frozenset()

    def act(self, percept):
        if not percept.shown_roles:
            raise ValueError("nothing to go for")
        return super().act(percept)


def build(house, rng):
    return Fails(house)
"""


def test_one_failing_trial_does_not_stop_the_others(tmp_path, monkeypatch):
    (tmp_path / "fails_without_guidance.py").write_text(FAILS_WITHOUT_GUIDANCE)
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([str(tmp_path), *sys.path]))
    reports, users = [], ["fails_without_guidance:build"]
    design = factorial(objects=[6], assistance=["none"], users=users, seeds=[0])
    shown = factorial(objects=[6], assistance=["highlight"], users=users, seeds=[0])
    out = tmp_path / "out"
    rows = run_batch(Design(design.trials + shown.trials), out, workers=1, on_progress=reports.append)
    assert [row["assistance"] for row in rows] == ["highlight"]
    assert (reports[-1].done, reports[-1].failed) == (1, 1)
    assert any("nothing to go for" in (r.failure or "") for r in reports)


@pytest.mark.parametrize(
    ("design", "fault"),
    [
        ({"seeds": []}, "at least one value for --seeds"),
        ({"objects": [6, 6]}, "--objects names a value twice"),
        ({"assistance": []}, "at least one value for --assistance"),
    ],
)
def test_a_design_that_makes_no_sense_is_refused(design, fault):
    with pytest.raises(ConfigError, match=fault):
        factorial(**{"objects": [6], "assistance": ["none"], "users": ["follower"], "seeds": [0], **design})


def test_a_batch_needs_a_worker(tmp_path):
    with pytest.raises(ConfigError, match="at least one worker, got 0"):
        run_batch(
            factorial(objects=[6], assistance=["none"], users=["follower"], seeds=[0]), tmp_path, workers=0
        )
