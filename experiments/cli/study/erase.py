"""`mjsim study erase`: delete all of a person."""

import argparse
from typing import Any

from experiments.cli.options import add_command
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store

DESCRIPTION = """\
Delete all that a study stores about a person: the rows of the database, the journal and the runs. Backups, restored
databases, tables and exports are written anew without the person. Analyses, metrics, films and pages that the person is
in are deleted: make them again. A file that is no longer where it was written is named, with what to do. The audit log
keeps that the person was erased, and what was paid. A person who is owed a payment must be paid first."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "erase", run, summary="delete all of a person", description=DESCRIPTION)
    add_served_study(parser)
    parser.add_argument("person", metavar="PERSON", help="name in tables, such as p00012")
    parser.add_argument("--who", required=True, metavar="NAME", help="who deletes, for the audit log")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.erase import erase

    person, who = arguments.person, arguments.who
    erased = with_store(study, arguments, lambda store: erase(store, arguments.folder, person, who))
    for line in erased:
        print(line)
    print(f"{arguments.person} is deleted")
    return 0
