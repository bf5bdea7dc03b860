"""`mjsim study erase`: delete all of a person."""

import argparse
import asyncio
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import add_database, add_served_study, database_url

if TYPE_CHECKING:
    from experiments.people.study_file import Study

DESCRIPTION = """\
Delete all that a study stores about a person: the rows of the database, the journal and the runs. Backups, restored
databases, tables and exports are written anew without the person. Analyses, metrics, films and pages that the person is
in are deleted: make them again. A file that is no longer where it was written is named, with what to do. The audit log
keeps that the person was erased, and what was paid. A person who is owed a payment must be paid first."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(commands, "erase", run, summary="delete all of a person", description=DESCRIPTION)
    add_served_study(parser)
    parser.add_argument("person", metavar="PERSON", help="name in tables, such as p00012")
    parser.add_argument("--who", required=True, metavar="NAME", help="who deletes, for the audit log")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    """Erase."""
    require_extra("people")
    from experiments.people.study_file import read_people_study
    from experiments.study.simulate import study_path

    study = read_people_study(study_path(arguments.study))
    for line in asyncio.run(_erase(study, arguments)):
        print(line)
    print(f"{arguments.person} is deleted")
    return 0


async def _erase(study: "Study", arguments: argparse.Namespace) -> list[str]:
    from experiments.people.erase import erase
    from experiments.people.store import Store

    store = await Store.open(database_url(arguments), study.settings.name, study.sha256)
    try:
        return await erase(store, arguments.folder, arguments.person, arguments.who)
    finally:
        await store.close()
