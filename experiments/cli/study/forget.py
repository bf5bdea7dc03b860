"""`mjsim study forget`: delete who people are, by date."""

import argparse
from typing import Any

from experiments.cli.options import add_command
from experiments.cli.study.database import add_database, add_served_study, people_study, with_store
from experiments.errors import ConfigError

DESCRIPTION = """\
Delete who people are, keep_days of [study.limits] after their last sign: ids of platforms, the keys by which people
are recognised, and links, also in backups that the study lists. What they did and answered stays under a number;
people who wanted their data deleted are erased. Who is owed a payment is kept until it is made. The server does the
same once a day; run this command after the study."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "forget", run, summary="delete who people are, by date", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--dry-run", action="store_true", help="delete nothing")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    study = people_study(arguments)
    from experiments.study.data.retention import forget_old
    from experiments.visit.folders import VISITS

    visits, days, dry = arguments.folder / VISITS, study.settings.limits.keep_days, arguments.dry_run
    if days is None:
        raise ConfigError(f"{study.path} has no keep_days in [study.limits]; nothing is deleted by date")
    found = with_store(study, arguments, lambda store: forget_old(store, visits, days, dry=dry))
    for what, names in (
        ("forgotten", found.forgotten),
        ("erased", found.erased),
        ("not paid yet", found.unpaid),
    ):
        print(f"{what}: {', '.join(names) or 'nobody'}")
    return 0
