"""`mjsim batch`: a factorial design on all cores."""

import argparse
import os
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from experiments.batch import BatchConfig, BatchProgress, run_batch
from experiments.commands.options import (
    add_command,
    add_trial_options,
    assistance_help,
    int_list,
    text_list,
    trial_options,
)

DESCRIPTION = """\
Run a trial for every combination of --objects, --assistance and --seeds, without video, one process per core. Each
trial is a run directory under OUT/trials; OUT/trials.parquet and OUT/trials.csv hold one row per trial. Finished trials
are not run again: give the command once more to continue after an interruption, or with more values to extend the
design. The records do not depend on --workers."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands,
        "batch",
        run,
        summary="run a factorial design on all cores; resumes",
        description=DESCRIPTION,
    )
    parser.add_argument(
        "--objects",
        type=int_list,
        default="6",
        metavar="N,..",
        help="numbers of misplaced objects, each 1 to 40, such as 6,12,18,24",
    )
    parser.add_argument(
        "--assistance",
        type=text_list,
        default="none,highlight,optimal",
        metavar="NAME,..",
        help=assistance_help(),
    )
    parser.add_argument(
        "--seeds",
        type=int_list,
        default="0:10",
        metavar="A:B",
        help="seeds, such as 1,2,5 or 0:10, which ends with 9",
    )
    add_trial_options(parser)
    parser.add_argument(
        "--workers",
        type=int,
        default=os.cpu_count(),
        metavar="N",
        help="processes (default: one per core, %(default)s here)",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the batch")


def run(arguments: argparse.Namespace) -> int:
    """Run the batch with a progress bar; 1 if a trial failed."""
    batch = BatchConfig(
        objects=arguments.objects,
        assistance=arguments.assistance,
        seeds=arguments.seeds,
        **trial_options(arguments),
    )
    console = Console(stderr=True, highlight=False)
    columns = (
        TextColumn("trials"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    failed = 0
    with Progress(*columns, console=console) as bars:
        bar = bars.add_task("trials", total=None)

        def show(progress: BatchProgress) -> None:
            nonlocal failed
            failed = progress.failed
            bars.update(bar, total=progress.total, completed=progress.resumed + progress.done + failed)
            if progress.failure:
                bars.console.print(f"failed: {progress.failure}", style="red", soft_wrap=True)

        rows = run_batch(batch, arguments.out, workers=arguments.workers, on_progress=show)
    console.print(f"{len(rows)} trials in {arguments.out}/trials.parquet and .csv; {failed} failed")
    return 1 if failed else 0
