"""`mjsim study pay`: who gets what, and what was paid."""

import argparse
import asyncio
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import add_database, add_served_study, database_url
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.people.store import Store
    from experiments.people.study_file import Study

DESCRIPTION = """\
Print who gets what by the rules of [study.pay], why, and whether it was paid. What is printed is noted in the ledger,
where it stays: a rule that is changed later changes nothing that was decided. --dry-run notes nothing.

Pay by hand, or on the pages of the platform, then note each payment: --paid KEY --reference TEXT. A payment is noted
once; a second time is refused."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "pay", run, summary="who gets what, and what was paid", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--dry-run", action="store_true", help="note nothing")
    parser.add_argument("--paid", metavar="KEY", help="note that a payment was made, such as p00012-reward")
    parser.add_argument(
        "--reference", metavar="TEXT", help="the receipt, or the platform's number, of --paid"
    )
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    """Print, decide or note."""
    require_extra("people")
    from experiments.people.study_file import read_people_study
    from experiments.study.simulate import study_path

    if bool(arguments.paid) != bool(arguments.reference):
        raise ConfigError("--paid and --reference belong together: which payment was made, and its receipt")
    if arguments.paid and arguments.dry_run:
        raise ConfigError("--paid notes a payment, --dry-run notes nothing; leave out one of them")
    study = read_people_study(study_path(arguments.study))
    asyncio.run(_run(study, arguments))
    return 0


async def _run(study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.people.store import Store

    store = await Store.open(database_url(arguments), study.settings.name, study.sha256)
    try:
        if arguments.paid:
            await _note(store, arguments.paid, arguments.reference)
        else:
            await _print(store, study, dry=arguments.dry_run)
    finally:
        await store.close()


async def _print(store: "Store", study: "Study", *, dry: bool) -> None:
    from experiments.people.payments import decide, due

    payments = due(study, await store.people(), await store.trials())
    if not dry:
        await decide(store, payments)
    paid = {event.key for event in await store.ledger.history() if event.event == "confirmed"}
    for payment in payments:
        print(f"{payment}  {'paid' if payment.key in paid else 'owed'}")
    owed = sum(payment.cents for payment in payments if payment.key not in paid)
    print(f"{owed / 100:.2f} {study.settings.pay.currency} are owed for {len(payments)} payments")


async def _note(store: "Store", key: str, reference: str) -> None:
    attempt = await store.ledger.begin_sending(key)
    if attempt is None:
        raise ConfigError(f"{key} is paid already, or another payment of it is under way")
    await store.ledger.confirm(key, attempt, reference)
    print(f"{key} is paid ({reference})")
