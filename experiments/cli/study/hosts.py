"""`mjsim study hosts`: several machines that serve one study."""

import argparse
import asyncio
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import add_database, add_served_study, database_url

if TYPE_CHECKING:
    from experiments.people.study_file import Study

DESCRIPTION = """\
List the hosts that serve a study (`mjsim study serve --host-name`), let one of them take no new visits, or give away
the visits of one that is gone: copy its folders DIR/visits/* to the same place of another host first. Each visit then
continues where its journal is."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "hosts", run, summary="machines that serve one study", description=DESCRIPTION
    )
    add_served_study(parser)
    group = parser.add_mutually_exclusive_group()
    group.add_argument("--drain", metavar="NAME", help="let a host take no new visits")
    group.add_argument("--open", metavar="NAME", help="let it take them again")
    group.add_argument("--hand-over", metavar="NAME", help="give away the visits of a host that is gone")
    parser.add_argument("--who", default="mjsim", metavar="NAME", help="who does it, for the audit log")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    """Do it, and list the hosts."""
    require_extra("people")
    from experiments.people.study_file import read_people_study
    from experiments.study.simulate import study_path

    asyncio.run(_change(read_people_study(study_path(arguments.study)), arguments))
    return 0


async def _change(study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.people.store import Store

    store = await Store.open(database_url(arguments), study.settings.name, study.sha256)
    try:
        if name := arguments.drain or arguments.open:
            await store.drain(name, arguments.drain is not None, arguments.who)
        if name := arguments.hand_over:
            print(
                f"{await store.hand_over(name, arguments.who)} visits of {name} continue where their journals are"
            )
        for host in await store.hosts():
            print(f"{host.name}  heard of {host.seen:%F %T} UTC{'  takes no new visits' * host.draining}")
    finally:
        await store.close()
