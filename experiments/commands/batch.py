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
    add_fidelity,
    add_house,
    add_planner,
    add_regret,
    add_user,
    assistance_help,
    int_list,
    text_list,
)

DESCRIPTION = """\
Run every combination of --objects, --assistance and --seeds, without video, one process per core. Each trial is a run
directory under OUT/trials; OUT/trials.parquet and OUT/trials.csv hold a row per trial. Finished trials are not
run again: after an interruption, or to enlarge the design, give the command once more.

Records are the same to the last bit whatever --workers is."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser: argparse.ArgumentParser = commands.add_parser(
        "batch",
        help="run a factorial design on all cores; resumes",
        description=DESCRIPTION,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--objects", type=int_list, default=[6], metavar="N,..", help="difficulties, e.g. 6,12,18,24"
    )
    parser.add_argument(
        "--assistance",
        type=text_list,
        default=["none", "highlight", "optimal"],
        metavar="NAME,..",
        help=f"{assistance_help()} (none,highlight,optimal)",
    )
    parser.add_argument(
        "--seeds",
        type=int_list,
        default=list(range(10)),
        metavar="A:B",
        help="seeds, e.g. 0:10 or 1,2,5 (0:10)",
    )
    add_user(parser)
    add_house(parser)
    add_planner(parser)
    add_fidelity(parser)
    add_regret(parser)
    parser.add_argument(
        "--workers", type=int, default=os.cpu_count(), metavar="N", help="processes (one per core)"
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the batch")
    parser.set_defaults(run=run)


def run(arguments: argparse.Namespace) -> int:
    """Run the batch with a progress bar; 1 if a trial failed."""
    batch = BatchConfig(
        objects=arguments.objects,
        assistance=arguments.assistance,
        seeds=arguments.seeds,
        user=arguments.user,
        house=arguments.house,
        planner=arguments.planner,
        fidelity=arguments.fidelity,
        regret=arguments.regret,
    )
    console = Console(stderr=True)
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
            bars.update(
                bar, total=progress.total, completed=progress.resumed + progress.done + progress.failed
            )
            if progress.failure:
                bars.console.print(
                    f"failed: {progress.failure}", style="red", highlight=False, soft_wrap=True
                )

        rows = run_batch(
            batch,
            arguments.out,
            workers=arguments.workers,
            on_progress=show,
        )
    console.print(
        f"{len(rows)} trials in {arguments.out}/trials.parquet and .csv; {failed} failed", highlight=False
    )
    return 1 if failed else 0
