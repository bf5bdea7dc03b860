"""`mjsim study researcher`: who may see the researcher's page."""

import argparse
import getpass
import secrets
import sys
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.study.database import (
    DATABASE,
    add_database,
    add_served_study,
    people_study,
    sqlite_url,
    with_store,
)
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.visit.store import Store

ROLES = ("owner", "assistant", "viewer")
SHORTEST = 12  # characters of a password
DESCRIPTION = f"""\
Who may see the researcher's page of `mjsim study serve --researcher-port`. `add` lets somebody in, `change` gives
another role or password and ends all logins, `disable` and `enable` shut somebody out and in again, `list` shows all.

A viewer sees everything and watches sessions, an assistant also pauses the study and reads the audit log, an owner also
stops it and changes quotas. The password is asked for, or read from standard input, or made with --generate; it has at
least {SHORTEST} characters."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "researcher", run, summary="who may see the researcher's page", description=DESCRIPTION
    )
    parser.add_argument("what", choices=("add", "change", "disable", "enable", "list"), help="what to do")
    add_served_study(parser)
    parser.add_argument("name", nargs="?", metavar="NAME", help="of the researcher: a-z, 0-9 and . _ @ -")
    parser.add_argument("--role", choices=ROLES, help="of a new researcher, or another one")
    parser.add_argument("--generate", action="store_true", help="make a password, and print it")
    parser.add_argument("--keep-password", action="store_true", help="change the role alone")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    if arguments.what != "list" and not arguments.name:
        raise ConfigError(f"`{arguments.what}` needs the NAME of a researcher")
    if arguments.what == "add" and not arguments.role:
        raise ConfigError(f"`add` needs --role: {', '.join(ROLES)}")
    study = people_study(arguments)
    arguments.folder.mkdir(parents=True, exist_ok=True)  # the first owner may come before the study is served
    url = arguments.database or sqlite_url(arguments.folder / DATABASE)
    with_store(study, arguments, lambda store: _do(store, arguments), url)
    return 0


async def _do(store: "Store", arguments: argparse.Namespace) -> None:
    researchers, name = store.researchers, arguments.name
    match arguments.what:
        case "list":
            for one in await researchers.all():
                print(f"{one.name}  {one.role}{'  disabled' if one.disabled else ''}")
            return
        case "add":
            await researchers.add(name, _password(arguments), arguments.role)
        case "change":
            password = None if arguments.keep_password else _password(arguments)
            await researchers.change(name, password=password, role=arguments.role)
        case "disable" | "enable":
            await researchers.change(name, disabled=arguments.what == "disable")
    await store.audit("command line", f"researcher: {arguments.what}", {"name": name})
    print(f"{name}: {arguments.what} done")


def _password(arguments: argparse.Namespace) -> str:
    """Never from the command line, where other users of the machine could read it."""
    if arguments.generate:
        password = secrets.token_urlsafe(18)
        print(password)
        return password
    if sys.stdin.isatty():
        password = getpass.getpass(f"Password of {arguments.name}: ")
        if getpass.getpass("Again: ") != password:
            raise ConfigError("the two passwords differ; nothing was changed")
    else:
        password = sys.stdin.readline().rstrip("\n")
    if len(password) < SHORTEST:
        raise ConfigError(f"a password has at least {SHORTEST} characters; --generate makes one")
    return password
