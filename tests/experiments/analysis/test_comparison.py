"""Conditions compared on pairs: against scipy's paired test, by simulation, and with pairs missing."""

import csv

import matplotlib
import numpy as np
import pytest
from scipy.stats import nct, ttest_rel

from experiments.analysis.comparison import compare, mean_interval, missing_pairs, read_blocks
from experiments.analysis.comparison_plot import CAPTION
from experiments.cli.compare import METRICS
from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError
from experiments.record.phases import SIMULATED
from experiments.trials.table import write_tables
from experiments.trials.trial_config import TrialConfig


def row(assistance, seed, value, **options):
    config = TrialConfig(**{"objects": 6, "assistance": assistance, "seed": seed, **options})
    settings = {name: v for name, v in config.settings().items() if name not in ("person", "behaviour")}
    return settings | dict.fromkeys(METRICS, value) | {"ended": "all delivered"}


def batch(folder, values):
    """A batch folder with the table of these values: condition -> value by seed."""
    cells = ((name, seed, v) for name, by_seed in values.items() for seed, v in enumerate(by_seed))
    write_tables(folder, [row(*cell) for cell in cells if cell[2] is not ...])
    return folder


def test_it_agrees_with_the_paired_t_test(tmp_path):
    rng = np.random.default_rng(3)
    one = rng.normal(60, 10, 12)
    other = one - rng.normal(8, 5, 12)
    (found,) = compare(read_blocks(batch(tmp_path, {"none": one, "optimal": other})), ["completion_time_s"])
    expected = ttest_rel(other, one)
    assert (found.conditions, found.pairs) == (("none", "optimal"), 12)
    assert found.p == pytest.approx(expected.pvalue)
    assert found.interval == pytest.approx(tuple(expected.confidence_interval(0.95)))
    assert found.effect == pytest.approx(expected.statistic / np.sqrt(12))
    edges = nct.cdf(expected.statistic, 11, np.array(found.effect_interval) * np.sqrt(12))
    assert edges == pytest.approx([0.975, 0.025])


def test_pairs_that_are_missing_are_named_and_left_out(tmp_path):
    blocks = read_blocks(batch(tmp_path, {"none": [1.0, 2.0, 4.0, ...], "optimal": [2.0, ..., 8.0, 1.0]}))
    assert list(missing_pairs(blocks)) == ["without a counterpart in none or optimal: 2 trials, seeds 1, 3"]
    (found,) = compare(blocks, ["task_distance_m"])
    assert (found.pairs, found.means, found.difference) == (2, (2.5, 5.0), 2.5)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"completion_time_s": 1e308}, r"completion_time_s has the impossible value 1e\+308"),
        ({"completion_time_s": "long"}, "no metric 'completion_time_s'"),
        ({"assistance": 3}, "assistance is not a name"),
    ],
)
def test_values_that_cannot_be_are_named(change, said, tmp_path):
    rows = [row("none", 1, 2.0), row("optimal", 2, 2.0)]
    write_tables(tmp_path, [r | change for r in rows])
    with pytest.raises((ConfigError, RecordError), match=said):
        compare(read_blocks(tmp_path), ["completion_time_s"])


def test_two_versions_of_a_trial_are_refused(tmp_path):
    twice = [row("none", 1, 2.0) | {"fingerprint": version} for version in ("old", "new")]
    write_tables(tmp_path, [*twice, row("optimal", 1, 2.0)])
    with pytest.raises(RecordError, match="two trials of none, house_seed 1"):
        read_blocks(tmp_path)


@pytest.mark.parametrize("unknown", [None, np.nan])
def test_a_metric_that_no_pair_knows_has_no_row_and_is_named(unknown, tmp_path, capsys):
    rows = [row(name, seed, 1.0 + seed) for name in ("none", "optimal") for seed in range(2)]
    rows = [r | {"total_regret_m": unknown if r["assistance"] == "none" else 1.0} for r in rows]
    write_tables(tmp_path, rows)
    assert main(["compare", str(tmp_path)]) == 0
    printed = capsys.readouterr()
    assert "total_regret_m" not in printed.out and "nan" not in printed.out
    assert "total_regret_m is not known in both trials of any pair of none and optimal" in printed.err


