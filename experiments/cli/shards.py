"""Options `--shard` and `--merge`: a design shared by the tasks of an array job (docs/batches.md)."""

import argparse
import os
from pathlib import Path

from experiments.cli.batch_progress import progress_of_reading, run_with_progress
from experiments.errors import ConfigError
from experiments.trials.design import Design, counted
from experiments.trials.shards import Shard

SHOWN = 100  # number of shards in a line


def add_shards(parser: argparse.ArgumentParser) -> None:
    """Add `--shard` and `--merge`."""
    modes = parser.add_mutually_exclusive_group()
    modes.add_argument(
        "--shard",
        type=_shard,
        metavar="K/N",
        help="run only the K-th of N equal shares, counted from 1, and write no tables; all shards may share OUT "
        "(docs/batches.md)",
    )
    modes.add_argument(
        "--merge",
        nargs="*",
        type=Path,
        metavar="PART",
        help="run nothing: join the folders of shards in OUT (without PART, OUT holds them all), write the tables, and "
        "name the shards that are incomplete",
    )


def _shard(text: str) -> Shard:
    try:
        return Shard.parse(text)
    except ConfigError as error:
        raise argparse.ArgumentTypeError(str(error)) from error


def run_share(design: Design, arguments: argparse.Namespace, what: str = "trials") -> int | None:
    """Run a shard or merge shards; 1 if trials failed or are missing. Return None if neither was asked for."""
    from experiments.cli.terminal import error_console

    out: Path = arguments.out
    if arguments.merge is not None:
        return _merge(design, out, arguments.merge, arguments.workers)
    if arguments.shard is None:
        return None
    rows, failed = run_with_progress(
        design, out, arguments.workers, arguments.executor, arguments.packed, what, arguments.shard
    )
    error_console().print(
        f"shard {arguments.shard}: {counted(len(rows), 'trial')} in {out}; {failed} failed; --merge writes the tables"
    )
    return 1 if failed else 0


def _merge(design: Design, out: Path, parts: list[Path], workers: int | None) -> int:
    from experiments.trials.merge import merge_shards

    with progress_of_reading() as (console, on_read):

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
    again = [f"--shard {shard} ({count})" for shard, count in merged.shards.items()]
    more = f" and {len(again) - SHOWN} more" if len(again) > SHOWN else ""
    run = f"run again {', '.join(again[:SHOWN])}{more}" if again else "run the shards that hold them again"
    lost = f"{len(merged.missing)} of {len(design.trials)} trials are missing"
    console.print(f"mjsim: {lost}: {run}, then merge again", style="red", soft_wrap=True)
    return 1
