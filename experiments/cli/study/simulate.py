"""`mjsim study simulate`: the people of a study file, simulated on all cores."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.batch_progress import add_workers, run_with_progress
from experiments.cli.options import add_command
from experiments.cli.shards import add_shards, run_share
from experiments.trials.design import counted

DESCRIPTION = """\
Simulate the people of a study. The file is a design of `mjsim batch` (docs/batches.md) with a participant model and its
parameters; `paper` is the published study, 447 people. Each person is a run directory under OUT/trials, and a row of
OUT/trials.parquet and OUT/trials.csv. Rerun the command to resume; no participant is lost or duplicated. Results do
not depend on --workers. All data are simulated; nothing is evidence about people."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "simulate", run, summary="simulate the people of a study; resumes", description=DESCRIPTION
    )
    add_study(parser)
    add_shards(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the study")


def add_study(parser: argparse.ArgumentParser, **settings: Any) -> None:
    """Add the study file, `--people` and `--workers`."""
    parser.add_argument("study", metavar="STUDY.toml", help="study file, or `paper`", **settings)
    parser.add_argument(
        "--people",
        type=int,
        metavar="N",
        help="only the first N people; cells take people in turn (default: all)",
    )
    add_workers(parser)


def run(arguments: argparse.Namespace) -> int:
    """Simulate the people that are missing; 1 if a trial failed."""
    from experiments.cli.terminal import error_console
    from experiments.trials.simulate import read_study, study_path

    design = read_study(study_path(arguments.study), arguments.people)
    if (code := run_share(design, arguments, "simulated people")) is not None:
        return code
    rows, failed = run_with_progress(
        design, arguments.out, arguments.workers, arguments.executor, arguments.packed, "simulated people"
    )
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
