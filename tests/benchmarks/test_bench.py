"""`mjsim bench` finds the benchmarks of a checkout."""

import json
import math
import os
from pathlib import Path
from types import SimpleNamespace

import pytest

from benchmarks import _command, growth, houses, play
from benchmarks._command import benchmark, benchmark_names
from benchmarks.support import home_figures, home_trials, play_load
from benchmarks.support.play_browser import SeenFrame, SimulatedBrowser
from benchmarks.support.play_load import median_width
from experiments.cli.main import main
from experiments.errors import ConfigError
from experiments.trials.table import read_rows


def test_the_benchmarks_of_the_checkout_are_found():
    assert "render" in benchmark_names()
    for name in benchmark_names():
        assert benchmark(name).__doc__


def test_an_unknown_benchmark_is_refused_with_the_choices(capsys):
    assert main(["bench", "speed"]) == 2
    assert "no benchmark 'speed'; there are" in capsys.readouterr().err


def test_a_module_that_measures_nothing_is_refused(tmp_path):
    (tmp_path / "empty.py").write_text("x = 1\n", encoding="utf-8")
    (tmp_path / "good.py").write_text(
        "def measure(): return {'n': 1}\ndef lines(result): yield str(result['n'])\n", encoding="utf-8"
    )
    assert benchmark_names(tmp_path) == ("empty", "good")
    assert list(benchmark("good", tmp_path).lines({"n": 1})) == ["1"]
    with pytest.raises(ConfigError, match=r"empty\.py is not a benchmark"):
        benchmark("empty", tmp_path)


@pytest.mark.parametrize("load", [0.1, 3.0])
def test_on_a_busy_machine_a_line_says_that_wall_times_are_too_low(monkeypatch, capsys, load):
    empty = SimpleNamespace(measure=dict, lines=lambda _: ["done"])
    monkeypatch.setattr(_command, "benchmark", lambda _: empty)
    monkeypatch.setattr(os, "getloadavg", lambda: (load * (os.cpu_count() or 1), 0.0, 0.0))
    assert main(["bench", "empty"]) == 0
    printed = capsys.readouterr()
    assert printed.out == "done\n"
    assert ("3.0 processes per core were running" in printed.err) == (load == 3.0)


def test_a_session_without_a_frame_has_a_width_of_nothing():
    blind, seeing = SimulatedBrowser("/"), SimulatedBrowser("/")
    seeing.frames.append(SeenFrame(0.0, 0, 320))
    assert (median_width([blind]), median_width([seeing])) == (0.0, 320.0)


class NoServer:
    """Stands for a server whose sessions show nothing."""

    process = SimpleNamespace(pid=os.getpid())

    def __init__(self, *_):
        pass

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def begin(self):
        return "/"

    def journal(self, *_):
        return Path()


def test_latencies_where_no_frame_comes_are_infinite_and_fail(monkeypatch):
    async def at_once(*_):
        return True

    for name in ("open", "run", "until", "taken", "close"):
        monkeypatch.setattr(SimulatedBrowser, name, at_once)
    monkeypatch.setattr(SimulatedBrowser, "press", lambda *_, **__: None)
    monkeypatch.setattr(play_load, "PlayProcess", NoServer)
    monkeypatch.setattr(play_load, "worker_of", lambda _: os.getpid())
    monkeypatch.setattr(play_load, "SETTLING", 0.0)
    monkeypatch.setattr(play, "QUICK_SECONDS", 0.0)
    result = play.measure(parts=["latency"], quick=True)
    assert (result["latency"]["jpeg_p95_ms"], result["latency"]["jpeg_fps"]) == (math.inf, 0.0)
    said = [line for line in play.lines(result) if "FAIL" in line]
    assert len(said) == 3


@pytest.mark.slow
def test_a_generated_home_is_measured_without_a_fault():
    row = home_figures.figures((1, 50_000))
    assert not [key for key in houses.FAULTS if row.get(key)]
    assert row["kinds"]["toilet"] == 1
    assert all(figure([row]) >= 0 for figure, *_ in houses.REQUIREMENTS.values())
    assert houses.COLUMNS["overlap"]([row, row]) == 1.0


@pytest.mark.slow
@pytest.mark.long
def test_grown_records_are_the_trials_of_their_design(tmp_path, capsys):
    """A batch of them has nothing left to run, and their people all have a row."""
    assert main(["bench", "growth", "--quick", "--count", "40", "--out", str(tmp_path), "--json"]) == 0
    result = json.loads(capsys.readouterr().out)
    assert {name: found["records"] for name, found in result.items()} == {
        "resume": 40, "analyze": 40, "collect": 40,
    }  # fmt: skip
    assert not (tmp_path / "batch" / "outdated").exists()
    rows = read_rows(tmp_path / "batch" / "trials.parquet")
    assert len({(row["assistance"], row["house_seed"]) for row in rows}) == 40
    real = read_rows(tmp_path / "real" / "trials.parquet")
    assert {row["task_distance_m"] for row in rows} == {row["task_distance_m"] for row in real}
    with pytest.raises(ConfigError, match="there are resume, analyze, collect"):
        growth.measure(parts=("speed",))


def test_trials_in_homes_fail_with_two_lost_grips_an_object_left_or_a_deep_penetration():
    good = {"home": "generated:1", "person": "tall", "finished": True, "time_s": 90.0, "lost": 1}
    good |= {"penetration_mm": 4.0}
    assert not [line for line in home_trials.trial_lines([good]) if "FAIL" in line]
    for worse in ({"finished": False}, {"lost": 2}, {"penetration_mm": 10.1}):
        said = list(home_trials.trial_lines([good, good | worse]))
        assert sum("FAIL" in line for line in said) == 1 and "generated:1, tall" in said[1]


def test_unknown_parts_of_the_homes_benchmark_are_named():
    with pytest.raises(ConfigError, match="no parts walks; there are figures, trials"):
        houses.measure(parts=["walks"])


@pytest.mark.slow
def test_two_people_tidy_a_generated_home():
    rows = home_trials.trials((3, 940_100))
    assert [(row["person"], row["finished"]) for row in rows] == [("short", True), ("tall", True)]
    assert all(row["lost"] <= 1 and 0.0 < row["penetration_mm"] < 10.0 for row in rows)
