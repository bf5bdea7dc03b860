"""Benchmarks are found in a checkout, and said to be there alone; the render benchmark reports what it should."""

import time
from pathlib import Path

import pytest

from experiments.cli import main
from experiments.commands.bench import benchmark, benchmark_names
from experiments.errors import ConfigError
from experiments.trials.trial_config import TrialConfig


def test_the_benchmarks_of_the_checkout_are_found() -> None:
    assert "render" in benchmark_names()
    for name in benchmark_names():
        assert benchmark(name).__doc__


def test_an_installed_package_says_where_benchmarks_live(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="source checkout"):
        benchmark("render", tmp_path / "benchmarks")


def test_an_unknown_benchmark_is_refused_with_the_choices(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["bench", "speed"]) == 2
    assert "no benchmark 'speed'; there are" in capsys.readouterr().err


def test_a_module_that_measures_nothing_is_refused(tmp_path: Path) -> None:
    (tmp_path / "empty.py").write_text("x = 1\n", encoding="utf-8")
    (tmp_path / "good.py").write_text(
        "def measure(): return {'n': 1}\ndef lines(result): yield str(result['n'])\n", encoding="utf-8"
    )
    assert benchmark_names(tmp_path) == ("empty", "good")
    assert list(benchmark("good", tmp_path).lines({"n": 1})) == ["1"]
    with pytest.raises(ConfigError, match=r"empty\.py is no benchmark"):
        benchmark("empty", tmp_path)


def test_the_render_benchmark_measures_positive_times_and_judges_them() -> None:
    module = benchmark("render")
    subject = module.make_subject(time.process_time)
    row = module.measure_profile(subject, module.PROFILES["draft"], (160, 120))
    assert row["ms"] > 0 and row["ratio"] == pytest.approx(row["ms"] / row["raw_ms"])
    brief = TrialConfig(objects=2, assistance="none", seed=0, time_limit=1.0)
    hud = module.measure_hud(subject, brief)
    assert hud["frames"] == 25
    assert 0 < hud["median_ms"] <= hud["p99_ms"] <= hud["max_ms"] and hud["first_ms"] > 0
    quality = {"ms": 400.0, "fast_ms": 20.0}
    result = {
        "renderer": "r", "gl": "v", "clock": "CPU time", "views": 9, "geoms": 3, "frames": [row], "hud": hud,
        "default_quality": quality, "default_quality_authored_lights": quality, "authored_over_fast": 20.0,
        "environment": {"state": 1600.0}, "with_hud_ratio": 1.2, "default_over_fast": 20.0, "hud_mean_ms": 0.5,
        "hud_p99_ms": 3.1,
    }  # fmt: skip
    outcomes = [line.rpartition(": ")[2].rstrip(")") for line in module.lines(result)][-4:]
    assert outcomes == ["FAIL", "pass", "pass", "FAIL"]


def test_the_trials_benchmark_shares_out_all_the_time_of_a_batch() -> None:
    """On the smallest batch; it times callables all over the program by name, so a renamed one fails here."""
    module = benchmark("trials")
    row = module.measure_batch(module.Setting("event", "optimal", "follower", 1e9), seeds=1, objects=2)
    assert sum(row["shares"].values()) == pytest.approx(1.0)
    assert all(0.0 <= share < 1.0 for share in row["shares"].values())
    assert row["shares"]["planning"] > 0.0 < row["shares"]["world"]
    assert row["simulated_per_s"] == pytest.approx(row["share_of_bare"] * row["bare_simulated_per_s"])
    text = "\n".join(module.lines({"objects": 2, "seeds": 1, "rows": [row]}))
    assert "event, follower: " in text and "(>= 1e+09: FAIL)" in text
