"""Conditions compared on pairs: against scipy's paired test, by simulation, and with pairs missing."""

import csv

import matplotlib
import numpy as np
import pytest
from scipy.stats import ttest_rel

from experiments.analysis.comparison import compare, mean_interval, missing_pairs, read_blocks
from experiments.cli.compare import METRICS
from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError
from experiments.record.origin import SIMULATED
from experiments.trials.table import write_tables
from experiments.trials.trial_config import TrialConfig


def row(assistance, seed, value, **options):
    config = TrialConfig(**{"objects": 6, "assistance": assistance, "seed": seed, **options})
    settings = {name: v for name, v in config.settings().items() if name not in ("person", "behaviour")}
    return settings | dict.fromkeys(METRICS, value) | {"ended": "all delivered"}


def batch(folder, values, **options):
    """A batch folder with the table of these values: condition -> value by seed."""
    write_tables(
        folder,
        [
            row(name, seed, v, **options)
            for name, by_seed in values.items()
            for seed, v in enumerate(by_seed)
            if v is not ...
        ],
    )
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
    assert found.effect_interval[0] < found.effect < found.effect_interval[1] < 0


@pytest.mark.slow
def test_the_interval_of_the_effect_covers_the_truth(tmp_path):
    """In 95 of 100 repeated experiments, but for chance: 300 of them stay within three standard errors."""
    rng, truth, inside, repeats = np.random.default_rng(0), 0.6, 0, 300
    for _ in range(repeats):
        gaps = rng.normal(truth, 1.0, 15)
        write_tables(
            tmp_path, [row(n, k, g * f) for k, g in enumerate(gaps) for n, f in (("a", 0), ("b", 1))]
        )
        (found,) = compare(read_blocks(tmp_path), ["task_distance_m"])
        inside += found.effect_interval[0] <= truth <= found.effect_interval[1]
    assert inside / repeats == pytest.approx(0.95, abs=3 * np.sqrt(0.95 * 0.05 / repeats))


def test_pairs_that_are_missing_are_named_and_left_out(tmp_path):
    blocks = read_blocks(batch(tmp_path, {"none": [1.0, 2.0, 4.0, ...], "optimal": [2.0, ..., 8.0, 1.0]}))
    assert list(missing_pairs(blocks)) == ["without a counterpart in none or optimal: 2 trials, seeds 1, 3"]
    (found,) = compare(blocks, ["task_distance_m"])
    assert (found.pairs, found.means, found.difference) == (2, (2.5, 5.0), 2.5)


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


def test_the_command_shows_and_writes_both_and_replaces_nothing(tmp_path, capsys):
    folder = batch(
        tmp_path / "b", {"none": [1.0, 2.0, 3.5], "optimal": [2.0, 2.5, 5.0], "highlight": [1, 1, 1.0]}
    )
    for figure in ("plot.svg", "plot.png"):
        files = ["--plot", str(tmp_path / figure), "--csv", str(tmp_path / f"{figure}.csv")]
        with matplotlib.rc_context({"svg.fonttype": "none"}):
            assert main(["compare", str(folder), *files]) == 0
        assert (tmp_path / figure).stat().st_size > 5000
    printed = capsys.readouterr().out
    assert "none → optimal" in printed and SIMULATED in printed
    assert f">{SIMULATED}</text>" in (tmp_path / "plot.svg").read_text()
    with (tmp_path / "plot.svg.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 3 * len(METRICS)
    assert {found["origin"] for found in rows} == {SIMULATED}
    assert float(rows[0]["second_mean"]) - float(rows[0]["first_mean"]) == pytest.approx(
        float(rows[0]["difference"])
    )
    assert main(["compare", str(folder), "--plot", str(tmp_path / "plot.svg")]) == 2
    assert main(["compare", str(folder), "--plot", str(tmp_path / "plot.svg"), "--force"]) == 0


@pytest.mark.parametrize(
    ("values", "arguments", "error", "fault"),
    [
        ({"none": [1.0]}, METRICS, ConfigError, "fewer than two assistance conditions"),
        ({"none": [1.0], "optimal": [2.0]}, ["user"], ConfigError, "no metric 'user'; there are objects"),
        ({"none": [..., 1.0], "optimal": [2.0, ...]}, METRICS, ConfigError, "no pairs to compare"),
    ],
)
def test_what_cannot_be_compared_is_named(tmp_path, values, arguments, error, fault):
    with pytest.raises(error, match=fault):
        compare(read_blocks(batch(tmp_path, values)), arguments)


def test_a_folder_without_a_table_is_named(tmp_path):
    with pytest.raises(RecordError, match="is not a batch"):
        read_blocks(tmp_path)
    (tmp_path / "trials.parquet").write_bytes(b"no table")
    with pytest.raises(RecordError, match="is not a batch"):
        read_blocks(tmp_path)
