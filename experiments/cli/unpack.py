"""`mjsim unpack`: extract run directories from packed trials."""

import argparse
import sys
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command
from experiments.errors import RecordError

DESCRIPTION = """\
Turn packed trials of a batch (`mjsim batch --packed`) into run directories under DIR/trials, with the same bytes as a
batch without --packed writes. Each file is verified by its SHA-256, and a packed trial is deleted only after its run
directory is on disk. Repeat the command to continue after an interruption.

You rarely need this: `mjsim replay`, `view`, `metrics`, `compare` and `study analyze` read packed trials, and a batch
may contain both kinds. Without mjsim, `sqlite3 DIR/trials/FILE.sqlar -A --list` lists the files of an archive, and the
option `-A --extract` unpacks them."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "unpack", run, DESCRIPTION)
    parser.add_argument("out", type=Path, metavar="DIR", help="folder of a batch")
    parser.add_argument("names", nargs="*", metavar="NAME", help="names of trials (default: all)")


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import error_console, progress_bars
    from experiments.record.archive import adopt, run_paths, unpack_in_place
    from experiments.record.run_directory import PACKED, TRIALS

    trials, failures = arguments.out / TRIALS, 0
    adopt(trials)
    packed = {path.name: path for path in run_paths(trials) if path.parent.suffix == PACKED}
    if not packed or not packed.keys() >= set(arguments.names):
        missing = ", ".join(sorted({*arguments.names} - packed.keys())) or "at all"
        raise RecordError(
            f"{arguments.out} has no packed trial {missing}; name the --out of `mjsim batch --packed`"
        )
    wanted = {packed[name] for name in arguments.names or packed}
    with progress_bars(error_console()) as bars:
        for fault in bars.track(unpack_in_place(trials, wanted), total=len(wanted), description="unpack"):
            if fault is not None:
                failures += 1
                print(f"mjsim: {fault}", file=sys.stderr)
    return 1 if failures else 0
