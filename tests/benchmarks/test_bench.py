"""`mjsim bench` finds the benchmarks of a checkout."""

import pytest

from benchmarks._command import benchmark, benchmark_names
from benchmarks.support.play_browser import SeenFrame, SimulatedBrowser
from benchmarks.support.play_load import median_width
from experiments.cli.main import main
from experiments.errors import ConfigError


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
    with pytest.raises(ConfigError, match=r"empty\.py is no benchmark"):
        benchmark("empty", tmp_path)


def test_a_session_without_a_frame_has_a_width_of_nothing():
    blind, seeing = SimulatedBrowser("/"), SimulatedBrowser("/")
    seeing.frames.append(SeenFrame(0.0, 0, 320))
    assert (median_width([blind]), median_width([seeing])) == (0.0, 320.0)
