"""`mjsim study preregister`: freeze a study before there are data."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.cli.requirements import require_extra

DESCRIPTION = """\
Freeze a study before there are data, as one ZIP: its design, measures, exclusions ([exclusions] in STUDY.toml,
docs/analysis.md), the code of the analysis and all versions. Equal studies give equal bytes. Deposit the file, or the
SHA-256 that is printed. `mjsim study analyze DIR --preregistration FILE` applies its exclusions and reports what
departs from it."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "preregister", run, summary="freeze a study before there are data", description=DESCRIPTION
    )
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`")
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="ZIP to write")
    parser.add_argument(
        "--measures",
        type=Path,
        metavar="FILE.toml",
        help="measures and items of the survey, if not the paper's",
    )
    add_force(parser, "replace a file that exists")


def run(arguments: argparse.Namespace) -> int:
    require_extra("study")
    from experiments.analysis.planning.preregistration import write_preregistration
    from experiments.analysis.study.measures import FILE
    from experiments.record.run_directory import check_file
    from experiments.trials.simulate import study_path

    check_file(arguments.out, replace=arguments.force)
    measures = FILE if arguments.measures is None else arguments.measures
    print(f"{write_preregistration(study_path(arguments.study), arguments.out, measures)}  {arguments.out}")
    return 0
