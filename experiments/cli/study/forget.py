"""`mjsim study forget`: delete who people are, by date."""

import argparse
import asyncio
from typing import TYPE_CHECKING, Any

from experiments.cli.options import add_command
from experiments.cli.requirements import require_extra
from experiments.cli.study.database import add_database, add_served_study, database_url
from experiments.errors import ConfigError

if TYPE_CHECKING:
    from experiments.people.retention import Retained
    from experiments.people.study_file import Study

DESCRIPTION = """\
Delete who people are, keep_days of [study.limits] after their last sign: ids of platforms, the keys by which people
are recognised, and links, also in backups that the study lists. What they did and answered stays under a number;
people who wanted their data deleted are erased. Who is owed a payment is kept until it is made. The server does the
same once a day; run this command after the study."""


def add_parser(commands: Any) -> None:
    """Add the subcommand."""
    parser = add_command(
        commands, "forget", run, summary="delete who people are, by date", description=DESCRIPTION
    )
    add_served_study(parser)
    parser.add_argument("--dry-run", action="store_true", help="delete nothing")
    add_database(parser)


def run(arguments: argparse.Namespace) -> int:
    """Forget, and say whom."""
    require_extra("people")
    from experiments.people.study_file import read_people_study
    from experiments.study.simulate import study_path

    study = read_people_study(study_path(arguments.study))
    if study.settings.limits.keep_days is None:
        raise ConfigError(f"{study.path} has no keep_days in [study.limits]; nothing is deleted by date")
    found = asyncio.run(_forget(study, study.settings.limits.keep_days, arguments))
    for what, names in (
        ("forgotten", found.forgotten),
        ("erased", found.erased),
        ("not paid yet", found.unpaid),
    ):
        print(f"{what}: {', '.join(names) or 'nobody'}")
    return 0


async def _forget(study: "Study", days: int, arguments: argparse.Namespace) -> "Retained":
    from experiments.people import VISITS
    from experiments.people.retention import forget_old
    from experiments.people.store import Store

    store = await Store.open(database_url(arguments), study.settings.name, study.sha256)
    try:
        return await forget_old(store, arguments.folder / VISITS, days, dry=arguments.dry_run)
    finally:
        await store.close()
