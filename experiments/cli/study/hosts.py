"""`mjsim study hosts`: several machines that serve one study."""

import argparse
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store

if TYPE_CHECKING:
    from experiments.visit.store import Store

DESCRIPTION = """\
List the hosts that serve a study (`mjsim study serve --host-name`), let one of them take no new visits, or give away
the visits of one that is gone: copy its folders DIR/visits/* to the same place of another host first. Each visit then
continues where its journal is."""


def add_parser(commands: Any) -> None:
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
    with_store(people_study(arguments), arguments, lambda store: _change(store, arguments))
    return 0


async def _change(store: "Store", arguments: argparse.Namespace) -> None:
    if name := arguments.drain or arguments.open:
        await store.drain(name, arguments.drain is not None, arguments.who)
    if name := arguments.hand_over:
        visits = await store.hand_over(name, arguments.who)
        print(f"{visits} visits of {name} continue where their journals are")
    for host in await store.hosts():
        print(f"{host.name}  heard of {host.seen:%F %T} UTC{'  takes no new visits' * host.draining}")