def test_unlike_participants_are_no_pair(tmp_path):
    write_tables(tmp_path, [row("none", 0, 1.0, user="searcher"), row("optimal", 0, 2.0, user="follower")])
    blocks = read_blocks(tmp_path)
    assert [block.label for block in blocks] == ["user searcher", "user follower"]
    with pytest.raises(
        ConfigError, match="no pairs to compare: user searcher: no trial of none has the same"
    ):
        compare(blocks, METRICS)


def test_levels_are_compared_apart(tmp_path):
    rows = [row(name, 0, n, objects=n) for n in (6, 12) for name in ("none", "optimal")]
    write_tables(tmp_path, rows)
    assert [(d.block, d.pairs) for d in compare(read_blocks(tmp_path), ["task_distance_m"])] == [
        ("objects 6", 1),
        ("objects 12", 1),
    ]


def test_equal_differences_and_single_pairs_have_no_effect_size(tmp_path):
    blocks = read_blocks(batch(tmp_path, {"none": [1.0, 2.0, 3.0], "optimal": [2.0, 3.0, 4.0]}))
    (found,) = compare(blocks, ["task_distance_m"])
    assert (found.difference, found.effect, found.p) == (1.0, None, None)
    assert mean_interval(np.array([1.0])) is None


def test_two_pairs_that_hardly_vary_have_no_interval_of_the_effect(tmp_path):
    blocks = read_blocks(batch(tmp_path, {"none": [1.0, 2.0], "optimal": [2.0, 3.01]}))
    (found,) = compare(blocks, ["task_distance_m"])
    assert found.effect == pytest.approx(1.005 / (0.01 / np.sqrt(2)))
    assert found.effect_interval is None or np.isfinite(found.effect_interval).all()


@pytest.mark.slow
def test_the_command_shows_and_writes_both_and_replaces_nothing(tmp_path, capsys):
    folder = batch(
        tmp_path / "b", {"none": [1.0, 2.0, 3.5], "optimal": [2.0, 2.5, 5.0], "highlight": [1, 1, 1.0]}
    )
    (tmp_path / "plot.png").write_text("mine")
    assert main(["compare", str(folder), "--plot", str(tmp_path / "plot.png")]) == 2
    for figure, force in (("plot.svg", []), ("plot.png", ["--force"])):
        files = ["--plot", str(tmp_path / figure), "--csv", str(tmp_path / f"{figure}.csv"), *force]
        with matplotlib.rc_context({"svg.fonttype": "none"}):
            assert main(["compare", str(folder), *files]) == 0
        assert (tmp_path / figure).stat().st_size > 5000
    printed = capsys.readouterr().out
    assert "none → optimal" in printed and SIMULATED in printed
    drawn = (tmp_path / "plot.svg").read_text()
    assert all(f">{text}</text>" in drawn for text in (SIMULATED, CAPTION, "completion time (s)"))
    with (tmp_path / "plot.svg.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(METRICS)
    assert {found["origin"] for found in rows} == {SIMULATED}
    assert float(rows[0]["second_mean"]) - float(rows[0]["first_mean"]) == pytest.approx(
        float(rows[0]["difference"])
    )


@pytest.mark.parametrize(
    ("values", "metrics", "fault"),
    [
        ({"none": [1.0]}, METRICS, "fewer than two assistance conditions"),
        ({"none": [1.0], "optimal": [2.0]}, ["user"], "no metric 'user'; there are objects"),
    ],
)
def test_what_cannot_be_compared_is_named(tmp_path, values, metrics, fault):
    with pytest.raises(ConfigError, match=fault):
        compare(read_blocks(batch(tmp_path, values)), metrics)


def test_pairs_in_which_a_metric_is_unknown_are_counted(tmp_path, capsys):
    batch(tmp_path, {"none": [1.0, 2.0, 4.0], "optimal": [2.0, 3.0, np.nan]})
    assert main(["compare", str(tmp_path)]) == 0
    assert "ipl_locations is not known in 1 pair of none and optimal, left out" in capsys.readouterr().err
    both = str(tmp_path / "both.svg")
    assert main(["compare", str(tmp_path), "--plot", both, "--csv", both]) == 2
    assert "--plot and --csv both name" in capsys.readouterr().err
