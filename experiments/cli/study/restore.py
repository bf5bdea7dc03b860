"""`mjsim study restore`: a backup into an empty database."""

import argparse
import asyncio
from pathlib import Path
from typing import Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import sqlite_url

DESCRIPTION = """\
Fill an empty database with a backup of `mjsim study backup`. The database may be of another kind than the one that was
backed up, so that a study can move from a file to a server. A database that holds a study is refused."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "restore", run, summary="a backup into an empty database", description=DESCRIPTION
    )
    parser.add_argument("backup", type=Path, metavar="FILE.db", help="backup to read")
    parser.add_argument(
        "database", metavar="DATABASE", help="path of a new SQLite file, or URL of an empty database"
    )


def run(arguments: argparse.Namespace) -> int:
    require_extra("people")
    from experiments.study.data.copies import note_derived
    from experiments.visit.store import restore

    url = arguments.database
    if "://" not in url:
        note_derived(Path(url), "database", Path(url))
        note_derived(arguments.backup, "database", Path(url))
    asyncio.run(restore(arguments.backup, url if "://" in url else sqlite_url(Path(url))))
    print(url)
    return 0
