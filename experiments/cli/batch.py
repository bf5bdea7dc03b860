"""`mjsim batch`: run all trials of an experimental design."""

import argparse
from pathlib import Path
from typing import Any

from experiments.cli.batch_progress import add_shards, add_workers, run_share, run_with_progress
from experiments.cli.options import (
    NAMES,
    PERSON_VALUES,
    TRIAL_OPTIONS,
    add_command,
    add_setting,
    add_trial_options,
    given_options,
    int_list,
    text_list,
    trial_options,
)
from experiments.errors import ConfigError
from experiments.participants.registry import DEFAULT_PARTICIPANT
from experiments.trials.design import Design, counted, factorial, read_design

OBJECTS = 6
ASSISTANCE = ("none", "highlight", "optimal")

DESCRIPTION = """\
Run the trials of a design file, or one trial for every combination of --objects, --assistance, --user and --seeds, with
one process per core and without video. Each trial becomes a run directory under DIR/trials. DIR/trials.parquet and
DIR/trials.csv have one row per trial.

Finished trials are not run again: repeat the command to continue after an interruption, or add values to extend the
design. The records do not depend on --workers. --packed stores the trials in a few SQLite archives, which the other
commands read like run directories."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "batch", run, DESCRIPTION)
    parser.add_argument(
        "design",
        nargs="?",
        type=Path,
        metavar="DESIGN.toml",
        help="design file (docs/batches.md)",
    )
    numbers = f"numbers of misplaced objects, such as 6,12,18,24 (default: {OBJECTS})"
    add_setting(parser, "objects", type=int_list, metavar="N,..", help=numbers)
    conditions = f"assistance conditions{NAMES['assistance']()} (default: {','.join(ASSISTANCE)})"
    add_setting(parser, "assistance", type=text_list, metavar="NAME,..", help=conditions)
    parser.add_argument(
        "--seeds",
        type=int_list,
        metavar="A:B",
        help="seeds, such as 1,2,5 or 0:10, which excludes 10 (default: 0:10)",
    )
    users = f"participants{NAMES['user']()} (default: {DEFAULT_PARTICIPANT})"
    add_setting(parser, "user", type=text_list, metavar="NAME,..", help=users)
    add_trial_options(parser)
    add_workers(parser)
    add_shards(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder of the batch")


def _design(arguments: argparse.Namespace) -> Design:
    if arguments.design is not None:
        names = ("objects", "assistance", "seeds", "user", *TRIAL_OPTIONS, *PERSON_VALUES)
        if given := given_options(arguments, names):
            options = ", ".join(f"--{name.replace('_', '-')}" for name in given)
            raise ConfigError(f"{arguments.design} sets {options}; leave them out, or change the file")
        return read_design(arguments.design)
    same = trial_options(arguments)
    return factorial(
        objects=[same.pop("objects")] if "objects" in same else arguments.objects or [OBJECTS],
        assistance=ASSISTANCE if arguments.assistance is None else arguments.assistance,
        users=[DEFAULT_PARTICIPANT] if arguments.user is None else arguments.user,
        seeds=range(10) if arguments.seeds is None else arguments.seeds,
        **same,
    )


def run(arguments: argparse.Namespace) -> int:
    from experiments.cli.terminal import error_console

    design = _design(arguments)
    if (code := run_share(design, arguments, "trials")) is not None:
        return code
    rows, failed = run_with_progress(design, arguments.out, arguments, "trials")
    error_console().print(
        f"{counted(len(rows), 'trial')} in {arguments.out}/trials.parquet and .csv; {failed} failed"
    )
    return 1 if failed else 0
