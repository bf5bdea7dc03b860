"""`mjsim study collect`: the tidy table of a study with people."""

import argparse
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command, add_force
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import (
    DATABASE,
    add_database,
    add_served_study,
    people_study,
    with_store,
)
from experiments.errors import RecordError
from experiments.trials.design import counted

DESCRIPTION = """\
Write what the people of a study did and answered as a tidy table, a row for each whose task is over: OUT/trials.parquet
and OUT/trials.csv, which `mjsim study analyze`, `compare` and `score` read, and OUT/texts.csv with what people wrote
freely. Answers on a scale are columns likert_NAME, others answer_NAME. No id of a platform and no address is in them.

DIR is the folder of `mjsim study serve`, which may run meanwhile, or one of `mjsim play`, or one that holds several of
these; people of `mjsim play` have no answers."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "collect", run, summary="the tidy table of a study with people", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="OUT", help="folder of the table")
    parser.add_argument(
        "--rehearsal", action="store_true", help="DIR is that of a rehearsal, whose people are simulated"
    )
    add_database(parser)
    add_force(parser, "replace tables that exist")


def run(arguments: argparse.Namespace) -> int:
    """Collect; 1 if a run cannot be used."""
    require_extra("people")
    from experiments.record.run_directory import check_file
    from experiments.study.data.collect import TEXTS, collect, collect_visits, write_collected
    from experiments.study.data.copies import note_copy, note_derived
    from experiments.trials.table import NAME

    for name in (f"{NAME}.parquet", f"{NAME}.csv", TEXTS):
        check_file(arguments.out / name, replace=arguments.force)
    if _is_served(arguments):
        study = replace(people_study(arguments), rehearsal=arguments.rehearsal)
        found = with_store(study, arguments, lambda store: collect(study, store, arguments.folder))
    else:
        found = collect_visits(arguments.folder)
    for person, fault in found.unusable.items():
        print(f"mjsim: {person}: {fault}", file=sys.stderr)
    if not found.rows:
        raise RecordError(
            f"nobody in {arguments.folder} has finished the task yet; there is no table to write"
        )
    if _is_served(arguments):
        note_copy(arguments.folder, "table", arguments.out)
    else:
        note_derived(arguments.folder, "table", arguments.out)
    table, *_ = write_collected(found, arguments.out)
    others = ", ".join(f"{number} {status.replace('_', ' ')}" for status, number in found.unfinished.items())
    print(f"{table} ({counted(len(found.rows), 'row')}; without one: {others or 'nobody'})")
    return 1 if found.unusable else 0


def _is_served(arguments: argparse.Namespace) -> bool:
    """Whether the folder is that of a study, and not of `mjsim play`."""
    from experiments.record.run_directory import visit_folders

    known = bool(arguments.database) or (arguments.folder / DATABASE).is_file()
    return known or not visit_folders(arguments.folder)
