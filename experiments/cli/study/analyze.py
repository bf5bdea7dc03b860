"""`mjsim study analyze`: figures, tests and models of a study between subjects, in a report of one file."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.cli.requirements import require_extra

DESCRIPTION = """\
Analyse a study, or a batch, of simulated people or real ones: a row of trials.parquet per person, each in one
cell of assistance x number of objects. Writes

  report.html             all of it in one file, with figures
  stats.json              every number
  people.parquet, .csv    a row per person
  tests.csv               a row per F test

Which column stands for which measure is fixed in experiments/study/designs/metrics.toml. docs/study.md explains how
to read it. All output from simulated people is marked as such."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "analyze", run, summary="figures, tests and a report of a study", description=DESCRIPTION
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study or a batch")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to write (default: DIR/analysis)")
    add_force(parser, "replace an earlier analysis")


def run(arguments: argparse.Namespace) -> int:
    """Analyse, write, say where."""
    require_extra("study")
    from experiments.study.analysis import analyse
    from experiments.study.files import FOLDER, REPORT, check_files, write_analysis
    from experiments.study.measures import read_measures
    from experiments.study.report import report
    from experiments.study.table import read_study

    out = arguments.folder / FOLDER if arguments.out is None else arguments.out
    check_files(out, replace=arguments.force)
    measures = read_measures()
    analysis = analyse(read_study(arguments.folder, measures), measures)
    write_analysis(out, analysis, report(analysis, arguments.folder))
    print(f"{analysis.table.origin}: {len(analysis.table.rows)} people. {out / REPORT}")
    return 0
