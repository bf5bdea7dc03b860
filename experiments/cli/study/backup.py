"""`mjsim study backup`: the database of a study as one file."""

import argparse
import asyncio
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import DATABASE, add_database, add_served_study, database_url

if TYPE_CHECKING:
    from experiments.people.study_file import Study

DESCRIPTION = """\
Write the whole database of a study, as of one moment, to a new file; the study may be served meanwhile. Journals and
run directories are plain files in DIR: copy that folder besides."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "backup", run, summary="the database of a study as one file", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="FILE.db", help="file to write")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    """Back up."""
    require_extra("people")
    from experiments.people.study_file import read_people_study
    from experiments.study.simulate import study_path

    study = read_people_study(study_path(arguments.study))
    asyncio.run(_back_up(study, arguments))
    print(f"{arguments.out} (restore it with `mjsim study restore {arguments.out} {DATABASE}`)")
    return 0


async def _back_up(study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.people.copies import note_copy
    from experiments.people.store import Store
    from experiments.people.store.copies import check_new

    store = await Store.open(database_url(arguments), study.settings.name, study.sha256)
    try:
        check_new(arguments.out)  # what is not ours must not be noted as a copy
        note_copy(arguments.folder, "backup", arguments.out)
        await store.backup(arguments.out)
    finally:
        await store.close()
