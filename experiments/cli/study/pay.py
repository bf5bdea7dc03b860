"""`mjsim study pay`: determine the payments that are owed to participants, and make them."""

import argparse
import re
from decimal import Decimal
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.study.payments.platform import Payer
    from experiments.visit.store import Store

AMOUNT = re.compile(r"\d{1,4}(\.\d{1,2})?", re.ASCII)
DESCRIPTION = """\
Print the payments that follow from the rules of [study.pay], with the reason and whether each was made. Printed
payments are recorded in the ledger, so that later changes of the rules do not affect them. --dry-run records nothing.

With --send, the platform also makes all payments that are owed. The command may be repeated, or killed, at any time:
nothing is paid twice. The platform's secret is read from the environment (MJSIM_PROLIFIC_TOKEN, MJSIM_CONNECT_KEY or
MJSIM_EXTERNAL_QUESTION_TOKEN).

If you pay manually, record each payment with --paid KEY --reference TEXT. Recording a payment twice is refused. Both
--send and --paid require a rehearsal of the study file that passed (`mjsim study rehearse`): name it once with
--rehearsal OUT.

--reject PERSON --reason TEXT, before the payment is decided, makes the platform reject a submission.

--grant PERSON AMOUNT --reason TEXT records a payment that no rule gives, for example for a participant whom a fault of
the study stopped. The audit log records the amount and the reason. --send pays it as a bonus."""


def add_parser(commands: Any) -> None:
    parser = add_command(commands, "pay", run, DESCRIPTION, "decide and make payments")
    add_served_study(parser)
    parser.add_argument("--dry-run", action="store_true", help="print payments, but record nothing")
    parser.add_argument(
        "--send", action="store_true", help="make all payments that are owed, by the platform"
    )
    parser.add_argument("--paid", metavar="KEY", help="record a payment that was made, such as p00012-reward")
    parser.add_argument("--reference", metavar="TEXT", help="receipt or transaction number for --paid")
    parser.add_argument(
        "--reject", metavar="PERSON", help="reject the submission of a participant, such as p00012"
    )
    parser.add_argument(
        "--grant",
        nargs=2,
        metavar=("PERSON", "AMOUNT"),
        help="owe a participant an amount that no rule gives",
    )
    parser.add_argument(
        "--reason", metavar="TEXT", help="reason that the participant sees for --reject or --grant"
    )
    parser.add_argument(
        "--rehearsal",
        type=Path,
        metavar="OUT",
        help="folder of a rehearsal that passed; needed once before paying",
    )
    parser.add_argument(
        "--without-rehearsal", action="store_true", help="pay without a rehearsal; this is recorded"
    )
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    if bool(arguments.paid) != bool(arguments.reference):
        raise ConfigError("--paid and --reference belong together: name the payment and its receipt")
    if bool(arguments.reject or arguments.grant) != bool(arguments.reason):
        raise ConfigError("--reason belongs to --reject or --grant: name the participant and the reason")
    wanted = [name for name in ("dry_run", "send", "paid", "reject", "grant") if getattr(arguments, name)]
    if len(wanted) > 1:
        first, second = (name.replace("_", "-") for name in wanted[:2])
        raise ConfigError(f"--{first} and --{second} cannot be combined; leave one of them out")
    study = people_study(arguments)
    return with_store(study, arguments, lambda store: _run(study, store, arguments))


async def _run(study: "Study", store: "Store", arguments: argparse.Namespace) -> int:
    from experiments.study.recruitment import payer
    from experiments.study.rehearsal.report import require_rehearsal

    client = payer(study.settings) if arguments.send or arguments.reject else None
    try:
        if arguments.send or arguments.paid:
            folder, without = arguments.rehearsal, arguments.without_rehearsal
            await require_rehearsal(store, study, folder, without=without)
        if arguments.paid:
            await _note(store, arguments.paid, arguments.reference)
        elif arguments.reject and client is not None:
            await _reject(store, study, client, arguments)
        elif arguments.grant:
            await _grant(store, study, arguments)
        else:
            await _print(store, study, dry=arguments.dry_run)
            if client is not None:
                return await _send(store, study, client)
    finally:
        if client is not None:
            await client.close()
    return 0


async def _print(store: "Store", study: "Study", *, dry: bool) -> None:
    from experiments.study.payments.rules import decide, due, undecided
    from experiments.visit.store.ledger import by_key, paid

    history = await store.ledger.history()
    rejected = {event.person_id for event in history if event.kind == "rejection"}
    payments = due(study, await store.people(), await store.trials(), rejected)
    if dry:
        new = undecided(payments, history)
    else:
        await decide(store, payments)
        new, history = [], await store.ledger.history()
    rows = [
        (events[0].key, events[0].cents, events[0].currency, events[0].note, paid(events))
        for events in by_key(history).values()
    ]
    rows += [(one.key, one.cents, one.currency, one.why, False) for one in new]
    for key, cents, currency, why, done in sorted(rows):
        print(f"{key}  {cents / 100:.2f} {currency}  {why}  {'paid' if done else 'owed'}")
    owed = [cents for _, cents, _, _, done in rows if not done]
    print(
        f"{sum(owed) / 100:.2f} {study.settings.pay.currency} are owed in {len(owed)} of {len(rows)} payments"
    )


async def _send(store: "Store", study: "Study", client: "Payer") -> int:
    from experiments.study.payments.payouts import Sender

    async for sent in Sender(study.settings.name, store, client).send():
        print(f"{sent.key}  {sent.state}  {sent.text}", flush=True)
    left = len(await store.ledger.owed())
    print(f"{left} payments are still owed" if left else "all is paid")
    return int(left > 0)


async def _reject(store: "Store", study: "Study", client: "Payer", arguments: argparse.Namespace) -> None:
    from experiments.study.data.collect import person_number
    from experiments.study.payments.rules import reject

    if len(arguments.reason) < client.shortest_reason:
        raise ConfigError(
            f"--reason has {len(arguments.reason)} characters; the platform requires at least {client.shortest_reason}"
        )
    person = await store.person(person_number(arguments.reject))
    await reject(store, person, study.settings.pay.currency, arguments.reason)
    print(f"{arguments.reject} will be rejected by --send")


async def _grant(store: "Store", study: "Study", arguments: argparse.Namespace) -> None:
    from experiments.study.data.collect import person_number
    from experiments.study.payments.rules import grant

    name, amount = arguments.grant
    if not AMOUNT.fullmatch(amount) or not Decimal(amount):
        raise ConfigError(f"AMOUNT is {amount!r}; write it as a number above 0 such as 7.50")
    person, currency = await store.person(person_number(name)), study.settings.pay.currency
    key = await grant(store, person, Decimal(amount), currency, arguments.reason)
    print(f"{key}  {Decimal(amount):.2f} {currency}  {arguments.reason}  owed")


async def _note(store: "Store", key: str, reference: str) -> None:
    attempt = await store.ledger.begin_sending(key)
    if attempt is None:
        raise ConfigError(f"{key} is already paid, or a payment of it is in progress")
    await store.ledger.confirm(key, attempt, reference)
    print(f"{key} is paid ({reference})")
