"""`mjsim study backup`: the database of a study as one file."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.study.database import (
    DATABASE,
    add_database,
    add_served_study,
    people_study,
    with_store,
)

if TYPE_CHECKING:
    from experiments.visit.store import Store

DESCRIPTION = """\
Write the whole database of a study, as of one moment, to a new file; the study may be served meanwhile. Journals and
run directories are plain files in DIR: copy that folder besides."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "backup", run, summary="the database of a study as one file", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.db", help="file to write")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    with_store(people_study(arguments), arguments, lambda store: _back_up(store, arguments))
    print(f"{arguments.out} (restore it with `mjsim study restore {arguments.out} {DATABASE}`)")
    return 0


async def _back_up(store: "Store", arguments: argparse.Namespace) -> None:
    from experiments.study.data.copies import note_copy
    from experiments.visit.store.copies import check_new

    check_new(arguments.out)  # what is not ours must not be noted as a copy
    note_copy(arguments.folder, "backup", arguments.out)
    await store.backup(arguments.out)
