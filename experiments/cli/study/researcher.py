"""`mjsim study researcher`: manage researcher accounts."""

import argparse
import getpass
import secrets
import sys
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.visit.store import Store

ROLES = ("owner", "assistant", "viewer")
MIN_PASSWORD = 12  # minimum length of a password in characters
DESCRIPTION = f"""\
Manage the accounts for the researcher's page (`mjsim study serve --researcher-port`). `add` creates an account,
`change` changes its role or password and ends its logins, `disable` and `enable` switch it off and on, and `list` lists
all accounts.

A viewer sees everything and watches sessions. An assistant can also pause the study and read the audit log. An owner
can also stop the study and change quotas.

The password needs at least {MIN_PASSWORD} characters. It is prompted for, read from standard input if that is not a
terminal, or generated with --generate."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "researcher", run, DESCRIPTION, "manage the accounts of researchers")
    parser.add_argument("what", choices=("add", "change", "disable", "enable", "list"), help="action")
    add_served_study(parser)
    parser.add_argument("name", nargs="?", metavar="NAME", help="name of the account: a-z, 0-9 and . _ @ -")
    parser.add_argument("--role", choices=ROLES, help="role of a new account, or a new role")
    parser.add_argument("--generate", action="store_true", help="generate a password and print it")
    parser.add_argument("--keep-password", action="store_true", help="change only the role")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    if arguments.what != "list" and not arguments.name:
        raise ConfigError(f"`{arguments.what}` needs the NAME of an account")
    if arguments.what == "list" and arguments.name:
        raise ConfigError(f"`list` lists all accounts; leave out {arguments.name!r}")
    if arguments.what == "add" and not arguments.role:
        raise ConfigError(f"`add` needs --role: {', '.join(ROLES)}")
    study, adds = people_study(arguments), arguments.what == "add"
    if adds:  # accounts may be created before the server first starts
        arguments.folder.mkdir(parents=True, exist_ok=True)
    with_store(study, arguments, lambda store: _do(store, arguments), create=adds)
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
    """Ask for a password. A command-line option would be visible to other users of the machine."""
    if arguments.generate:
        password = secrets.token_urlsafe(18)
        print(password)
        return password
    if sys.stdin is None or sys.stdin.closed:
        raise ConfigError("standard input is closed, so no password can be read; --generate makes one")
    if sys.stdin.isatty():
        password = getpass.getpass(f"Password of {arguments.name}: ")
        if getpass.getpass("Again: ") != password:
            raise ConfigError("the passwords differ; nothing was changed")
    else:
        password = sys.stdin.readline().rstrip("\n")
    if len(password) < MIN_PASSWORD:
        raise ConfigError(f"a password needs at least {MIN_PASSWORD} characters; --generate makes one")
    return password
