"""`mjsim study init` and `mjsim study preregister`: create a study file, and preregister a study."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command, add_force
from experiments.cli.study.database import add_study_file

INIT = """\
Write a study file with comments: the cells of a design, rules of exclusion, and the table [study] with what
participants see, are asked and are paid. Edit the file, then run `mjsim study serve STUDY.toml --out DIR` to try it
yourself."""

PREREGISTER = """\
Freeze a study before data are collected. The design, measures, exclusions ([exclusions] in STUDY.toml,
docs/analysis.md), code of the analysis and all versions are written to one ZIP file. Equal studies give equal bytes.
Deposit the file, or its SHA-256, which is printed. `mjsim study analyze DIR --preregistration FILE` applies the
exclusions and reports departures."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "init", run_init, INIT, "write a study file")
    parser.add_argument(
        "study", type=Path, nargs="?", default=Path("study.toml"), metavar="STUDY.toml", help="file to write"
    )
    add_force(parser, "replace an existing file")
    parser = add_command(
        commands, "preregister", run_preregister, PREREGISTER, "freeze a study before data are collected"
    )
    add_study_file(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE", help="ZIP file to write")
    parser.add_argument(
        "--measures",
        type=Path,
        metavar="FILE.toml",
        help="measures and survey items (default: those of the paper)",
    )
    add_force(parser, "replace an existing file")


def run_init(arguments: argparse.Namespace) -> int:
    from experiments.record.run_directory import check_file
    from experiments.study.file import TEMPLATE
    from mjsim.support.files import read_text, write_text_atomically

    check_file(arguments.study, replace=arguments.force)
    write_text_atomically(arguments.study, read_text(TEMPLATE))
    print(f"{arguments.study} (try it: mjsim study serve {arguments.study} --out runs/my-study)")
    return 0


def run_preregister(arguments: argparse.Namespace) -> int:
    require_extra("study")
    from experiments.analysis.planning.preregistration import write_preregistration
    from experiments.analysis.study.measures import FILE
    from experiments.record.run_directory import check_file
    from experiments.study.data.collect import survey_of
    from experiments.study.validation import check_study
    from experiments.trials.designs import study_path

    check_file(arguments.out, replace=arguments.force)
    study = check_study(study_path(arguments.study))
    survey = None if study is None else survey_of(study)
    measures = FILE if arguments.measures is None else arguments.measures
    sha256 = write_preregistration(study_path(arguments.study), arguments.out, measures, survey)
    print(f"{sha256}  {arguments.out}")
    return 0
