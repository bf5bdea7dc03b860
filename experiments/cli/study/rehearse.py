"""`mjsim study rehearse`: test a complete study with simulated participants."""

import argparse
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

from experiments.cli.doctor import require_extra
from experiments.cli.options import add_command
from experiments.cli.server import number
from experiments.cli.study.database import add_study_file, checked_study, open_store
from experiments.session.signals import run_until_signal

if TYPE_CHECKING:
    from experiments.study.file import Study
    from experiments.study.rehearsal.person import Rehearsed
    from experiments.study.rehearsal.report import RehearsalReport
    from experiments.study.rehearsal.run import RehearsalSettings

MAX_FAULTS_SHOWN = 20
POSITIVE = 0.001, 1_000_000  # smallest and largest values of options that must be above 0
DESCRIPTION = """\
Rehearse a whole study with simulated participants. They use the real server (OUT/served), with pages by HTTP and trials
by WebSocket. They arrive and answer at random, leave, return, reload, lose the connection, and submit forms twice.
Waiting takes 1/FACTOR of the real time, and trials run faster than real time, except for every twentieth participant.
All data are marked as a rehearsal, and `collect` and `serve` keep them apart from real participants.

Then write the tables (OUT/table), the export (OUT/export), the analysis (OUT/analysis) and a list of faults,
OUT/rehearsal.json. `mjsim study pay` requires a rehearsal without faults. Repeat the command to continue after an
interruption."""


def add_parser(commands: Any) -> None:
    parser = add_command(
        commands, "rehearse", run, DESCRIPTION, "rehearse a study with simulated participants"
    )
    add_study_file(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="OUT", help="folder for the rehearsal")
    parser.add_argument(
        "--people",
        type=number(1, 100_000),
        metavar="N",
        help="participants (default: all of the study)",
    )
    parser.add_argument("--seed", type=number(0, 2**53), default=0, help="seed of the participants")
    parser.add_argument(
        "--per-minute",
        type=number(*POSITIVE, float),
        default=2.0,
        metavar="N",
        help="arrivals per minute",
    )
    parser.add_argument(
        "--dropouts",
        type=number(0, 1, float),
        default=0.2,
        metavar="SHARE",
        help="share of participants who leave",
    )
    parser.add_argument("--factor", type=number(*POSITIVE, float), default=20.0, help="speed-up of waiting")
    parser.add_argument(
        "--film", type=Path, metavar="FILE.mp4", help="film of the house (default: one is made)"
    )


def run(arguments: argparse.Namespace) -> int:
    study = checked_study(arguments, recruits=True)
    require_extra("study")
    from experiments.session.video import check_film
    from experiments.study.rehearsal.report import REPORT
    from experiments.study.rehearsal.run import RehearsalSettings

    check_film(arguments.film)
    people = arguments.people or study.people
    settings = RehearsalSettings(
        study.sha256, people, arguments.seed, arguments.per_minute, arguments.dropouts, arguments.factor
    )
    found = run_until_signal(_run(study, settings, arguments))
    for fault in found.faults[:MAX_FAULTS_SHOWN]:
        print(fault)
    if len(found.faults) > MAX_FAULTS_SHOWN:
        print(f"and {len(found.faults) - MAX_FAULTS_SHOWN} more")
    for what, count in sorted(found.outcomes.items()):
        print(f"{count:6d} {what}")
    print(f"finished by cell: {', '.join(str(count) for count in found.cells.values())}")
    print(f"{found.owed / 100:.2f} {study.settings.pay.currency} would be owed")
    print(f"{'passed' if found.passed else 'NOT PASSED'}: {arguments.out / REPORT}")
    return 0 if found.passed else 1


async def _run(
    study: "Study", settings: "RehearsalSettings", arguments: argparse.Namespace
) -> "RehearsalReport":
    from experiments.cli.terminal import counting_bars
    from experiments.study.rehearsal.report import report
    from experiments.study.rehearsal.run import SERVED, rehearse

    outcomes: Counter[str] = Counter()
    with counting_bars("people", "{task.fields[outcomes]}") as bars:
        bar = bars.add_task("people", total=settings.people, outcomes="")

        def show(rehearsed: "Rehearsed") -> None:
            outcomes[rehearsed.outcome] += 1
            text = ", ".join(f"{count} {what}" for what, count in outcomes.most_common(3))
            bars.update(bar, completed=outcomes.total(), outcomes=text)

        people = await rehearse(study, settings, arguments.out, arguments.film, show)
    store = await open_store(study, arguments, arguments.out / SERVED)
    try:
        return await report(study, settings, store, people, arguments.out)
    finally:
        await store.close()
