"""`mjsim compare`: compare assistance conditions between the trials of a batch, which are paired by seed."""

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force, text_list
from experiments.errors import ConfigError
from mjsim.support.files import write_text_atomically

if TYPE_CHECKING:
    from experiments.analysis.comparison import Difference, Interval

METRICS = ("completion_time_s", "task_distance_m", "ipl_locations", "nd_feasible", "total_regret_m")
FORMATS = (".png", ".svg", ".pdf")  # supported file formats for figures
WIDTH = 160  # width of the output in characters if it is not written to a terminal

DESCRIPTION = """\
Compare each pair of assistance conditions in a batch. Two trials form a pair if they differ only in the assistance:
they have the same three seeds, number of objects, participant, house and so on. For each metric, print the means, the
mean difference (second minus first) and the effect size d_z (the mean difference divided by the standard deviation of
the differences), both with 95 % confidence intervals. Trials without a counterpart are listed and left out."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "compare", run, DESCRIPTION)
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a batch")
    parser.add_argument(
        "--metrics",
        type=text_list,
        default=",".join(METRICS),
        metavar="NAME,..",
        help="columns of trials.parquet to compare (docs/metrics.md)",
    )
    parser.add_argument("--plot", type=Path, metavar="FILE", help="figure to write (.png, .svg or .pdf)")
    parser.add_argument("--csv", type=Path, metavar="FILE", help="CSV table to write")
    add_force(parser)


def run(arguments: argparse.Namespace) -> int:
    from rich.console import Console

    from experiments.analysis.comparison import (
        batch_origin,
        compare,
        missing_pairs,
        read_blocks,
        unknown_metrics,
    )
    from experiments.record.run_directory import check_file

    if arguments.plot is not None and arguments.plot == arguments.csv:
        raise ConfigError(f"--plot and --csv both name {arguments.plot}; give two files")
    for path in (arguments.plot, arguments.csv):
        check_file(path, replace=arguments.force)
    if arguments.plot is not None:
        require_extra("study")
        if arguments.plot.suffix not in FORMATS:
            raise ConfigError(f"--plot {arguments.plot} must end in one of {', '.join(FORMATS)}")
    blocks = read_blocks(arguments.folder)
    differences = compare(blocks, arguments.metrics)
    origin = batch_origin(blocks)
    _show(differences, origin)
    console = Console(stderr=True, highlight=False, markup=False)
    for line in (*missing_pairs(blocks), *unknown_metrics(blocks, arguments.metrics, differences)):
        console.print(line, style="yellow", soft_wrap=True)
    if arguments.csv is not None:
        _write_csv(arguments.csv, differences, origin)
    if arguments.plot is not None:
        from experiments.analysis.comparison_plot import draw_comparison

        draw_comparison(arguments.plot, blocks, arguments.metrics)
    return 0


def _show(differences: "Sequence[Difference]", origin: str) -> None:
    from rich.console import Console
    from rich.table import Table

    table = Table(box=None, header_style="bold", title=origin, title_justify="left")
    for name in ("", "metric", "conditions", "pairs", "means", "difference [95 %]", "d_z [95 %]", "p"):
        table.add_column(name.replace("[", r"\["), overflow="fold")
    for d in differences:
        table.add_row(
            d.block,
            d.metric,
            " → ".join(d.conditions),
            str(d.pairs),
            f"{d.means[0]:.4g} → {d.means[1]:.4g}",
            _with_interval(d.difference, d.interval),
            _with_interval(d.effect, d.effect_interval),
            "-" if d.p is None else "< .001" if d.p < 0.001 else f"{d.p:.3f}",
        )
    Console(highlight=False, width=None if sys.stdout.isatty() else WIDTH).print(table)


def _with_interval(value: float | None, interval: "Interval") -> str:
    if value is None:
        return "-"
    return f"{value:+.3g}" + (rf" \[{interval[0]:+.3g}, {interval[1]:+.3g}]" if interval else "")


def _write_csv(path: Path, differences: "Sequence[Difference]", origin: str) -> None:
    from experiments.record.files import csv_text

    single = ("block", "metric", "pairs", "difference", "effect", "p")
    pairs = ("first", "second", "first_mean", "second_mean", "low", "high", "effect_low", "effect_high")
    none = "", ""
    rows = (
        (
            origin,
            *(getattr(d, name) for name in single),
            *(*d.conditions, *d.means, *(d.interval or none), *(d.effect_interval or none)),
        )
        for d in differences
    )
    write_text_atomically(path, csv_text(("origin", *single, *pairs), rows))
