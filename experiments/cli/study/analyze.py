"""`mjsim study analyze`: analyse a between-subjects study and write a report."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force

DESCRIPTION = """\
Analyse a study, a batch, or one or several folders of `mjsim play`. Each person, in one cell of assistance x number of
objects, is a row of trials.parquet or a visit. Write to --out:

  report.html             the whole analysis in one file, with figures
  stats.json              all numbers
  people.parquet, .csv    a row per person
  tests.csv               a row per test

People who did not finish are left out, and so are those whom --exclude selects by rules over columns or by id. The
report lists them with the reasons, and shows how results change without each rule.

The file experiments/trials/designs/metrics.toml, or your own (--measures), maps columns to measures and names the
survey items. docs/analysis.md explains how to read the report. All output from simulated participants is marked as
such."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "analyze", run, DESCRIPTION, "analyse a study and write a report")
    parser.add_argument("folder", type=Path, metavar="DIR", help="folder of a study, a batch or `mjsim play`")
    parser.add_argument("--out", type=Path, metavar="DIR", help="output folder (default: DIR/analysis)")
    parser.add_argument(
        "--exclude",
        type=Path,
        metavar="RULES.toml",
        help="rules of exclusion and excluded people, or a study file",
    )
    parser.add_argument(
        "--preregistration",
        type=Path,
        metavar="FILE",
        help="ZIP file of `mjsim study preregister`; its exclusions apply, and the report lists departures",
    )
    parser.add_argument(
        "--measures",
        type=Path,
        metavar="FILE.toml",
        help="measures and survey items (default: the preregistered ones, else those of the paper)",
    )
    add_force(parser, "replace an earlier analysis")


def run(arguments: argparse.Namespace) -> int:
    require_extra("study")
    from experiments.analysis.planning.preregistration import read_preregistration
    from experiments.analysis.study.files import check_files
    from experiments.analysis.study.measures import read_measures, with_survey
    from experiments.analysis.study.table import ANALYSIS, REPORT
    from experiments.study.data.analyses import write_report
    from experiments.trials.design import read_exclusions
    from experiments.trials.exclusions import Exclusions

    out = arguments.folder / ANALYSIS if arguments.out is None else arguments.out
    check_files(out, replace=arguments.force)
    frozen = None if arguments.preregistration is None else read_preregistration(arguments.preregistration)
    exclusions = Exclusions() if frozen is None else frozen.exclusions
    if arguments.exclude is not None:
        exclusions = read_exclusions(arguments.exclude)
    measures = read_measures() if frozen is None else frozen.measures
    if arguments.measures is not None:
        measures = read_measures(arguments.measures)
    measures = with_survey(measures, arguments.folder)
    analysis, selection = write_report(arguments.folder, out, exclusions, measures, frozen)
    print(
        f"{analysis.table.origin}: {len(analysis.table.rows)} people, {len(analysis.table.left_out)} left out. "
        f"{out / REPORT}"
    )
    if frozen is not None:
        print(f"departures from the preregistration: {len(selection.departures)}")
    return 0
