"""Options, progress bars and sharding for commands that run batches of trials (docs/batches.md)."""

import argparse
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_call_limit
from experiments.cli.server import number
from experiments.errors import ConfigError, listed
from experiments.trials.design import Design, counted
from experiments.trials.shards import Shard
from experiments.trials.workers import EXECUTORS, PROCESSES

if TYPE_CHECKING:
    from rich.progress import Progress

    from experiments.trials.trial_reader import OnRead

MAX_SHARDS_SHOWN = 100  # maximum number of shards listed in the message about missing trials


def add_workers(parser: argparse.ArgumentParser) -> None:
    add_call_limit(parser)
    parser.add_argument(
        "--workers",
        type=number(0, 100_000),
        metavar="N",
        help=f"number of trials at a time (default: one per core, here {os.cpu_count()}; all cores of a Ray cluster)",
    )
    parser.add_argument(
        "--executor",
        choices=EXECUTORS,
        default=PROCESSES,
        help="run in processes on this machine, or on the Ray cluster at RAY_ADDRESS, whose machines share DIR "
        "(default: %(default)s)",
    )
    parser.add_argument(
        "--packed",
        action="store_true",
        help="store the trials in DIR/trials/*.sqlar, a file per worker, instead of a folder per trial; for batches of "
        "many thousands (`mjsim unpack --help`)",
    )


def run_with_progress(
    design: Design, out: Path, arguments: argparse.Namespace, what: str, shard: Shard | None = None
) -> tuple[list[Mapping[str, Any]], int]:
    """Run all unfinished trials of a design or shard. Return the rows of all trials and the number of failures."""
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
            workers=arguments.workers,
            executor=arguments.executor,
            packed=arguments.packed,
            shard=shard,
            on_progress=show,
            on_note=note,
            on_read=show_reading,
        )
    return rows, failed


@contextmanager
def _progress_bars() -> "Iterator[tuple[Progress, OnRead]]":
    from experiments.cli.terminal import counting_bars

    with counting_bars("{task.description}") as bars:
        reading = bars.add_task("reading finished trials", total=None, visible=False)

        def show_reading(number: int, total: int) -> None:
            bars.update(reading, total=total, completed=number, visible=number < total)

        yield bars, show_reading


def add_shards(parser: argparse.ArgumentParser) -> None:
    modes = parser.add_mutually_exclusive_group()
    modes.add_argument(
        "--shard",
        type=_shard,
        metavar="K/N",
        help="run only share K of N equal shares (from 1), and write no tables; all shards may use the same DIR "
        "(docs/batches.md)",
    )
    modes.add_argument(
        "--merge",
        nargs="*",
        type=Path,
        metavar="PART",
        help="run nothing: merge the folders of shards into DIR (without PART, DIR has all shards already), write the "
        "tables, and list incomplete shards",
    )


def _shard(text: str) -> Shard:
    try:
        return Shard.parse(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def run_share(design: Design, arguments: argparse.Namespace, what: str) -> int | None:
    """Run one shard or merge shards, as requested. Return the exit code, or None if neither was requested."""
    from experiments.cli.terminal import error_console

    out: Path = arguments.out
    if arguments.merge is not None:
        return _merge(design, out, arguments.merge, arguments.workers)
    if arguments.shard is None:
        return None
    rows, failed = run_with_progress(design, out, arguments, what, arguments.shard)
    error_console().print(
        f"shard {arguments.shard}: {counted(len(rows), 'trial')} in {out}; {failed} failed; --merge writes the tables"
    )
    return 1 if failed else 0


def _merge(design: Design, out: Path, parts: list[Path], workers: int | None) -> int:
    from experiments.trials.merge import merge_shards

    with _progress_bars() as (bars, on_read):
        console = bars.console

        def note(line: str) -> None:
            console.print(line, style="yellow", soft_wrap=True)

        merged = merge_shards(
            design, out, parts, workers=workers or os.cpu_count() or 1, on_note=note, on_read=on_read
        )
    others = len(merged.rows) - (len(design.trials) - len(merged.missing))
    extra = f", {others} of them not of this design" if others else ""
    written = f" in {out}/trials.parquet and .csv" if merged.rows else "; no tables were written"
    console.print(f"{counted(len(merged.rows), 'trial')}{extra}{written}", soft_wrap=True)
    if not merged.missing:
        return 0
    incomplete = [f"--shard {shard} ({count})" for shard, count in merged.shards.items()]
    shards = listed(incomplete, MAX_SHARDS_SHOWN) or "the shards that hold them"
    todo = f"run again {shards}, then merge again"
    if others and len(merged.missing) == len(design.trials):
        todo = "give --merge the DESIGN.toml or the options with which the shards were run"
    lost = f"{len(merged.missing)} of {len(design.trials)} trials are missing"
    console.print(f"mjsim: {lost}: {todo}", style="red", soft_wrap=True)
    return 1
