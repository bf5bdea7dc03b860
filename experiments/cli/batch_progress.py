"""Running the trials of a design with a progress bar."""

import argparse
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_call_limit
from experiments.trials.design import Design
from experiments.trials.shards import Shard
from experiments.trials.workers import EXECUTORS, PROCESSES

if TYPE_CHECKING:
    from rich.console import Console
    from rich.progress import Progress

    from experiments.trials.trial_reader import OnRead


def add_workers(parser: argparse.ArgumentParser) -> None:
    """Add `--workers`, `--executor`, `--packed` and `--call-limit`."""
    add_call_limit(parser)
    parser.add_argument(
        "--workers",
        type=int,
        metavar="N",
        help=f"trials at a time (default: one per core; {os.cpu_count()} here, all of a Ray cluster)",
    )
    parser.add_argument(
        "--executor",
        choices=EXECUTORS,
        default=PROCESSES,
        help="processes of this machine, or the Ray cluster at RAY_ADDRESS whose machines share OUT "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--packed",
        action="store_true",
        help="store the trials in OUT/trials/*.sqlar, one file per worker, instead of a folder each: for batches of "
        "many thousands (`mjsim unpack --help`)",
    )


def run_with_progress(
    design: Design,
    out: Path,
    workers: int | None,
    executor: str,
    packed: bool,
    what: str = "trials",
    shard: Shard | None = None,
) -> tuple[list[Mapping[str, Any]], int]:
    """Run what is missing of a design; all rows of the folder, and how many trials failed. `what` precedes the bar."""
    from experiments.trials.batch import BatchProgress, run_batch

    failed = 0
    with _progress_bars() as (bars, show_reading):
        bar = bars.add_task(what, total=None)

        def show(progress: BatchProgress) -> None:
            nonlocal failed
            failed = progress.failed
            bars.update(bar, total=progress.total, completed=progress.resumed + progress.done + failed)
            if progress.failure:
                bars.console.print(f"failed: {progress.failure}", style="red", soft_wrap=True)

        def note(line: str) -> None:
            bars.console.print(line, style="yellow", soft_wrap=True)

        rows = run_batch(
            design,
            out,
            workers=workers,
            executor=executor,
            packed=packed,
            shard=shard,
            on_progress=show,
            on_note=note,
            on_read=show_reading,
        )
    return rows, failed


@contextmanager
def progress_of_reading() -> "Iterator[tuple[Console, OnRead]]":
    """Yield the console next to a progress bar, and a function that shows how many trials are read."""
    with _progress_bars() as (bars, show_reading):
        yield bars.console, show_reading


@contextmanager
def _progress_bars() -> "Iterator[tuple[Progress, OnRead]]":
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    from experiments.cli.terminal import error_console, progress_bars

    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
    )
    with progress_bars(error_console(), *columns) as bars:
        reading = bars.add_task("reading finished trials", total=None, visible=False)

        def show_reading(number: int, total: int) -> None:
            bars.update(reading, total=total, completed=number, visible=number < total)

        yield bars, show_reading
