"""The command `mjsim study score`, which compares a study with the published statistics."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force

WIDTH = 160  # width of the table in characters if the output is not a terminal

DESCRIPTION = """\
Compare the results of a study with those of the published one (studies/published.toml): effect sizes, which should be
within the 90 % prediction intervals of the published ones, test decisions, directions of effects, and orders of
variances. For comparison, the score of a model that is true is shown, too. Only rows at 6 objects can have been used to
fit the guest (`mjsim study calibrate`). Answers to survey questions are not simulated.

If every cell has at least 200 people, they are treated as a population: effect sizes are those of the population, and
200 studies of the published size are drawn from it, to count how many have the published result."""


def add_parser(commands: Any) -> None:
    """Add the subcommand `score` to `mjsim study`."""
    parser = add_command(commands, "score", run, DESCRIPTION, "compare a study with the published one")
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study or a batch")
    parser.add_argument("--seed", type=int, default=0, metavar="S", help="seed for drawing these studies")
    parser.add_argument("--out", type=Path, metavar="DIR", help="output folder (default: DIR/analysis)")
    add_force(parser, "replace an earlier score")


def run(arguments: argparse.Namespace) -> int:
    """Score the study, print the results, and write them to files.

    Raises:
        ConfigError: statsmodels is not installed, or the seed is negative.
        RecordError: The folder does not contain a study, or output files already exist.
    """
    require_extra("study")
    from experiments.analysis.study.measures import read_measures, with_survey
    from experiments.analysis.study.table import ANALYSIS, read_study
    from experiments.errors import ConfigError
    from experiments.record.run_directory import check_file
    from studies.published import read_published
    from studies.score import score
    from studies.score_files import FILES, write_score

    if arguments.seed < 0:
        raise ConfigError(f"--seed {arguments.seed} must not be negative")
    out = arguments.folder / ANALYSIS if arguments.out is None else arguments.out
    for name in FILES:
        check_file(out / name, replace=arguments.force)
    published = read_published()
    people = read_study(arguments.folder, with_survey(read_measures(), arguments.folder))
    found = score(people, published, seed=arguments.seed)
    _show(found)
    for line in people.absent():
        print(line)
    write_score(out, found, published)
    return 0


def _show(score: Any) -> None:
    from rich.console import Console
    from rich.table import Table

    from experiments.analysis.page import shown
    from studies.score_files import COLUMNS, cells, how

    console = Console(highlight=False, markup=False, width=None if sys.stdout.isatty() else WIDTH)
    console.print(f"{score.origin}. {how(score)}")
    rows = Table(box=None, header_style="bold")
    for name in COLUMNS:
        rows.add_column(name, overflow="fold")
    for row in score.rows:
        rows.add_row(*("" if cell is None else shown(cell) for cell in cells(row)))
    console.print(rows)
    for what, which, agree, judged, of, truth in score.summary():
        found = f"{agree} of {judged} agree" if judged else "none judged"
        console.print(f"{what}, {which}: {found}, {of} rows (the truth: {truth})")
