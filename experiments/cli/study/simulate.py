"""`mjsim study simulate`: simulate the participants of a study."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.batch_progress import add_shards, add_workers, run_share, run_with_progress
from experiments.cli.options import add_command
from experiments.cli.study.database import add_study_file
from experiments.trials.design import counted

DESCRIPTION = """\
Simulate the participants of a study on all cores. The study file is a design of `mjsim batch` (docs/batches.md) with a
participant model and its parameters; `paper` is the published study with 447 participants. Each participant has a run
directory under DIR/trials and a row in DIR/trials.parquet and DIR/trials.csv. Repeat the command to continue after an
interruption: no participant is lost or duplicated. The results do not depend on --workers. All data are simulated: they
are not evidence about people."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "simulate", run, DESCRIPTION, "simulate the participants of a study")
    add_study(parser)
    add_shards(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder for the study")


def add_study(parser: argparse.ArgumentParser, **settings: Any) -> None:
    add_study_file(parser, **settings)
    parser.add_argument(
        "--people",
        type=int,
        metavar="N",
        help="simulate only the first N participants, assigned to cells in turn (default: all)",
    )
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import error_console
    from experiments.study.validation import check_study
    from experiments.trials.designs import read_study, study_path

    check_study(study_path(arguments.study))
    design = read_study(study_path(arguments.study), arguments.people)
    if (code := run_share(design, arguments, "simulated people")) is not None:
        return code
    rows, failed = run_with_progress(design, arguments.out, arguments, "simulated people")
    console = error_console()
    if (others := len(rows) + failed - len(design.trials)) > 0:
        console.print(
            f"mjsim: {arguments.out} has {counted(others, 'more row')} than the {len(design.trials)} asked "
            "for; the tables hold all of them",
            style="yellow",
        )
    console.print(
        f"{counted(len(rows), 'row')} of simulated people in {arguments.out}/trials.parquet and .csv; {failed} failed"
    )
    return 1 if failed else 0
