"""`mjsim study analyze`: figures, tests and models of a study between subjects, in a report of one file."""

import argparse
from pathlib import Path
from typing import Any

from experiments.analysis.statistics import require_statsmodels
from experiments.commands.options import add_command, add_force

DESCRIPTION = """\
Analyse a study, or a batch, of simulated people or real ones: a row of trials.parquet per person, everybody in one
cell of assistance x number of objects. Writes

  report.html             all of it in one file, with figures
  stats.json              every number
  people.parquet, .csv    a row per person
  tests.csv               a row per F test

Which column stands for which measure is fixed in experiments/studies/metrics.toml. docs/study.md says how to read it.
Whatever comes of simulated people says so."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "analyze", run, summary="figures, tests and a report of a study", description=DESCRIPTION
    )
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study or a batch")
    parser.add_argument("--out", type=Path, metavar="DIR", help="where to write (default: DIR/analysis)")
    add_force(parser, "replace an earlier analysis")


def run(arguments: argparse.Namespace) -> int:
    """Analyse, write, say where.

    Raises:
        ConfigError: statsmodels is missing.
        RecordError: The folder is no study, or files are in the way.
    """
    require_statsmodels()
    from experiments.analysis.measures import read_measures
    from experiments.analysis.study_analysis import analyse
    from experiments.analysis.study_files import FOLDER, REPORT, check_files, write_analysis
    from experiments.analysis.study_report import report
    from experiments.analysis.study_table import read_study

    out = arguments.folder / FOLDER if arguments.out is None else arguments.out
    check_files(out, replace=arguments.force)
    measures = read_measures()
    analysis = analyse(read_study(arguments.folder, measures), measures)
    write_analysis(out, analysis, report(analysis, arguments.folder))
    print(f"{analysis.table.origin}: {len(analysis.table.rows)} people. {out / REPORT}")
    return 0
